"""Creep."""
