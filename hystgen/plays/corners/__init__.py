"""The plays of the corner engine: the bit reference of the emitted C, operation for operation.

Each module has the functions of its namesake in `c_runtime/plays/`, with the same names, order and operations; the C
has the comments that explain a step. How the engine works is described in `docs/corners.md`.
"""
