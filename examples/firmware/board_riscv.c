/* RV32 on qemu's board `virt`: the machine timer, a UART for text, and the test device for the exit code. */
#include "board.h"

#include <stdint.h>

#define UART (*(volatile uint8_t *)0x10000000u)
#define EXIT (*(volatile uint32_t *)0x00100000u)
#define MTIMECMP ((volatile uint32_t *)0x02004000u)
#define MTIME ((volatile uint32_t *)0x0200bff8u)
#define CLOCK 10000000u /* Hz of MTIME */
#define MIE_TIMER (1u << 7)
#define MSTATUS_MIE (1u << 3)

extern uint32_t link_bss, link_bss_end;

static void (*control_step)(void);
static volatile bool late;
static uint64_t next;

void board_trap(void);
void board_entry(void);

__asm__(".section .entry,\"ax\"\n"
        ".globl board_reset\n"
        "board_reset:\n"
        "    la sp, link_stack_top\n"
        "    j board_entry\n");

static uint64_t now(void) {
    uint32_t high, low;
    do { /* the two halves have to belong together */
        high = MTIME[1];
        low = MTIME[0];
    } while (high != MTIME[1]);
    return (uint64_t)high << 32 | low;
}

static void wake_at(uint64_t time) {
    MTIMECMP[1] = 0xffffffffu; /* no interrupt in between */
    MTIMECMP[0] = (uint32_t)time;
    MTIMECMP[1] = (uint32_t)(time >> 32);
}

__attribute__((interrupt("machine"), aligned(4))) void board_trap(void) {
    uint32_t cause;
    __asm__ volatile("csrr %0, mcause" : "=r"(cause));
    if (cause != 0x80000007u) {
        board_print("a trap\n");
        board_exit(2);
    }
    next += CLOCK / BOARD_RATE;
    wake_at(next);
    control_step();
    if (now() >= next) {
        late = true;
    }
}

void board_start(void (*control)(void)) {
    control_step = control;
    late = false;
    next = now() + CLOCK / BOARD_RATE;
    wake_at(next);
    __asm__ volatile("csrw mtvec, %0" : : "r"(board_trap));
    __asm__ volatile("csrs mie, %0" : : "r"(MIE_TIMER));
    __asm__ volatile("csrs mstatus, %0" : : "r"(MSTATUS_MIE));
}

void board_wait(void) {
    __asm__ volatile("wfi" : : : "memory");
}

bool board_late(void) {
    return late;
}

void board_print(const char *text) {
    while (*text != '\0') {
        UART = (uint8_t)*text++;
    }
}

void board_exit(int code) {
    EXIT = code == 0 ? 0x5555u : (uint32_t)code << 16 | 0x3333u;
    for (;;) {
    }
}

void board_entry(void) {
    uint32_t *to;
    for (to = &link_bss; to < &link_bss_end; ++to) {
        *(volatile uint32_t *)to = 0u;
    }
    board_exit(main());
}
