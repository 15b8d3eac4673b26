"""The Python calls behind the command line: load, simulate, identify, emit, verify."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from hystgen.basics import arguments
from hystgen.identification.fit import Fit
from hystgen.records import Source


def report_fit(
    fit: Fit,
    records: Source | Iterable[Source],
    folder: str | os.PathLike[str],
    holdout: Source | Iterable[Source] = (),
) -> Path:
    """Write the report of a fit: `report.html`, which needs nothing else, and its pictures; the path of the page.

    `records`, `holdout`: as `identify` was given them, in the same order; what it read with options such as `columns`
    has to come as `Record`s. Needs matplotlib, of the extra `plot`. Other files in the folder stay. Raises ValueError
    for other records, RecordError, OSError.
    """
    from hystgen.identification import Fit
    from hystgen.records import read_records, several
    from hystgen.report import identification

    if not isinstance(fit, Fit):
        raise TypeError(f"fit is what hystgen.identify returns, not {arguments.kind(fit)}")
    return identification.write(fit, read_records([*several(records), *several(holdout)]), folder)
