"""tanh and atanh with the same bits as the C kernels `c_runtime/front/{tanh,atanh}_{f32,f64}.c`.

They perform the same operations in the same order on numbers of the same format, float32 or float64. Every constant
comes from a table in that format, since a Python float next to a float32 would widen it in compiled functions.
They run unchanged on numpy scalars (`tanh.py_func`), compiled, and, with the tables in `SCALAR`, on Python floats,
which is several times faster than on numpy scalars. Comments in the C files describe the method; the coefficients come
from `c_runtime/front/fit_coefficients.py`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hystgen.basics.jit import Scalar, jit
from hystgen.basics.structures import NumberArray

__all__ = [
    "ATANH_MAX_ULP",
    "ATANH_TABLES",
    "SCALAR",
    "TANH_MAX_ULP",
    "TANH_TABLES",
    "AtanhTables",
    "TanhTables",
    "atanh",
    "tanh",
]

Reals = NumberArray

#: Largest error of `tanh` and `atanh` in ulp of the true value: float32 measured over all arguments, float64 a bound.
TANH_MAX_ULP = {"float32": 0.78, "float64": 0.86}
ATANH_MAX_ULP = {"float32": 1.07, "float64": 1.48}


class TanhTables(NamedTuple):
    """Constants of `tanh`: one-dimensional arrays in one format."""

    bound: Reals  # tanh x is x below the first, 1 from the second on
    one: Reals
    odd: Reals  # coefficients of P in x + x z P(z), z = x^2
    knot: Reals  # where the pieces begin
    center: Reals  # where they are expanded
    row: Reals  # their coefficients from degree 0, piece after piece


class AtanhTables(NamedTuple):
    """Constants of `atanh`: one-dimensional arrays in one format."""

    bound: Reals  # 1/2 and the largest number below 1
    one: Reals
    half_log2: Reals
    odd: Reals  # coefficients of P in x + x z P(z), z = x^2
    center: Reals  # where the pieces of log(m)/2, 1 <= m < 2, are expanded
    offset: Reals  # center - 1, for the upper half of the pieces
    row: Reals  # their coefficients from degree 0, piece after piece
    power: Reals  # 2^0, 2^1, .. up to the number of bits of the significand
    number: Reals  # 0, 1, .. likewise


@jit
def tanh(x: Scalar, t: TanhTables) -> Scalar:
    """Hyperbolic tangent of one number, with the same bits as `hystgen_tanh`.

    `x`: numpy scalar of the tables' format, no unit; returns the same format. Infinities give +-1, NaN gives 1;
    raises nothing. Largest error: `TANH_MAX_ULP`.
    """
    a = -x if x < 0 else x
    if a < t.bound[0]:
        return x
    if a < t.knot[0]:
        z = x * x
        p: Scalar = t.odd[len(t.odd) - 1]
        for n in range(len(t.odd) - 1, 0, -1):
            p = t.odd[n - 1] + z * p
        return x + x * (z * p)
    y: Scalar = t.one[0]
    if a < t.bound[1]:
        i = 0
        step = len(t.knot) // 2
        while step > 0:
            if a >= t.knot[i + step]:
                i += step
            step //= 2
        degree = len(t.row) // len(t.knot) - 1
        first = i * (degree + 1)
        d = a - t.center[i]  # exact
        y = t.row[first + degree]
        for n in range(degree, 0, -1):
            y = t.row[first + n - 1] + d * y
    return -y if x < 0 else y


@jit
def atanh(x: Scalar, t: AtanhTables) -> Scalar:
    """Inverse hyperbolic tangent of one number, with the same bits as `hystgen_atanh`.

    `x`: numpy scalar of the tables' format, |x| < 1, no unit; returns the same format. Larger |x| and NaN are treated
    as the largest number below 1; raises nothing. Largest error: `ATANH_MAX_ULP`.
    """
    a = -x if x < 0 else x
    if a <= t.bound[0]:
        z = x * x
        p: Scalar = t.odd[len(t.odd) - 1]
        for n in range(len(t.odd) - 1, 0, -1):
            p = t.odd[n - 1] + z * p
        return x + x * (z * p)
    if not a < t.one[0]:
        a = t.bound[1]

    # exact down to d and e
    bits = len(t.power) - 1
    u = t.one[0] - a
    whole = int(u * t.power[bits])
    m = 2 * whole  # to be scaled to 2^bits .. 2^(bits + 1) - 1
    k = 1
    while m < 1 << bits:
        m *= 2
        k += 1
    pieces = len(t.center)
    i = m * pieces // (1 << bits) - pieces
    j = ((2 << bits) - whole) * pieces // (1 << bits) - pieces
    d = u * t.power[k] - t.center[i]
    e = a - t.offset[j - pieces // 2]

    degree = len(t.row) // pieces - 1
    lower: Scalar = t.row[i * (degree + 1) + degree]
    upper: Scalar = t.row[j * (degree + 1) + degree]
    for n in range(degree, 1, -1):
        lower = t.row[i * (degree + 1) + n - 1] + d * lower
        upper = t.row[j * (degree + 1) + n - 1] + e * upper
    start = t.row[j * (degree + 1)] - t.row[i * (degree + 1)]
    y: Scalar = t.number[k] * t.half_log2[0] + (start + (e * upper - d * lower))
    return -y if x < 0 else y


def _array(values: list[float], dtype: npt.DTypeLike) -> Reals:
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


def _tanh_tables(dtype: npt.DTypeLike, **values: list[float]) -> TanhTables:
    return TanhTables(one=_array([1.0], dtype), **{key: _array(v, dtype) for key, v in values.items()})


def _atanh_tables(dtype: npt.DTypeLike, **values: list[float]) -> AtanhTables:
    bits = np.finfo(np.dtype(dtype)).nmant + 1
    return AtanhTables(
        one=_array([1.0], dtype),
        power=_array([2.0**k for k in range(bits + 1)], dtype),
        number=_array([float(k) for k in range(bits + 1)], dtype),
        **{key: _array(v, dtype) for key, v in values.items()},
    )


_TANH_FLOAT32 = _tanh_tables(
    np.float32,
    bound=[0.00024414062, 9.010913],
    odd=[-0.33333313, 0.13332483, -0.053843424, 0.021039838, -0.0062336805],
    knot=[0.55078125, 0.92578125, 1.4101562, 1.9179688, 2.765625, 3.625, 4.7148438, 6.2773438],
    center=[0.73535156, 1.170166, 1.6936035, 2.3266602, 3.2036133, 4.1740723, 5.4941406, 7.6254883],
    row=[
        0.62632847, 0.60771275, -0.38062757, 0.035803653, 0.10442458, -0.062474374, -0.0033697598, 0.8243254,
        0.3204876, -0.264186, 0.11095632, -0.003393885, -0.02741945, 0.017410442, 0.93460464, 0.12651409,
        -0.11824018, 0.068344474, -0.024490042, 0.0026476334, 0.0033727835, 0.9811201, 0.037403315,
        -0.036697123, 0.023537312, -0.010862256, 0.0036319834, -0.0007353592, 0.99670625, 0.0065767034,
        -0.006555054, 0.004339194, -0.00214062, 0.0008554722, -0.000270773, 0.99952644, 0.0009469281,
        -0.00094646245, 0.00062944076, -0.000314251, 0.00013154234, -4.3273492e-05, 0.9999662, 6.761458e-05,
        -6.760391e-05, 4.4762248e-05, -2.2428234e-05, 9.961332e-06, -3.2561238e-06, 0.9999995, 9.619075e-07,
        -9.4929607e-07, 5.922104e-07, -3.1420487e-07, 1.713307e-07, -5.0430643e-08,
    ],
)

_TANH_FLOAT64 = _tanh_tables(
    np.float64,
    bound=[7.450580596923828e-09, 19.061547465398498],
    odd=[
        -0.3333333333333333, 0.1333333333333298, -0.05396825396799937, 0.021869488526593105,
        -0.008863235315274734, 0.003592124930902012, -0.0014558041294032017, 0.0005898244164258485,
        -0.00023818516616666636, 9.390504760835696e-05, -3.288861011512297e-05, 7.406506249004806e-06,
    ],
    knot=[0.55078125, 1.1171875, 1.875, 2.80859375, 4.12109375, 5.9921875, 8.56640625, 12.37109375],
    center=[
        0.8349609375, 1.4962615966796875, 2.3412933349609375, 3.464447021484375, 5.056610107421875,
        7.2794036865234375, 10.469131469726562, 15.71673583984375,
    ],
    row=[
        0.6831308095731643, 0.5333322970119134, -0.3643357238292575, 0.07111152563851236, 0.07286676719502522,
        -0.061629546712628804, 0.00971577053148066, 0.014357550113472077, -0.010656343134749861,
        0.0010866664683787603, 0.002794645894883126, -0.0018183437629927294, 7.221921204366028e-05,
        0.0005378709881116889, -0.0002742729254954188, -2.806673717114689e-05, 0.9044704088060583,
        0.18193327959420186, -0.16455326776999088, 0.08818913483887894, -0.024913373583950477,
        -0.0028200073204430053, 0.00719833178867178, -0.003995961051610489, 0.001009413925949987,
        0.00020819455301446672, -0.00034689826436713544, 0.00017632923019681465, -3.853400494629199e-05,
        -1.3147516037649723e-05, 1.7101950818926266e-05, -7.2377906682432585e-06, 0.9816596543772679,
        0.03634432296790308, -0.03567775552325008, 0.022908638833262163, -0.010595901304624308,
        0.003573007490295134, -0.0007683492184208539, -4.583425326653147e-06, 0.00010065996165535119,
        -5.8677565695525885e-05, 2.1846152607694562e-05, -5.480788395053899e-06, 4.913075513201404e-07,
        4.0600623653034747e-07, -3.303223945288968e-07, 1.2789491927173774e-07, 0.9980437491448005,
        0.003908674792990366, -0.003901028444582679, 0.0025905054566942886, -0.001285094963385026,
        0.0005059386160509269, -0.00016327340511846123, 4.360225850689454e-05, -9.394025861488005e-06,
        1.429308160037259e-06, -2.9247827027978838e-08, -8.430745027545213e-08, 4.195539510453659e-08,
        -1.431495266911362e-08, 4.201155260439893e-09, -9.055254375638037e-10, 0.9999189231893918,
        0.00016214704776714716, -0.00016213390140101905, 0.00010807174018063826, -5.40183442851032e-05,
        2.159331896123272e-05, -7.188428912230714e-06, 2.048499149535033e-06, -5.094579125442915e-07,
        1.120280017071197e-07, -2.1930318014820837e-08, 3.815419427367703e-09, -5.812402028504599e-10,
        7.210441428350184e-11, -3.596356948254922e-12, -1.0635418324721757e-12, 0.9999990489133539,
        1.902172387597264e-06, -1.9021705788452827e-06, 1.268111307565996e-06, -6.340532363992083e-07,
        2.5361936274263935e-07, -8.453852686011242e-08, 2.4153133853339184e-08, -6.037854224640753e-09,
        1.3415775627119405e-09, -2.6832997170449107e-10, 4.876605715130509e-11, -8.062653749416283e-12,
        1.237291327902265e-12, -1.9732731191852989e-13, 2.6157748236055848e-14, 0.9999999983869124,
        3.22617507609528e-09, -3.2261752590547366e-09, 2.1507835906074425e-09, -1.0753906425196764e-09,
        4.301561330635992e-10, -1.4338794071132632e-10, 4.096803606836319e-11, -1.0239206641008208e-11,
        2.2753821943804273e-12, -4.567321709334015e-13, 8.303114924049273e-14, -1.329682663115904e-14,
        2.0489621218472536e-15, -3.849230693272181e-16, 5.1008771744154083e-17, 0.9999999999999554,
        8.926140808103939e-14, -8.92837370792539e-14, 5.951703157340035e-14, -2.971605913822337e-14,
        1.1893499796049406e-14, -3.995074057679522e-15, 1.1380669988001295e-15, -2.7372079785954633e-16,
        6.161421600071284e-17, -1.4391261902223983e-17, 2.520699890048926e-18, -2.0071490996024172e-19,
        3.675347668074103e-20, -1.7362477299713478e-20, 2.1721233154249034e-21,
    ],
)

_ATANH_FLOAT32 = _atanh_tables(
    np.float32,
    bound=[0.5, 0.99999994],
    half_log2=[0.3465736],
    odd=[0.33333296, 0.20002694, 0.14220285, 0.11839814, 0.050866313, 0.17726555],
    center=[1.0612793, 1.1879883, 1.3120117, 1.440918, 1.5683594, 1.6894531, 1.8212891, 1.9360352],
    offset=[0.5683594, 0.6894531, 0.82128906, 0.93603516],
    row=[
        0.029737532, 0.47112915, -0.22196332, 0.13979696, -0.098547764, 0.08613068, 0.42087936, -0.17713977,
        0.099614635, -0.06286922, 0.13578081, 0.38109404, -0.14523299, 0.07392094, -0.042167358, 0.1826402,
        0.34700093, -0.120409854, 0.0557923, -0.029089916, 0.22501504, 0.31880444, -0.10163531, 0.043249074,
        -0.021028293, 0.26220244, 0.29595372, -0.087589204, 0.03459916, -0.015269698, 0.29977226, 0.27453083,
        -0.07536596, 0.02760172, -0.011743604, 0.33032107, 0.25825974, -0.06669745, 0.02298897, -0.009052513,
    ],
)

_ATANH_FLOAT64 = _atanh_tables(
    np.float64,
    bound=[0.5, 0.9999999999999999],
    half_log2=[0.34657359027997264],
    odd=[
        0.33333333333334075, 0.1999999999978094, 0.14285714308911257, 0.11111109860963812, 0.0909094898608242,
        0.07691489387608846, 0.0667797596643101, 0.05774344611388931, 0.05981775516513834,
        0.014616467003962873, 0.14474656258153137, -0.15257288802008329, 0.22454105963699375,
    ],
    center=[
        1.062408447265625, 1.188018798828125, 1.3126068115234375, 1.4371795654296875, 1.5625457763671875,
        1.68756103515625, 1.8124542236328125, 1.9373626708984375,
    ],
    offset=[0.5625457763671875, 0.68756103515625, 0.8124542236328125, 0.9373626708984375],
    row=[
        0.030269225412204892, 0.470628788096401, -0.22149145618508512, 0.1389870074629139,
        -0.09811693032760505, 0.07388264492710107, -0.057952164595181536, 0.04675436252893168,
        -0.03850731222231797, 0.03247109761393457, -0.02746699887624167, 0.08614352237232714,
        0.42086876107785975, -0.17713051405121297, 0.0993982666634258, -0.06275043801461326,
        0.04225551905252465, -0.02964004768641377, 0.021384690513910502, -0.01574989256411507,
        0.011858115640696954, -0.00902512739565673, 0.1360075461903928, 0.38092138149099664,
        -0.14510109887701675, 0.07369614805330625, -0.04210865778049575, 0.02566414114368281,
        -0.01629337258890508, 0.010639598344754806, -0.007091029132709916, 0.004828137939033398,
        -0.0034456811577290047, 0.1813412789177914, 0.3479036385063756, -0.12103694168598342,
        0.05614558987493139, -0.029299882493302176, 0.016309657238144072, -0.009456988824719476,
        0.0056401645879163775, -0.0034321285355772414, 0.0021333042101952028, -0.001500859678723102,
        0.22315819953713723, 0.31999062527465016, -0.10239400026365973, 0.04368682689163022,
        -0.020969062582736626, 0.010735845544079926, -0.0057256149040979115, 0.003140801935208425,
        -0.0017592220712659612, 0.0010043006911543552, -0.0005387399789974112, 0.26164215604597374,
        0.2962855799486419, -0.08778514488550282, 0.03467929675102262, -0.015412463325575802,
        0.007306385029792335, -0.0036079605965212676, 0.001832541656991309, -0.0009502467625962031,
        0.000502136060908878, -0.000260731466212152, 0.2973409257505162, 0.2758690362936833,
        -0.0761037251856084, 0.0279928817671214, -0.011583553970782928, 0.005112870172614878,
        -0.002350806166363913, 0.0011117429323722096, -0.000536254676880557, 0.00026324049028766017,
        -0.00017258237548952983, 0.3306638000985008, 0.25808280891885294, -0.06660673625945321,
        0.022920071448994193, -0.008872914618661135, 0.0036639147803697886, -0.0015759958357201482,
        0.0006972571680012851, -0.00031316844998055933, 0.0001451208468374469, -0.00022989476911220504,
    ],
)

TANH_TABLES = {"float32": _TANH_FLOAT32, "float64": _TANH_FLOAT64}
"""Constants of `tanh` in each format; read-only arrays."""

ATANH_TABLES = {"float32": _ATANH_FLOAT32, "float64": _ATANH_FLOAT64}
"""Constants of `atanh` in each format; read-only arrays."""

SCALAR = TanhTables(*(x.tolist() for x in _TANH_FLOAT64)), AtanhTables(*(x.tolist() for x in _ATANH_FLOAT64))
"""Float64 constants for both as Python floats, which give the same bits as numpy scalars."""
