"""Parameter files: read, checked, written."""
