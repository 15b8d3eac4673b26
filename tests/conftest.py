"""Settings shared by all tests."""

from hypothesis import settings

# The first call of a compiled function takes longer than any deadline.
settings.register_profile("hystgen", deadline=None)
settings.load_profile("hystgen")
