/* Numbers in the bytes of a block of parameters or of a snapshot, their limits, and the CRC. Called
   by what emission writes for a module that loads its parameters. */
#ifndef HYSTGEN_BLOCK_C
#define HYSTGEN_BLOCK_C
#include "compensator/model.h"

/* A whole number of `size` bytes, the lowest first. */
static uint64_t hystgen_bytes(const unsigned char *at, unsigned int size) {
    uint64_t bits = 0;
    while (size > 0) {
        --size;
        bits = (bits << 8u) | at[size];
    }
    return bits;
}

/* The next whole number; `size` negative: of a signed type. */
static int64_t hystgen_whole(const unsigned char **at, int size) {
    const unsigned int bytes = (unsigned int)(size < 0 ? -size : size);
    const uint64_t bits = hystgen_bytes(*at, bytes);
    const uint64_t sign = (uint64_t)1 << (8u * bytes - 1u);
    *at += bytes;
    if (size < 0 && bits >= sign) {
        return -(int64_t)(sign - 1u - (bits - sign)) - 1;
    }
    return (int64_t)bits;
}

/* The next number in single precision. */
static float hystgen_float(const unsigned char **at) {
    union {
        uint32_t bits;
        float number;
    } u;
    u.bits = (uint32_t)hystgen_bytes(*at, 4u);
    *at += 4;
    return u.number;
}

/* The next number in double precision. */
static double hystgen_double(const unsigned char **at) {
    union {
        uint64_t bits;
        double number;
    } u;
    u.bits = hystgen_bytes(*at, 8u);
    *at += 8;
    return u.number;
}

/* Appends a whole number of `size` bytes, the lowest first. */
static void hystgen_append(unsigned char **at, uint64_t bits, unsigned int size) {
    while (size > 0) {
        **at = (unsigned char)(bits & 0xffu);
        bits >>= 8u;
        ++*at;
        --size;
    }
}

/* Appends a number in single precision. */
static void hystgen_append_float(unsigned char **at, float x) {
    union {
        uint32_t bits;
        float number;
    } u;
    u.number = x;
    hystgen_append(at, u.bits, 4u);
}

/* Appends a number in double precision. */
static void hystgen_append_double(unsigned char **at, double x) {
    union {
        uint64_t bits;
        double number;
    } u;
    u.number = x;
    hystgen_append(at, u.bits, 8u);
}

/* CRC-32 of a block, as in IEEE 802.3. */
static uint32_t hystgen_crc(const unsigned char *at, size_t size) {
    uint32_t crc = 0xffffffffu;
    size_t i;
    for (i = 0; i < size; ++i) {
        unsigned int bit;
        crc ^= at[i];
        for (bit = 0; bit < 8u; ++bit) {
            crc = (crc >> 1u) ^ ((crc & 1u) != 0 ? 0xedb88320u : 0u);
        }
    }
    return crc ^ 0xffffffffu;
}

/* Limits of `count` whole numbers of `size` bytes, in the order of a block. `rises`: 1 if they
   rise, 255 if they are above the number before, 254 if `sum` limits all of them together, or from
   2 on, how many coefficients each of several polynomials has: only the first has these limits, and
   `sum` limits the others together. */
typedef struct {
    int64_t least;
    int64_t most;
    uint16_t count;
    int8_t size; /* negative: of a signed type */
    uint8_t rises;
    int64_t sum;
} hystgen_whole_range_t;

/* Whether whole numbers are within their limits. */
static bool hystgen_wholes_fit(const hystgen_whole_range_t *range, unsigned int rows,
                               const unsigned char **at) {
    int64_t before = 0;
    unsigned int row;
    for (row = 0; row < rows; ++row) {
        const unsigned int rises = range[row].rises;
        const unsigned int each = rises > 1u && rises < 254u ? rises : 1u;
        int64_t sum = 0;
        unsigned int i;
        for (i = 0; i < range[row].count; ++i) {
            const int64_t x = hystgen_whole(at, range[row].size);
            if (i % each == 0 && (x < range[row].least || x > range[row].most)) {
                return false;
            }
            if (((rises == 1u && i > 0) || rises == 255u) && x < before) {
                return false;
            }
            sum = i % each > 0 || rises == 254u ? sum + (x < 0 ? -x : x) : 0;
            if (sum > range[row].sum) {
                return false;
            }
            before = x;
        }
    }
    return true;
}

/* Limits of `count` numbers in the order of a block. `rises`: 1 if they rise, 255 if they are above
   the number before. */
typedef struct {
    float least;
    float most;
    uint16_t count;
    uint8_t rises;
} hystgen_float_range_t;

/* Whether numbers in single precision are within their limits; NaN is not. */
static bool hystgen_floats_fit(const hystgen_float_range_t *range, unsigned int rows,
                               const unsigned char **at) {
    float before = 0;
    unsigned int row;
    for (row = 0; row < rows; ++row) {
        const unsigned int rises = range[row].rises;
        unsigned int i;
        for (i = 0; i < range[row].count; ++i) {
            const float x = hystgen_float(at);
            if (!(x >= range[row].least && x <= range[row].most)) {
                return false;
            }
            if (((rises == 1u && i > 0) || rises == 255u) && x < before) {
                return false;
            }
            before = x;
        }
    }
    return true;
}

/* Limits of `count` numbers in double precision. */
typedef struct {
    double least;
    double most;
    uint16_t count;
    uint8_t rises;
} hystgen_double_range_t;

/* Whether numbers in double precision are within their limits; NaN is not. */
static bool hystgen_doubles_fit(const hystgen_double_range_t *range, unsigned int rows,
                                const unsigned char **at) {
    double before = 0;
    unsigned int row;
    for (row = 0; row < rows; ++row) {
        const unsigned int rises = range[row].rises;
        unsigned int i;
        for (i = 0; i < range[row].count; ++i) {
            const double x = hystgen_double(at);
            if (!(x >= range[row].least && x <= range[row].most)) {
                return false;
            }
            if (((rises == 1u && i > 0) || rises == 255u) && x < before) {
                return false;
            }
            before = x;
        }
    }
    return true;
}

/* Whether `count` numbers that only describe the unit are finite. */
static bool hystgen_described(unsigned int count, const unsigned char **at) {
    unsigned int i;
    for (i = 0; i < count; ++i) {
        if (((hystgen_bytes(*at, 8u) >> 52u) & 0x7ffu) == 0x7ffu) {
            return false;
        }
        *at += 8;
    }
    return true;
}

/* Where `count` factors lie in a block, mantissas from 2^30 on and shifts, the largest one, and the
   largest sum of their sizes, at the same shift. */
typedef struct {
    uint32_t mantissa;
    uint32_t shift;
    uint32_t count;
    int32_t most;
    uint8_t most_shift;
    int64_t sum;
} hystgen_factor_range_t;

/* Whether no factor is larger than its limit, nor are all of them together. */
static bool hystgen_factors_fit(const hystgen_factor_range_t *range, unsigned int rows,
                                const unsigned char *at) {
    unsigned int row;
    for (row = 0; row < rows; ++row) {
        const unsigned char *mantissa = &at[range[row].mantissa];
        const unsigned char *shift = &at[range[row].shift];
        int64_t sum = 0;
        unsigned int i;
        for (i = 0; i < range[row].count; ++i) {
            const int64_t x = hystgen_whole(&mantissa, -4);
            const int64_t size = x < 0 ? -x : x;
            const int64_t below = range[row].most_shift - hystgen_whole(&shift, 1);
            if (below >= 0 && size > (below < 32 ? range[row].most >> below : 0)) {
                return false;
            }
            if (below >= 0) { /* at most 31, or the factor is 0 */
                sum += size == 0 ? 0 : size << below;
            } else {
                sum += below > -63 ? size >> -below : 0;
            }
            if (sum > range[row].sum) {
                return false;
            }
        }
    }
    return true;
}

#endif
