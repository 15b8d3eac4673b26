"""Saturation behind the plays; one in front of them is a stage of `model.memoryless`."""
