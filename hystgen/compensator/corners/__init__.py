"""Steps of the corner engine: the bit reference of the emitted C, operation for operation.

Each module has the functions of the file of its name in `c_runtime/compensator/corners/`: same names, same order, same
operations. Comments that explain a step are in the C; `docs/corners.md` describes how the engine works.
"""
