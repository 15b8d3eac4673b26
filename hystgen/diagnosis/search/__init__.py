"""The search for what the nominal model is missing."""
