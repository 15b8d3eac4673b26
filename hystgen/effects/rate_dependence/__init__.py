"""Plays that depend on the rate of their input."""
