"""Objects of other packages, recognised by the modules of their classes without importing the packages."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

PACKAGES = "pandas", "polars", "xarray"


def package(source: object) -> str:
    """The package of `PACKAGES` that an object comes from, or the empty string."""
    roots = {each.__module__.partition(".")[0] for each in type(source).__mro__}
    return next((name for name in PACKAGES if name in roots), "")


def refuse(name: str, source: object, record: bool = False) -> None:
    """Raise TypeError, saying what to pass instead, for an object of these packages that is not a table of samples.

    `record`: whether several signals are needed."""
    of, kind = package(source), type(source).__name__
    if of == "polars" and kind == "LazyFrame":
        raise TypeError(f"{name} is a LazyFrame, which has no values yet; pass its .collect()")
    columns = getattr(source, "columns", ()) if of == "pandas" else ()
    if getattr(columns, "nlevels", 1) > 1:
        group = next(iter(columns))[0]
        raise TypeError(
            f"{name} has column names of several levels (MultiIndex); pass one group of columns, as in frame[{group!r}]"
        )
    if of == "xarray" and kind == "Dataset":
        raise TypeError(f"{name} is a Dataset of xarray; pass its .to_dataframe().reset_index(), or a variable of it")
    if of == "xarray" and record:
        raise TypeError(f"{name} is one DataArray; pass those of drive and output in a dict, {{'v': .., 'y': ..}}")
    if of == "xarray" and getattr(source, "ndim", 1) != 1:
        dims = ", ".join(map(str, getattr(source, "dims", ())))
        raise TypeError(f"{name} is a DataArray over ({dims}); select along all of them but one")


def alike(source: object, name: str, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """The values (N,) as a series called `name`, of the package of `source` and with its index or coordinates; for an
    object of no such package, the values."""
    of = package(source)
    if of == "pandas":
        series = sys.modules[of].Series(values, index=source.index, name=name)  # type: ignore[attr-defined]
    elif of == "polars":
        series = sys.modules[of].Series(name, values)
    elif of == "xarray":
        series = source.copy(data=values).drop_attrs().rename(name)  # type: ignore[attr-defined]
    else:
        return values
    return series  # type: ignore[no-any-return]
