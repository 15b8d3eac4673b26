"""`hystgen.plan`: drive records for a diagnosis, which can be written with the page that explains them."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from hystgen.emission import files
from hystgen.planning import plan as planning
from hystgen.report import plan as page


@dataclass(frozen=True)
class Plan(planning.Plan):
    """Drive records of one session, in the order in which they are recorded; fields as in `hystgen.planning.plan`."""

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the CSV files and `plan.html`, which explains them, into a folder, all or nothing; the paths.

        Raises PlotError without matplotlib, OSError.
        """
        made = {**self.tables(), "plan.html": page.html(self, folder)}
        return files.write(Path(folder), {name: text.encode("utf-8") for name, text in made.items()})


@functools.wraps(planning.plan)
def plan(*given: Any, **options: Any) -> Plan:
    made = planning.plan(*given, **options)
    return Plan(**{each.name: getattr(made, each.name) for each in fields(made)})
