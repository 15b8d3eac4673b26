/*
 * hystgen run time: the kernels behind every emitted model.
 *
 * Emitted code either contains these functions, with its own prefix in place of "hystgen_"
 * (self-contained and single-header layouts), or calls them here (shared-runtime layout). They
 * cannot fail, take bounded time, never allocate, divide or recurse, and need only <float.h>,
 * <stdbool.h>, <stddef.h> and <stdint.h>.
 */
#ifndef HYSTGEN_RUNTIME_H
#define HYSTGEN_RUNTIME_H

#include "kernels.h"

/* A user's own effect includes only this header: through it an editor finds hystgen_product. */
#if !defined(HYSTGEN_CONFIGURED) && !defined(HYSTGEN_FIXED)
#include "arithmetic/product.c"
#endif

#endif
