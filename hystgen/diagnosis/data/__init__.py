"""Faults in the records, and the records as the fits use them."""
