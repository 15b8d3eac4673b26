"""A unit in service: whether it still follows its model, and the model brought up to date."""
