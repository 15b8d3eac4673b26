"""Fitting and emitting many units of one design."""
