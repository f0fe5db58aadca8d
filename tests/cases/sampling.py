"""Studies of many like cases: some of them run by default, all of them in the long tests."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def sampled(cases: Iterable[Any], every: int, keep: Collection[Any] = ()) -> list[Any]:
    """Every so many of the cases, and those to keep, as they are; the others with the mark `long`."""
    return [case if index % every == 0 or case in keep else _long(case) for index, case in enumerate(cases)]


def others_long(cases: Iterable[Any], keep: Collection[Any]) -> list[Any]:
    """The cases, of which only those to keep run by default."""
    return [case if case in keep else _long(case) for case in cases]


def _long(case: Any) -> Any:
    """A case with the mark; a tuple is a value for each of several names."""
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long)
