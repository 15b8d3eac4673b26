"""The forward model: the static part, and effects in the order of the chain."""
