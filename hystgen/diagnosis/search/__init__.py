"""The search for effects that the nominal model is missing."""
