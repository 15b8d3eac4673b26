"""Gain and offset that follow a temperature."""
