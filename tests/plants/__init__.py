"""Blind plants: records of actuators with known faults, for judging `hystgen diagnose` from outside.

The plants are written from physics and share no code and no model form with the package: see `base` for the
hysteresis, `effects` for what is added to it, `session` for how it is driven, `case` for what a seed gives.
`python -m tests.plants generate | run | score` makes cases, has them diagnosed through the command line, and counts.
"""
