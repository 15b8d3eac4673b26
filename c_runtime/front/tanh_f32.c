/* The hyperbolic tangent of float32. Called by envelope.c and by bent plays. Its numbers come from
   fit_coefficients.py. */
#include "hystgen_runtime.h"

/*
 * tanh x for every finite float, without division.
 *
 * Below hystgen_tanh_knot[0], just above tanh x = 1/2: x + x z P(z) with z = x^2. Above: one of
 * eight polynomials in the distance from the center of its piece; each center is a point where tanh
 * is almost a float, so the constant term adds no error. From 9.01 on, tanh rounds to 1.
 * fit_coefficients.py derives the numbers. Worst error over all floats: 0.78 ulp. The function is
 * odd and never decreases; it keeps subnormal numbers and the sign of zero. Infinities and NaN
 * give +-1.
 */
static const hystgen_real_t hystgen_tanh_odd[5] = {-0.33333313f, 0.13332483f, -0.053843424f,
                                                   0.021039838f, -0.0062336805f};
static const hystgen_real_t hystgen_tanh_knot[8] = {
    0.55078125f, 0.92578125f, 1.4101562f, 1.9179688f, 2.765625f, 3.625f, 4.7148438f, 6.2773438f};
static const hystgen_real_t hystgen_tanh_center[8] = {
    0.73535156f, 1.170166f, 1.6936035f, 2.3266602f, 3.2036133f, 4.1740723f, 5.4941406f, 7.6254883f};
static const hystgen_real_t hystgen_tanh_row[8][7] = {
    {0.62632847f, 0.60771275f, -0.38062757f, 0.035803653f, 0.10442458f, -0.062474374f,
     -0.0033697598f},
    {0.8243254f, 0.3204876f, -0.264186f, 0.11095632f, -0.003393885f, -0.02741945f, 0.017410442f},
    {0.93460464f, 0.12651409f, -0.11824018f, 0.068344474f, -0.024490042f, 0.0026476334f,
     0.0033727835f},
    {0.9811201f, 0.037403315f, -0.036697123f, 0.023537312f, -0.010862256f, 0.0036319834f,
     -0.0007353592f},
    {0.99670625f, 0.0065767034f, -0.006555054f, 0.004339194f, -0.00214062f, 0.0008554722f,
     -0.000270773f},
    {0.99952644f, 0.0009469281f, -0.00094646245f, 0.00062944076f, -0.000314251f, 0.00013154234f,
     -4.3273492e-05f},
    {0.9999662f, 6.761458e-05f, -6.760391e-05f, 4.4762248e-05f, -2.2428234e-05f, 9.961332e-06f,
     -3.2561238e-06f},
    {0.9999995f, 9.619075e-07f, -9.4929607e-07f, 5.922104e-07f, -3.1420487e-07f, 1.713307e-07f,
     -5.0430643e-08f}};

HYSTGEN_API hystgen_real_t hystgen_tanh(hystgen_real_t x) {
    const hystgen_real_t a = x < 0.0f ? -x : x;
    if (a < 0.00024414062f) {
        return x;
    }
    if (a < hystgen_tanh_knot[0]) {
        const hystgen_real_t *p = hystgen_tanh_odd;
        const hystgen_real_t z = x * x;
        return x + x * (z * (p[0] + z * (p[1] + z * (p[2] + z * (p[3] + z * p[4])))));
    }
    hystgen_real_t y = 1.0f;
    if (a < 9.010913f) {
        unsigned int i = a < hystgen_tanh_knot[4] ? 0u : 4u;
        i += a < hystgen_tanh_knot[i + 2u] ? 0u : 2u;
        i += a < hystgen_tanh_knot[i + 1u] ? 0u : 1u;
        const hystgen_real_t *p = hystgen_tanh_row[i];
        const hystgen_real_t d = a - hystgen_tanh_center[i]; /* exact */
        y = p[0] + d * (p[1] + d * (p[2] + d * (p[3] + d * (p[4] + d * (p[5] + d * p[6])))));
    }
    return x < 0.0f ? -y : y;
}
