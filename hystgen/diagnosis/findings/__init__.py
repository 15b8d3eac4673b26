"""What was found: typed results, their sentences and `diagnosis.json`."""
