"""Results that have a page and a picture, which a room further down draws."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from hystgen.basics import drawing, writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, kw_only=True)
class Presented(ABC):
    """A result with its `page` and its picture (`draw`); `FILES`: names of the JSON, the page and the picture."""

    page: Callable[[], str] | None = field(default=None, compare=False)
    draw: Callable[[], Figure] | None = field(default=None, compare=False)

    FILES: ClassVar[tuple[str, str, str]]

    @abstractmethod
    def to_json(self) -> str:
        """The result for programs."""

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """The picture; also saved to `path`, a .png or .svg file, if given.

        Returns a matplotlib Figure, which a notebook displays. Raises PlotError, OSError.
        """
        assert self.draw is not None, "the public call sets it"
        return drawing.picture(self.draw, path)

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the JSON, `report.html` and the picture into a folder, either all files or none; returns the paths.

        Raises PlotError without matplotlib, OSError.
        """
        assert self.page is not None, "the public call sets it"
        assert self.draw is not None
        with drawing.styled():
            picture = drawing.content(self.draw(), "svg")
        made = (self.to_json().encode("utf-8"), self.page().encode("utf-8"), picture)
        return writing.write_files(Path(folder), dict(zip(self.FILES, made, strict=True)))
