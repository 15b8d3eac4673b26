/* What the application needs from a board. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>

#define BOARD_RATE 20000 /* Hz */

/* Calls `control` every 1 / BOARD_RATE s, in an interrupt. */
void board_start(void (*control)(void));
/* Sleeps until the next interrupt. */
void board_wait(void);
/* Whether an interrupt was due before the one ahead of it had returned. */
bool board_late(void);
void board_print(const char *text);
/* Ends the emulation; on hardware this would be a reset. */
void board_exit(int code);

int main(void);

#endif
