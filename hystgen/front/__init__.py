"""Memoryless stages in front of the plays: model and compensator of each."""
