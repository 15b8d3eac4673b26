"""Findings: typed results, their sentences and `diagnosis.json`."""
