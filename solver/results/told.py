"""What is told of a result or a part of it: a short text, and a table in a notebook."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from enum import Enum
from html import escape
from typing import ClassVar

import numpy as np

_MOST = 30
_FEW = 6
_DIGITS = 5


def json_number(value: float) -> float | None:
    """A number that JSON can carry: null where it is not finite."""
    return float(value) if math.isfinite(value) else None


def json_numbers(values: Iterable[float]) -> list[float | None]:
    """Numbers that JSON can carry."""
    return [json_number(value) for value in values]


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """What is most worth knowing of a result: a title, and names with their values."""

    title: str
    pairs: tuple[tuple[str, str], ...]


class Told(ABC):
    """Root of everything that is looked at: a short text, and a table in a notebook."""

    __slots__ = ()

    @abstractmethod
    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""

    def __repr__(self) -> str:
        found = self.summary()
        pairs = ", ".join(f"{name} {value}" for name, value in found.pairs)
        title = f" {found.title}" if found.title else ""
        return f"<{type(self).__name__}{title}: {pairs}>"

    def _repr_html_(self) -> str:
        """Return the summary as a table, for notebooks."""
        found = self.summary()
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td style='text-align:left'>{escape(value)}"
            "</td></tr>"
            for name, value in found.pairs[:_MOST]
        )
        caption = " · ".join(escape(part) for part in (type(self).__name__, found.title) if part)
        return f"<table><caption style='text-align:left'>{caption}</caption><tbody>{rows}</tbody></table>"


class Piece(Told):
    """A part of a result, a dataclass of a few numbers: its fields, arrays cut short."""

    __slots__ = ()
    UNITS: ClassVar[Mapping[str, str]] = {}

    def summary(self) -> Summary:
        """Every field with its unit."""
        units = self.UNITS
        given = [(one.name, getattr(self, one.name)) for one in fields(self)]  # type: ignore[arg-type]
        pairs = tuple((name, _words(value, units.get(name, ""))) for name, value in given)
        return Summary(title="", pairs=pairs)


def _words(value: object, unit: str) -> str:
    """A field in a few words."""
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, Told):
        return repr(value)
    if isinstance(value, float | np.floating):
        return f"{value:.6g} {unit}".rstrip()
    if isinstance(value, np.ndarray):
        if value.size > _FEW:
            return f"{' x '.join(map(str, value.shape))} numbers"
        return f"{np.array2string(value, precision=_DIGITS, separator=', ')} {unit}".rstrip()
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {_words(one, unit)}" for name, one in value.items()) or "none"
    if isinstance(value, tuple | list):
        if len(value) > _FEW:
            return f"{len(value)} of them"
        names = getattr(value, "_fields", None)
        said = [_words(one, unit) for one in value]
        return ", ".join(said if names is None else map(" ".join, zip(names, said, strict=True))) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return str(value)
