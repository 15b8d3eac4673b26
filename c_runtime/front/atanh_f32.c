/* The inverse hyperbolic tangent of float32. Called by envelope.c. Its numbers come from
   fit_coefficients.py. */
#include "hystgen_runtime.h"

/*
 * atanh x for |x| < 1, without division. Any other x, NaN included, is replaced by the largest
 * float below 1.
 *
 * Up to 1/2: x + x z P(z) with z = x^2. Above: (k log 2 + log(1 + |x|) - log m)/2, where 1 - |x| =
 * m / 2^k and m and 1 + |x| lie in [1, 2). Both logarithms come from the same eight polynomials, in
 * the distances d and e from the center of a piece of [1, 2); each center is a point whose
 * logarithm is almost a float. k and the piece are read off the integer 2^24 (1 - |x|).
 * fit_coefficients.py derives the numbers. Worst error over all floats: 1.07 ulp, and 0.84 where
 * |x| < 0.999. The function is odd and never decreases; it keeps subnormal numbers and the sign of
 * zero.
 */
static const hystgen_real_t hystgen_atanh_odd[6] = {0.33333296f, 0.20002694f,  0.14220285f,
                                                    0.11839814f, 0.050866313f, 0.17726555f};
static const hystgen_real_t hystgen_atanh_center[8] = {
    1.0612793f, 1.1879883f, 1.3120117f, 1.440918f, 1.5683594f, 1.6894531f, 1.8212891f, 1.9360352f};
/* center - 1, for the upper half of the pieces */
static const hystgen_real_t hystgen_atanh_offset[4] = {0.5683594f, 0.6894531f, 0.82128906f,
                                                       0.93603516f};
static const hystgen_real_t hystgen_atanh_row[8][5] = {
    {0.029737532f, 0.47112915f, -0.22196332f, 0.13979696f, -0.098547764f},
    {0.08613068f, 0.42087936f, -0.17713977f, 0.099614635f, -0.06286922f},
    {0.13578081f, 0.38109404f, -0.14523299f, 0.07392094f, -0.042167358f},
    {0.1826402f, 0.34700093f, -0.120409854f, 0.0557923f, -0.029089916f},
    {0.22501504f, 0.31880444f, -0.10163531f, 0.043249074f, -0.021028293f},
    {0.26220244f, 0.29595372f, -0.087589204f, 0.03459916f, -0.015269698f},
    {0.29977226f, 0.27453083f, -0.07536596f, 0.02760172f, -0.011743604f},
    {0.33032107f, 0.25825974f, -0.06669745f, 0.02298897f, -0.009052513f}};

/* Index of the piece of [1, 2) that contains m / 2^24. */
static inline unsigned int hystgen_atanh_piece(uint_least32_t m) {
    return (unsigned int)(m >> 21) & 7u;
}

HYSTGEN_API hystgen_real_t hystgen_atanh(hystgen_real_t x) {
    hystgen_real_t a = x < 0.0f ? -x : x;
    unsigned int step;
    if (a <= 0.5f) {
        const hystgen_real_t *p = hystgen_atanh_odd;
        const hystgen_real_t z = x * x;
        return x + x * (z * (p[0] + z * (p[1] + z * (p[2] + z * (p[3] + z * (p[4] + z * p[5]))))));
    }
    a = a < 1.0f ? a : 0.99999994f;

    /* exact down to d and e */
    const hystgen_real_t u = 1.0f - a;
    const uint_least32_t two = 33554432u; /* 2^25 */
    const uint_least32_t whole = (uint_least32_t)(u * 16777216.0f);
    uint_least32_t m = whole << 1; /* shifted to 2^24 .. 2^25 - 1 below */
    unsigned int k = 1u;
    for (step = 16u; step > 0u; step >>= 1) {
        if (m < two >> step) {
            m <<= step;
            k += step;
        }
    }
    const unsigned int i = hystgen_atanh_piece(m);
    const unsigned int j = hystgen_atanh_piece(two - whole);
    const hystgen_real_t d =
        u * (hystgen_real_t)((uint_least32_t)1u << k) - hystgen_atanh_center[i];
    const hystgen_real_t e = a - hystgen_atanh_offset[j - 4u];

    const hystgen_real_t *p = hystgen_atanh_row[i];
    const hystgen_real_t *q = hystgen_atanh_row[j];
    const hystgen_real_t difference = e * (q[1] + e * (q[2] + e * (q[3] + e * q[4]))) -
                                      d * (p[1] + d * (p[2] + d * (p[3] + d * p[4])));
    const hystgen_real_t y = (hystgen_real_t)k * 0.3465736f + ((q[0] - p[0]) + difference);
    return x < 0.0f ? -y : y;
}
