"""The forward model: the static part and the effects, in the order of the chain."""
