"""A mechanical mode of the stage."""
