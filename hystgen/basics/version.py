"""The version of the tool, named in emitted files and reports."""

__version__ = "0.1.0"
