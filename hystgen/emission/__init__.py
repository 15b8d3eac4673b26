"""Emission: writes a model's numbers in one arithmetic as C text in files."""
