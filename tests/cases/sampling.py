"""Studies of many like cases: some of them run by default, all of them in the long tests."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def sampled(cases: Iterable[Any], every: int, keep: Collection[Any] = ()) -> list[Any]:
    """Every so many of the cases, and those to keep, as they are; the others with the mark `long`."""
    return [
        case if index % every == 0 or case in keep else pytest.param(case, marks=pytest.mark.long)
        for index, case in enumerate(cases)
    ]


def others_long(cases: Iterable[Any], keep: Collection[Any]) -> list[Any]:
    """The cases, of which only those to keep run by default."""
    return [case if case in keep else pytest.param(case, marks=pytest.mark.long) for case in cases]
