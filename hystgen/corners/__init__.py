"""The bit reference of the corner engine: the emitted C, operation for operation, in Python.

Each module has the functions of the file of its name in `c_runtime/`, under the same names, in the same order, with the
same operations; comments that explain a step stand in the C. How the engine works is described in `docs/corners.md`.
The functions run as plain Python on scalars of the arrays that they are given, or compiled (see `hystgen.compiled`).
"""
