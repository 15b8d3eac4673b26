"""A standing check of the stated error bounds against exact models that share nothing with the package.

`models` draws parameter files over all that is accepted, `oracle.c` is the exact model with the calls that lie on its
kinks, `check` emits and compiles a model and has the oracle follow it. `effects` and `effects.c` do the same for models
with effects, in long runs. `python -m tests.oracle` runs many of both.
"""
