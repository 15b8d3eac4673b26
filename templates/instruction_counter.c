/*
 * `hystgen verify --targets` compiles this for the host, and the emulator calls it before every instruction. It counts
 * the instructions of each call of `step` that the harness makes, from entry to return, but not those of the harness
 * itself, nor a step that is part of a reset.
 */
#include <stdint.h>

typedef struct {
    uint64_t entry;                /* first instruction of step */
    uint64_t caller, caller_end;   /* code of the harness */
    uint64_t calls, capacity;      /* calls so far, and room in `counts` */
    uint32_t *counts;              /* instructions of each call */
    uint64_t stack_pointer;        /* at the last call */
    int (*read_register)(void *emulator, int number, void *value);
    int64_t stack_register;
    uint64_t last, behind;         /* address of the previous instruction, and the address after it */
    uint64_t back;                 /* return address of the call that is being counted, 0 for none */
    uint32_t count;
} hystgen_counter_t;

void hystgen_count_instruction(void *emulator, uint64_t address, uint32_t size, void *user);
void hystgen_count_instruction(void *emulator, uint64_t address, uint32_t size, void *user) {
    hystgen_counter_t *c = (hystgen_counter_t *)user;
    if (c->back != 0 && address == c->back) {
        if (c->calls < c->capacity) {
            c->counts[c->calls] = c->count;
        }
        ++c->calls;
        c->back = 0;
    }
    if (address == c->entry && c->last >= c->caller && c->last < c->caller_end) {
        uint32_t value = 0;
        (void)c->read_register(emulator, (int)c->stack_register, &value);
        c->stack_pointer = value;
        c->back = c->behind;
        c->count = 0;
    }
    c->count += c->back != 0;
    c->last = address;
    c->behind = address + size;
}
