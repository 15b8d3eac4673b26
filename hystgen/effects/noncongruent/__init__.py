"""Plays whose loops depend on where they lie."""
