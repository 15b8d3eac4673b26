"""Tanh envelopes."""
