"""The compensator in one arithmetic: tables, bounds and the bit reference of the emitted C."""
