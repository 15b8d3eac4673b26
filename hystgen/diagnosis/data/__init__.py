"""Faults of the records, and the records as the fits take them."""
