/* Cortex-M under qemu: vector table, SysTick, and semihosting for text and the exit code. */
#include "board.h"

#include <stdint.h>

#define SYST_CSR (*(volatile uint32_t *)0xe000e010u)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014u)
#define SYST_CVR (*(volatile uint32_t *)0xe000e018u)
#define ICSR (*(volatile uint32_t *)0xe000ed04u)
#define CPACR (*(volatile uint32_t *)0xe000ed88u)
#define PENDSTSET (1u << 26)

#ifndef BOARD_CLOCK
#error "give the core's clock in Hz, -DBOARD_CLOCK=25000000"
#endif

extern uint32_t link_stack_top, link_data, link_data_end, link_data_source, link_bss, link_bss_end;

static void (*control_step)(void);
static volatile bool late;

void board_reset(void);

static uint32_t host(uint32_t operation, const void *argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void board_print(const char *text) {
    (void)host(0x04u, text); /* SYS_WRITE0 */
}

void board_exit(int code) {
    const uint32_t reason[2] = {0x20026u /* ADP_Stopped_ApplicationExit */, (uint32_t)code};
    (void)host(0x20u, reason); /* SYS_EXIT_EXTENDED */
    for (;;) {
    }
}

static void on_fault(void) {
    board_print("a fault\n");
    board_exit(2);
}

/* An FPU stacks its registers by itself when an interrupt uses it (lazily), so the handler is an ordinary function. */
static void on_tick(void) {
    control_step();
    if (ICSR & PENDSTSET) {
        late = true;
    }
}

void board_start(void (*control)(void)) {
    control_step = control;
    late = false;
    SYST_RVR = BOARD_CLOCK / BOARD_RATE - 1u;
    SYST_CVR = 0u;
    SYST_CSR = 7u; /* the core's clock, with the interrupt, on */
}

void board_wait(void) {
    __asm__ volatile("wfi" : : : "memory");
}

bool board_late(void) {
    return late;
}

void board_reset(void) {
    uint32_t *to;
    const uint32_t *from = &link_data_source;
#if defined(__ARM_FP)
    CPACR |= 0xfu << 20; /* switch the FPU on before the first function that may use it */
    __asm__ volatile("dsb\n\tisb" : : : "memory");
#endif
    for (to = &link_data; to < &link_data_end; ++to, ++from) {
        *(volatile uint32_t *)to = *from;
    }
    for (to = &link_bss; to < &link_bss_end; ++to) {
        *(volatile uint32_t *)to = 0u;
    }
    board_exit(main());
}

typedef void (*vector_t)(void);

__attribute__((section(".vectors"), used)) static const vector_t vectors[16] = {
    (vector_t)(uintptr_t)&link_stack_top, board_reset,
    on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault,
    on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_tick
};
