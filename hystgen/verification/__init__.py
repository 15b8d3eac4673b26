"""Verification: emitted files, compiled and run, give the bits of the Python reference or they do not."""

from hystgen.verification.run import Report, Row, verify_model

__all__ = ["Report", "Row", "verify_model"]
