"""The compensator and the forward operator of models with effects, as the emitted C computes them."""
