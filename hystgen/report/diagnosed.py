"""The public `diagnose`: what the search finds, with a page to write."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import ParamSpec

from hystgen import diagnosis
from hystgen.diagnosis import Diagnosis
from hystgen.report import diagnosis as report

P = ParamSpec("P")


def _with_page(find: Callable[P, Diagnosis]) -> Callable[P, Diagnosis]:
    @functools.wraps(find)
    def found(*given: P.args, **named: P.kwargs) -> Diagnosis:
        return replace(find(*given, **named), page=report.html)

    return found


diagnose = _with_page(diagnosis.diagnose)
