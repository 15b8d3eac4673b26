/* With -fsingle-precision-constant the literals below would lose bits. */
typedef char hystgen_constants_are_double[sizeof(1.0) == sizeof(double) ? 1 : -1];
