"""What to emit."""

from __future__ import annotations

from dataclasses import dataclass

from hystgen.emission import banner

LAYOUTS = banner.OPTIONS["layout"]
OPERATORS = banner.OPTIONS["operator"]


@dataclass(frozen=True)
class Options:
    """What to emit: `operator` inverse, forward or both; `engine` corners or loop; see LAYOUTS for `layout`.

    `left_out`: effects that the C does not have, in words, where that is allowed.
    """

    operator: str
    arithmetic: str
    engine: str
    layout: str
    left_out: tuple[str, ...] = ()

    @property
    def forward(self) -> bool:
        """Whether the forward operator is part of it."""
        return self.operator in ("forward", "both")

    @property
    def inverse(self) -> bool:
        """Whether the inverse operator is part of it."""
        return self.operator in ("inverse", "both")
