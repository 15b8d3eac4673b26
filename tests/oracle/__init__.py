"""A standing check of the stated error bounds against an exact model that shares nothing with the package.

`models` draws parameter files over all that is accepted, `oracle.c` is the exact model with the calls that lie on its
kinks, `check` emits and compiles a model and has the oracle follow it. `python -m tests.oracle` runs many.
"""
