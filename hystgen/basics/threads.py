"""Linear algebra on small matrices: one thread is faster than several that wait for each other."""

from __future__ import annotations

from typing import Any


def alone() -> Any:
    """Context in which the linear algebra libraries use a single thread."""
    import scipy.linalg  # noqa: F401  # has a library of its own, and one that comes later is not limited
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    return threadpool_limits(1)
