"""Gain that falls with the distance travelled."""
