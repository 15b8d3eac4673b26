"""Dead-zone sums."""
