"""Steps of the corner engine: the bit-exact reference of the emitted C, operation for operation.

Each module has the functions of its namesake in `c_runtime/compensator/corners/`, with the same names, order and
operations; comments that explain a step are in the C. `docs/corners.md` describes how the engine works.
"""
