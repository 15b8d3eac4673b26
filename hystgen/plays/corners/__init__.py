"""The plays of the corner engine: the bit reference of the emitted C, operation for operation.

Each module has the functions of the file of its name in `c_runtime/plays/`, under the same names, in the same order and
with the same operations; comments that explain a step stand in the C. How the engine works is described in
`docs/corners.md`.
"""
