"""JSON without its loopholes: no NaN or infinity, no key twice, one canonical form to hash.

From a body to a checked request, with one sentence and one pointer for each thing wrong.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from service.errors import BodyTooLargeError, InvalidRequestError, MalformedBodyError
from solver.errors import UNSAID, Issue, Place, Shown, pointer
from solver.wording import comma_hint, nearest

_Way = Any  # None at the top, or a pair: the way to a container, and a key or an index in it


class JsonText(str):
    """JSON that is encoded already: it is stored as it is."""


def stored(value: object) -> str:
    """A value as the JSON of a column."""
    return value if isinstance(value, JsonText) else json.dumps(value)


def encoded(value: object) -> JsonText:
    """A result as the JSON of its column: null where a number is not finite, TypeError if it cannot be.

    What is encoded already stays as it is.
    """
    if isinstance(value, JsonText):
        return value
    try:
        return JsonText(json.dumps(value, separators=(",", ":"), allow_nan=False))
    except ValueError:
        return JsonText(json.dumps(finite(value), separators=(",", ":"), allow_nan=False))


_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
MOST_DEPTH = 64
"""Lists and objects inside each other."""
MOST_VALUES = 500_000
MOST_KEYS = 20_000
MOST_TOLD = 100
"""Of what is wrong, so much is said."""
_MOST_DIGITS = 308
"""Of an integer: one of more is beyond the largest double."""
_ENDLESS_DIGITS = 4300
"""More are no number of JSON that anybody reads, Python neither."""


def loads(data: bytes) -> object:
    """Parse a request body, in a time that grows with its length alone.

    Raises
    ------
    MalformedBodyError
        Not UTF-8, not JSON, nested too deeply, a key given twice, half a character (``"\\ud800"``), an
        integer of thousands of digits.
    BodyTooLargeError
        More values or keys than are read.
    InvalidRequestError
        A number that is not finite (``NaN``, ``Infinity``, ``1e999``, an integer of 400 digits), with its
        pointer.
    """
    numbers = _Numbers()
    value = _parsed(data, numbers)
    if numbers.wrong:
        issues = issues_of_numbers(value)
        if numbers.unending:
            raise MalformedBodyError("; ".join(issue.said() for issue in issues))
        raise InvalidRequestError(issues)
    return value


def marked(data: bytes) -> object:
    """The same, with numbers that are not finite as `Unreadable`, which `issues_of_numbers` finds."""
    return _parsed(data, _Numbers())


def _parsed(data: bytes, numbers: _Numbers) -> object:
    _measure(data)
    try:
        text = data.decode("utf-8")
        value: object = json.loads(
            text, object_pairs_hook=_without_duplicates, parse_float=numbers.fraction,
            parse_int=numbers.integer, parse_constant=numbers.constant,
        )  # fmt: skip
    except UnicodeDecodeError as error:
        raise MalformedBodyError(f"the body must be UTF-8, byte {error.start} is not") from error
    except json.JSONDecodeError as error:
        raise MalformedBodyError(
            f"the body is not JSON: {error.msg} in line {error.lineno}, column {error.colno}"
        ) from error
    except RecursionError as error:
        raise MalformedBodyError("the body is nested too deeply") from error
    if _SURROGATE.search(text) and not _whole_characters(value):
        raise MalformedBodyError("the body holds half of a character: \\ud800 to \\udfff alone")
    return value


def _measure(data: bytes) -> None:
    """Refuse what would take much memory or a deep stack, before it is read.

    MalformedBodyError, BodyTooLargeError as `loads`.
    """
    if len(data) <= MOST_DEPTH:
        return
    # Loaded here: the command reads small files of JSON without it.
    import numpy as np

    # Without escapes every second quotation mark ends a text: what stands outside of texts are signs of JSON.
    plain = data.replace(b"\\\\", b"").replace(b'\\"', b"")
    signs = np.frombuffer(plain, np.uint8)
    signs = signs[(np.cumsum(signs == ord('"'), dtype=np.uint8) & 1) == 0]
    opened = (signs == ord("[")) | (signs == ord("{"))
    closed = (signs == ord("]")) | (signs == ord("}"))
    brackets = opened.astype(np.int8) - closed.astype(np.int8)
    deepest = int(np.cumsum(brackets, dtype=np.int32).max(initial=0))
    if deepest > MOST_DEPTH:
        raise MalformedBodyError(
            f"the body is nested too deeply: {MOST_DEPTH} lists and objects may stand inside each other, "
            f"here {deepest} do"
        )
    for most, found, what in (
        (MOST_VALUES, int(np.count_nonzero(signs == ord(",")) + np.count_nonzero(opened)) + 1, "values"),
        (MOST_KEYS, int(np.count_nonzero(signs == ord(":"))), "keys"),
    ):
        if found > most:
            raise BodyTooLargeError(f"the body may have {most} {what}, this one has {found}")


class Unreadable(str):
    """A number of a text, as it stands there, that is none to compute with."""

    __slots__ = ()


class _Numbers:
    """Reads the numbers of a text, and keeps those apart that are not finite."""

    def __init__(self) -> None:
        self.wrong: dict[str, Unreadable] = {}
        self.unending = False

    def fraction(self, text: str) -> object:
        """A number with a point or an exponent."""
        value = float(text)
        return value if math.isfinite(value) else self.constant(text)

    def integer(self, text: str) -> object:
        """A number without."""
        self.unending |= len(text) > _ENDLESS_DIGITS
        return int(text) if len(text) <= _MOST_DIGITS else self.constant(text)

    def constant(self, text: str) -> Unreadable:
        """NaN, Infinity, or a number beyond the largest."""
        return self.wrong.setdefault(text, Unreadable(text))


def issues_of_numbers(value: object) -> list[Issue]:
    """The numbers of a value that are not finite, in the order of their pointers; of many the first ones."""
    found = islice(_not_finite([value], None), MOST_TOLD)
    return sorted((_issue_of_number(item, way) for item, way in found), key=lambda issue: issue.pointer)


def _not_finite(items: Mapping[str, object] | list[object], way: _Way) -> Iterator[tuple[str | float, _Way]]:
    """What is wrong below, each with the way to it; a chain, for a text is made for what is wrong alone."""
    for key, item in items.items() if isinstance(items, Mapping) else enumerate(items):
        if isinstance(item, dict | list):
            yield from _not_finite(item, (way, key))
        elif isinstance(item, Unreadable) or (isinstance(item, float) and not math.isfinite(item)):
            yield item, (way, key)


def _issue_of_number(item: str | float, way: _Way) -> Issue:
    parts: list[str | int] = []
    while way is not None:
        way, part = way
        parts.append(part)
    place = tuple(parts[-2::-1])  # the first is the place in the list around the whole
    text = str(item)
    shown = text if len(text) <= 40 else f"one of {len(text)} digits"
    said = f"`{pointer(*place)[-200:]}` must be a finite number"
    return Issue(place, said, Shown(shown), named=False)


def _without_duplicates(pairs: list[tuple[str, object]]) -> dict[str, object]:
    table = dict(pairs)
    if len(table) < len(pairs):
        known: set[str] = set()
        for key, _ in pairs:
            if key in known:
                raise MalformedBodyError(f"the key {key[:200]!r} is given twice in one object")
            known.add(key)
    return table


def _whole_characters(value: object) -> bool:
    """Whether every text can be encoded; two escapes may well make one character."""
    try:
        json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def dumps(value: object) -> str:
    """Compact JSON for storage and hashing: sorted keys, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def digest(value: object) -> str:
    """SHA-256 of the canonical form, in hexadecimal; 1 and 1.0 are the same number."""
    return hashlib.sha256(dumps(_one_number(value)).encode()).hexdigest()


def _one_number(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _one_number(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_one_number(inner) for inner in value]
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value


def finite(value: object) -> object:
    """The same value for JSON: a number that is not finite becomes null (it has no value to report)."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


ModelT = TypeVar("ModelT", bound=BaseModel)

_SHOWN = 80  # characters of what was given
_WRITTEN_OUT = 1e-3  # the least bound whose zeros are written
_MESSAGES = {
    "extra_forbidden": "is not a known key", "missing": "is missing",
    "finite_number": "must be a finite number", "bool_type": "must be true or false",
    "int_type": "must be a whole number", "float_type": "must be a number",
    "string_type": "must be a string",
}  # fmt: skip


def validated(model: type[ModelT], body: object, source: str = "body") -> ModelT:
    """`body` as a checked `model`; `source` says what it is.

    InvalidRequestError with everything that is wrong.
    """
    if not isinstance(body, Mapping):
        raise InvalidRequestError.of(
            (), f"the body must be a JSON object, got {type(body).__name__}", named=False
        )
    try:
        return model.model_validate(dict(body))
    except ValidationError as error:
        found = error.errors(include_url=False)[:MOST_TOLD]
        raise InvalidRequestError(issues_of(found, model), source) from error


def issues_of(errors: Sequence[Any], model: type[BaseModel] | None = None) -> list[Issue]:
    """Pydantic's errors as issues; `model` says which keys the whole knows."""
    fields = {} if model is None else model.model_fields
    return [_issue(error, [field.alias or name for name, field in fields.items()]) for error in errors]


def _issue(error: Mapping[str, Any], keys: Sequence[str]) -> Issue:
    location = tuple(part for part in error["loc"] if part != "[key]")
    kind = error["type"]
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return _unknown_tag(error, location)
    if kind == "value_error":
        wanted = str(error["ctx"]["error"])
    elif kind == "greater_than_equal" and 0.0 < error["ctx"]["ge"] < _WRITTEN_OUT:
        wanted = f"must be at least {error['ctx']['ge']:g}"
    else:
        _, _, should = str(error["msg"]).partition(" should ")
        wanted = _MESSAGES.get(kind) or (f"must {should}" if should else str(error["msg"]))
    hint = ""
    if kind == "extra_forbidden" and len(location) == 1:
        wanted += nearest(str(location[0]), keys)
    elif kind == "literal_error" and isinstance(error["input"], str):
        hint = nearest(error["input"], re.findall(r"'([^']+)'", error["ctx"]["expected"]))
    elif kind == "float_type" and isinstance(error["input"], str):
        hint = comma_hint(error["input"])
    # The validator of several keys says itself which it means.
    named = not wanted.startswith("`")
    told = named and kind not in ("missing", "extra_forbidden")
    return Issue(location, wanted, Shown(_short(error.get("input")) + hint) if told else UNSAID, named)


def _unknown_tag(error: Mapping[str, Any], location: Place) -> Issue:
    """The key that tells the members of a union apart is missing, or names none of them."""
    context = error["ctx"]
    key = str(context["discriminator"]).strip("'")
    if error["type"] == "union_tag_not_found":
        return Issue((*location, key), "is missing")
    known = str(context["expected_tags"]).replace("'", "")
    got = error["input"][key]
    hint = nearest(got, known.split(", ")) if isinstance(got, str) else ""
    return Issue((*location, key), f"must be one of {known}", Shown(_short(got) + hint))


def _short(value: object) -> str:
    # What is large is not written out to be cut.
    if isinstance(value, str | list | tuple | dict) and len(value) > _SHOWN:
        value = value[:_SHOWN] if isinstance(value, str | list | tuple) else f"an object of {len(value)} keys"
    text = repr(value)
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
