"""The version of the tool, which emitted files and reports name."""

__version__ = "0.1.0"
