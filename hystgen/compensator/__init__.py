"""The compensator in one arithmetic: tables, bounds and the bit-exact reference of the emitted C."""
