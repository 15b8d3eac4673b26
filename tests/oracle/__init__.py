"""A standing check of the stated error bounds against exact models that share nothing with the package.

`models` draws parameter files of every kind that is accepted, `oracle.c` holds the exact model and chooses calls at its
kinks, and `check` emits and compiles a model and has the oracle follow it. `effects` and `effects.c` do the same for
models with effects, in long runs. `python -m tests.oracle` runs many of both.
"""
