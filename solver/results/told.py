"""What is told of a result or a part of it: its numbers, each said once, a text, a table."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from functools import cache
from html import escape
from typing import Any, ClassVar, Self

from solver.wording import fields_said, with_attributes

_MOST = 30
_FEW = 6
_DIGITS = 5
_NUMBER = re.compile(r"[≤≥±\s]*[-+]?\d")
UNIT = re.compile(r" ?\[([^]]+)\]")


def json_number(value: float) -> float | None:
    """A number that JSON can carry: null where it is not finite."""
    return float(value) if math.isfinite(value) else None


def json_numbers(values: Iterable[float]) -> list[float | None]:
    """Numbers that JSON can carry."""
    return [json_number(value) for value in values]


def json_value(value: Any) -> Any:
    """A value as JSON has it: null where a number is not finite, an enum by its value, a scene by name."""
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return json_number(value)
    if hasattr(value, "tolist"):  # an array, or a number of one
        # Loaded here, where it is already: the command knows criteria without it.
        import numpy as np

        known = value.dtype.kind != "f" or bool(np.isfinite(value).all())
        return value.tolist() if known else json_value(value.tolist())
    if isinstance(value, Mapping):
        return {key: json_value(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        pairs = getattr(value, "_asdict", None)
        return [json_value(one) for one in value] if pairs is None else json_value(pairs())
    to_json = getattr(value, "to_json", None)
    return value.name if to_json is None else to_json()


@cache
def json_keys(kind: type[Told]) -> dict[str, str]:
    """The keys of the JSON of a class in their order, and the attributes that they have the values of."""
    return keys_and_paths(kind.JSON or " ".join(one.name for one in fields(kind)))  # type: ignore[arg-type]


def keys_and_paths(text: str) -> dict[str, str]:
    """Names that stand for attributes, ``key=path.of.attribute`` where they differ."""
    return {key: path or key for key, _, path in (name.partition("=") for name in text.split())}


def at(value: Any, path: str) -> Any:
    """The value at the end of a path of attributes; None if one on the way is."""
    for name in path.split("."):
        value = None if value is None else getattr(value, name)
    return value


Pairs = Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Summary:
    """What is worth knowing of a result: a title, and names with their values."""

    title: str
    pairs: Pairs

    def html(self, caption: str) -> str:
        """A table of a notebook."""
        return _html(caption, (), self.pairs)


@dataclass(frozen=True, slots=True)
class ResultTable:
    """Rows of a result under the heads of their columns."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def pairs(self) -> Pairs:
        """The rows as names with values, the first and the last of many."""
        rows = self.rows if len(self.rows) <= _FEW else (self.rows[0], self.rows[-1])
        named = (
            [" ".join(filter(None, one)) for one in zip(self.columns, row, strict=True) if one[1]]
            for row in rows
        )
        return [(name, " ".join(", ".join(rest).split())) for name, *rest in named if rest]

    @property
    def numbers(self) -> tuple[bool, ...]:
        """Which columns hold numbers alone, which are aligned right."""
        columns = [[cell for cell in column if cell] for column in zip(*self.rows, strict=True)]
        return tuple(bool(column) and all(map(_NUMBER.match, column)) for column in columns)

    def html(self, caption: str) -> str:
        """A table of a notebook."""
        return _html(caption, self.columns, self.rows)


Block = Summary | ResultTable


def html_of(kind: str, blocks: Iterable[Block]) -> str:
    """What is told of a result as tables of a notebook."""
    first, *others = blocks
    caption = " · ".join(part for part in (kind, first.title) if part)
    return "".join([first.html(caption), *(other.html(other.title) for other in others)])


def _html(caption: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(cells: Sequence[str], first: str) -> str:
        tags = (first, *("td" for _ in cells[1:])) if first == "th" else ("td" for _ in cells)
        listed = zip(tags, cells, strict=True)
        return "".join(f"<{tag} style='text-align:left'>{escape(cell)}</{tag}>" for tag, cell in listed)

    head = "".join(f"<th style='text-align:left'>{escape(one)}</th>" for one in heads)
    body = "".join(f"<tr>{line(row, 'td' if heads else 'th')}</tr>" for row in rows[:_MOST])
    return (
        f"<table><caption style='text-align:left'>{escape(caption)}</caption>"
        f"{f'<thead><tr>{head}</tr></thead>' if heads else ''}<tbody>{body}</tbody></table>"
    )


class Told(ABC):
    """Root of everything that is looked at: its JSON, a short text, and a table in a notebook.

    A field says its type, and in words what it is with its unit in brackets:
    ``speed_rpm: Annotated[float, "Running speed [1/min]."]``. The attributes in the docstring of the class,
    the units in texts and the schema of the JSON follow from that.

    Attributes
    ----------
    JSON : str
        The keys of the JSON in their order, ``key=path.of.attribute`` where they differ, null where one on
        the way is None; if empty all fields.
    WORDS : mapping
        What each field is in words.
    READ : mapping
        What a property is by the JSON alone, where its own way needs more than that has.
    """

    __slots__ = ()
    JSON: ClassVar[str] = ""
    READ: ClassVar[Mapping[str, Callable[[Mapping[str, Any]], Any]]] = {}
    WORDS: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        said = fields_said(cls)
        for name, (kind, words) in said.items():
            cls.__annotations__[name], cls.WORDS = kind, {**cls.WORDS, name: words}
        if said:  # else nothing is said, or dataclass made the class anew for its slots
            cls.__doc__ = with_attributes(cls.__doc__, said)

    def to_json(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        return self._json()

    @classmethod
    def from_json(cls, found: Mapping[str, Any]) -> Self:
        """Return what `to_json` wrote: the same JSON, its values as the attributes have them.

        What JSON does not hold, such as the arrays of a branch, is not there: asked for, it is an
        AttributeError that says so. A number that is null was not known and is NaN; a scene is its name.

        Raises
        ------
        ValueError
            If most of the keys are missing: it is the JSON of something else.
        """
        from solver.results.read_back import read_back

        return read_back(cls, found)

    def _json(self, **others: object) -> dict[str, Any]:
        """The JSON object; `others` are the values of keys that are not those of attributes."""
        paths = json_keys(type(self)).items()
        found = {key: others.pop(key) if key in others else at(self, path) for key, path in paths}
        return {key: json_value(value) for key, value in (found | others).items()}

    @abstractmethod
    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""

    def blocks(self) -> Sequence[Block]:
        """What people read of it: names with values, and tables."""
        return (self.summary(),)

    def __repr__(self) -> str:
        found = self.summary()
        pairs = ", ".join(f"{name} {value}" for name, value in found.pairs)
        title = f" {found.title}" if found.title else ""
        return f"<{type(self).__name__}{title}: {pairs}>"

    def _repr_html_(self) -> str:
        """Return what people read of it as tables, for notebooks."""
        return html_of(type(self).__name__, self.blocks())


class Piece(Told):
    """A part of a result, a dataclass of a few numbers: its fields, arrays cut short."""

    __slots__ = ()

    def summary(self) -> Summary:
        """Every field with its unit."""
        return listed(self, {one.name: getattr(self, one.name) for one in fields(self)})  # type: ignore[arg-type]


def listed(kind: Told, values: Mapping[str, Any]) -> Summary:
    """Attributes by their names with the units that a class says of them."""
    said = {name: UNIT.search(words) for name, words in kind.WORDS.items()}
    units = {name: unit[1] for name, unit in said.items() if unit is not None}
    return Summary(
        title="", pairs=tuple((name, _words(one, units.get(name, ""))) for name, one in values.items())
    )


def _words(value: Any, unit: str) -> str:
    """A field in a few words."""
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, Told):
        return repr(value)
    if isinstance(value, float):
        return f"{value:.6g} {unit}".rstrip()
    if hasattr(value, "shape"):
        import numpy as np

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
