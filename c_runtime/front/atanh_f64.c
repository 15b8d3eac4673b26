/* The inverse hyperbolic tangent of float64. Called by envelope.c. Its numbers come from
   fit_coefficients.py. */
#include "arithmetic/double.h"
#include "hystgen_runtime.h"

/*
 * atanh x for |x| < 1, without division. Any other x, NaN included, is replaced by the largest
 * double below 1.
 *
 * Up to 1/2: x + x z P(z) with z = x^2. Above: (k log 2 + log(1 + |x|) - log m)/2, where 1 - |x| =
 * m / 2^k and m and 1 + |x| lie in [1, 2). Both logarithms come from the same eight polynomials, in
 * the distances d and e from the center of a piece of [1, 2); each center is a point whose
 * logarithm is almost a double. k and the piece are read off the integer 2^53 (1 - |x|).
 * fit_coefficients.py derives the numbers and the bound on the error: 1.48 ulp. The function is
 * odd; it keeps subnormal numbers and the sign of zero.
 */
static const hystgen_real_t hystgen_atanh_odd[13] = {
    0.33333333333334075, 0.1999999999978094,   0.14285714308911257, 0.11111109860963812,
    0.0909094898608242,  0.07691489387608846,  0.0667797596643101,  0.05774344611388931,
    0.05981775516513834, 0.014616467003962873, 0.14474656258153137, -0.15257288802008329,
    0.22454105963699375};
static const hystgen_real_t hystgen_atanh_center[8] = {
    1.062408447265625,  1.188018798828125, 1.3126068115234375, 1.4371795654296875,
    1.5625457763671875, 1.68756103515625,  1.8124542236328125, 1.9373626708984375};
/* center - 1, for the upper half of the pieces */
static const hystgen_real_t hystgen_atanh_offset[4] = {0.5625457763671875, 0.68756103515625,
                                                       0.8124542236328125, 0.9373626708984375};
static const hystgen_real_t hystgen_atanh_row[8][11] = {
    {0.030269225412204892, 0.470628788096401, -0.22149145618508512, 0.1389870074629139,
     -0.09811693032760505, 0.07388264492710107, -0.057952164595181536, 0.04675436252893168,
     -0.03850731222231797, 0.03247109761393457, -0.02746699887624167},
    {0.08614352237232714, 0.42086876107785975, -0.17713051405121297, 0.0993982666634258,
     -0.06275043801461326, 0.04225551905252465, -0.02964004768641377, 0.021384690513910502,
     -0.01574989256411507, 0.011858115640696954, -0.00902512739565673},
    {0.1360075461903928, 0.38092138149099664, -0.14510109887701675, 0.07369614805330625,
     -0.04210865778049575, 0.02566414114368281, -0.01629337258890508, 0.010639598344754806,
     -0.007091029132709916, 0.004828137939033398, -0.0034456811577290047},
    {0.1813412789177914, 0.3479036385063756, -0.12103694168598342, 0.05614558987493139,
     -0.029299882493302176, 0.016309657238144072, -0.009456988824719476, 0.0056401645879163775,
     -0.0034321285355772414, 0.0021333042101952028, -0.001500859678723102},
    {0.22315819953713723, 0.31999062527465016, -0.10239400026365973, 0.04368682689163022,
     -0.020969062582736626, 0.010735845544079926, -0.0057256149040979115, 0.003140801935208425,
     -0.0017592220712659612, 0.0010043006911543552, -0.0005387399789974112},
    {0.26164215604597374, 0.2962855799486419, -0.08778514488550282, 0.03467929675102262,
     -0.015412463325575802, 0.007306385029792335, -0.0036079605965212676, 0.001832541656991309,
     -0.0009502467625962031, 0.000502136060908878, -0.000260731466212152},
    {0.2973409257505162, 0.2758690362936833, -0.0761037251856084, 0.0279928817671214,
     -0.011583553970782928, 0.005112870172614878, -0.002350806166363913, 0.0011117429323722096,
     -0.000536254676880557, 0.00026324049028766017, -0.00017258237548952983},
    {0.3306638000985008, 0.25808280891885294, -0.06660673625945321, 0.022920071448994193,
     -0.008872914618661135, 0.0036639147803697886, -0.0015759958357201482, 0.0006972571680012851,
     -0.00031316844998055933, 0.0001451208468374469, -0.00022989476911220504}};

/* Index of the piece of [1, 2) that contains m / 2^53. */
static inline unsigned int hystgen_atanh_piece(uint_least64_t m) {
    return (unsigned int)(m >> 50) & 7u;
}

HYSTGEN_API hystgen_real_t hystgen_atanh(hystgen_real_t x) {
    hystgen_real_t a = x < 0.0 ? -x : x;
    unsigned int n;
    unsigned int step;
    if (a <= 0.5) {
        const hystgen_real_t z = x * x;
        hystgen_real_t p = hystgen_atanh_odd[12];
        for (n = 12u; n > 0u; --n) {
            p = hystgen_atanh_odd[n - 1u] + z * p;
        }
        return x + x * (z * p);
    }
    a = a < 1.0 ? a : 0.9999999999999999;

    /* exact down to d and e */
    const hystgen_real_t u = 1.0 - a;
    const uint_least64_t two = (uint_least64_t)1u << 54;
    const uint_least64_t whole = (uint_least64_t)(u * 9007199254740992.0);
    uint_least64_t m = whole << 1; /* shifted to 2^53 .. 2^54 - 1 below */
    unsigned int k = 1u;
    for (step = 32u; step > 0u; step >>= 1) {
        if (m < two >> step) {
            m <<= step;
            k += step;
        }
    }
    const unsigned int i = hystgen_atanh_piece(m);
    const unsigned int j = hystgen_atanh_piece(two - whole);
    const hystgen_real_t d =
        u * (hystgen_real_t)((uint_least64_t)1u << k) - hystgen_atanh_center[i];
    const hystgen_real_t e = a - hystgen_atanh_offset[j - 4u];

    const hystgen_real_t *p = hystgen_atanh_row[i];
    const hystgen_real_t *q = hystgen_atanh_row[j];
    hystgen_real_t lower = p[10];
    hystgen_real_t upper = q[10];
    for (n = 10u; n > 1u; --n) {
        lower = p[n - 1u] + d * lower;
        upper = q[n - 1u] + e * upper;
    }
    const hystgen_real_t y =
        (hystgen_real_t)k * 0.34657359027997264 + ((q[0] - p[0]) + (e * upper - d * lower));
    return x < 0.0 ? -y : y;
}
