"""What is read back from JSON: results and parts of them, by what their classes say of themselves."""

from __future__ import annotations

import builtins
import inspect
import math
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

import numpy as np

from solver.results.told import Told, json_keys, json_value, listed

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
    if origin is np.ndarray:
        rows = _of(value, list)
        return np.array(rows, dtype=float if _has_null(rows) else None)
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
