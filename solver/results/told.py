"""What is told of a result or a part of it, and read back: its numbers, each said once, a text, a table."""

from __future__ import annotations

import builtins
import inspect
import math
import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from html import escape
from importlib import import_module
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Self, TypeVar, Union, get_args, get_origin

from solver.results import units
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
        return units.quantity(value, unit)
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


Read = TypeVar("Read", bound=Told)


class _OtherFormError(Exception):
    """JSON that has another form than the attribute it is written under."""


@cache
def declared(kind: type, path: str) -> tuple[Any, str]:
    """Return the type of what stands at a path of attributes of a class, and its words; None for neither.

    An attribute of what may be None may be None too. What is there for type checkers alone is looked up
    among the public names of the package.
    """
    name, _, rest = path.partition(".")
    found_in = (one for one in kind.__mro__ if name in {*inspect.get_annotations(one), *vars(one)})
    owner = next(found_in, object)
    made = getattr(vars(owner).get(name), "fget", None)
    text = inspect.get_annotations(owner).get(name) if made is None else made.__annotations__["return"]
    if text is None:
        return None, ""
    text = str(getattr(text, "__forward_arg__", text))  # a named tuple wraps it
    found = eval(text, {}, _FieldNames({**vars(builtins), **vars(sys.modules[owner.__module__])}, owner))
    if rest:
        found = get_args(found)[0] if get_origin(found) is Annotated else found  # a field of a scene
        kinds = get_args(found) if get_origin(found) in (Union, UnionType) else (found,)
        inner, words = declared(next(one for one in kinds if one is not NoneType), rest)
        return (inner | None if NoneType in kinds and inner is not None else inner), words
    if made is None:
        return found, getattr(kind, "WORDS", {}).get(name, "")
    return found, (made.__doc__ or "").partition("\n")[0]


class _FieldNames(dict[str, Any]):
    """What annotations name."""

    def __init__(self, known: Mapping[str, Any], owner: type) -> None:
        super().__init__(known)
        self._packages = [import_module(name) for name in (owner.__module__.partition(".")[0], "solver")]

    def __missing__(self, name: str) -> Any:
        found = (getattr(package, name, None) for package in self._packages)
        return next((one for one in found if one is not None), Told)


def read_back(kind: type[Read], found: Mapping[str, Any]) -> Read:
    """Return what a class wrote as JSON, see `Told.from_json`."""
    keys = json_keys(kind)
    missing = [key for key in keys if key not in found]
    if 2 * len(missing) > len(keys):
        raise ValueError(f"is no JSON of {kind.__name__}: it lacks {', '.join(missing)}")
    read, parts = {}, False
    for key, value in found.items():
        try:
            read[key] = _value(declared(kind, keys.get(key, key))[0], value)
        except _OtherFormError:
            read[key], parts = value, True
    by_path = {path: read[key] for key, path in keys.items() if key in read}
    names = [one.name for one in fields(kind) if one.init]  # type: ignore[arg-type]
    if by_path.keys() >= {*names} and not parts and not any(map(_is_part, by_path.values())):
        whole = kind(**{name: by_path[name] for name in names})
        if whole.to_json() == found:
            return whole
    part: Read = object.__new__(_partial(kind))
    object.__setattr__(part, "_read", (read, by_path))
    return part


def _is_part(value: Any) -> bool:
    """Return whether something of a value was not in the JSON."""
    if isinstance(value, Mapping):
        return any(map(_is_part, value.values()))
    return any(map(_is_part, value)) if isinstance(value, tuple) else hasattr(type(value), "_read")


def _value(of: Any, value: Any) -> Any:
    """Return what was written as `value`, an attribute of some type."""
    origin, parts = get_origin(of), get_args(of)
    if origin in (Union, UnionType):
        return _one_of(parts, value)
    if origin is Annotated:
        return _value(parts[0], value)
    if of in (None, Any):
        return value
    if of is float:
        return math.nan if value is None else float(_of(value, int, float))
    if of in (str, bool, int, NoneType):
        return _of(value, of)
    if origin is not None and hasattr(origin, "tolist"):  # an array, whose type has loaded NumPy
        rows = _of(value, list)
        return sys.modules["numpy"].array(rows, dtype=float if _has_null(rows) else None)
    if origin is not None and issubclass(origin, Mapping):
        return {key: _value(parts[1], one) for key, one in _of(value, dict).items()}
    if origin is tuple:
        each = [parts[0]] * len(_of(value, list)) if parts[1:] == (...,) else list(parts)
        if len(each) != len(value):
            raise _OtherFormError
        return tuple(_value(one, item) for one, item in zip(each, value, strict=True))
    return _made(of, value) if isinstance(of, type) else value


def _made(of: Any, value: Any) -> Any:
    """Return an object of a class."""
    if issubclass(of, Enum):
        try:
            return of(value)
        except ValueError as error:
            raise _OtherFormError from error
    if issubclass(of, Told) and is_dataclass(of):
        try:
            kind: Any = of
            return read_back(kind, _of(value, dict))
        except ValueError as error:
            raise _OtherFormError from error
    names = getattr(of, "_fields", None)
    if names is not None and isinstance(value, dict) and value.keys() == {*names}:
        return of(**{name: _value(declared(of, name)[0], value[name]) for name in names})
    raise _OtherFormError


def _one_of(kinds: tuple[Any, ...], value: Any) -> Any:
    for kind in (NoneType, *(one for one in kinds if one is not NoneType)) if NoneType in kinds else kinds:
        try:
            return _value(kind, value)
        except _OtherFormError:
            pass
    raise _OtherFormError


def _of(value: Any, *kinds: type) -> Any:
    if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
        raise _OtherFormError
    return value


def _has_null(rows: Any) -> bool:
    return any(map(_has_null, rows)) if isinstance(rows, list) else rows is None


@cache
def _partial(kind: type[Read]) -> type[Read]:
    """Return the class of those of which the JSON has not everything: what it lacks is an error that says so.

    A property is what the class computes of attributes that are there, or what the JSON has.
    """

    def attribute(self: Any, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{kind.__name__!r} has no attribute {name!r}")
        read, by_path = self._read
        if name in by_path:
            return by_path[name]
        if name in read and not hasattr(kind, name):
            return read[name]
        if name in kind.READ:
            with suppress(KeyError):  # an earlier version did not write all of it
                return kind.READ[name](self.to_json())
        raise AttributeError(
            f"{name!r} of {kind.__name__} is not in the JSON that this was read from, which has "
            f"{', '.join(read)}: compute it again"
        )

    namespace = {
        "__slots__": ("_read",),
        "__module__": kind.__module__,
        "__doc__": kind.__doc__,
        "__getattr__": attribute,
        "__eq__": lambda self, other: type(self) is type(other) and self.to_json() == other.to_json(),
        "__reduce__": lambda self: (read_back, (kind, self.to_json())),
        "to_json": lambda self: {key: json_value(value) for key, value in self._read[0].items()},
        "summary": lambda self: listed(self, self._read[0]),
    }
    return type(kind.__name__, (kind,), namespace)
