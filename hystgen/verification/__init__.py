"""Verification: does the emitted C, compiled and run, give the bits of the Python reference?"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hystgen.verification.report import Report as Report
    from hystgen.verification.report import Reports as Reports
    from hystgen.verification.report import Row as Row
    from hystgen.verification.run import verify as verify

__all__ = ["Report", "Reports", "Row", "verify"]


def __getattr__(name: str) -> object:
    # Imported late, since the command line only needs the names of targets to start
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hystgen.verification import report, run

    return getattr(run if name == "verify" else report, name)
