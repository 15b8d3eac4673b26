"""Emission: a model's numbers, in an arithmetic, as C text in files."""
