/* With -fsingle-precision-constant the numbers below would not be those of the model. */
typedef char hystgen_constants_are_double[sizeof(1.0) == sizeof(double) ? 1 : -1];
