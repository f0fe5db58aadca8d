"""JSON without its loopholes: no NaN or infinity, no key twice, one canonical form to hash."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping

from service.errors import InvalidRequestError, MalformedBodyError
from solver.errors import Issue, pointer


class JsonText(str):
    """JSON that is encoded already: it is stored as it is."""


def stored(value: object) -> str:
    """A value as the JSON of a column."""
    return value if isinstance(value, JsonText) else json.dumps(value)


def encoded(value: object) -> JsonText:
    """A result as the JSON of its column: null where a number is not finite, TypeError if it cannot be."""
    try:
        return JsonText(json.dumps(value, separators=(",", ":"), allow_nan=False))
    except ValueError:
        return JsonText(json.dumps(finite(value), separators=(",", ":"), allow_nan=False))


_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def loads(data: bytes) -> object:
    """Parse a request body.

    Raises
    ------
    MalformedBodyError
        Not UTF-8, not JSON, nested too deeply, a key given twice, or half a character (``"\\ud800"``).
    InvalidRequestError
        A number that is not finite (``NaN``, ``Infinity``, ``1e999``), with its pointer.
    """
    try:
        text = data.decode("utf-8")
        value: object = json.loads(text, object_pairs_hook=_without_duplicates)
    except UnicodeDecodeError as error:
        raise MalformedBodyError(f"the body must be UTF-8, byte {error.start} is not") from error
    except json.JSONDecodeError as error:
        raise MalformedBodyError(
            f"the body is not JSON: {error.msg} in line {error.lineno}, column {error.colno}"
        ) from error
    except RecursionError as error:
        raise MalformedBodyError("the body is nested too deeply") from error
    except ValueError as error:
        raise MalformedBodyError(f"the body is not JSON: {error}") from error
    if _SURROGATE.search(text) and not _whole_characters(value):
        raise MalformedBodyError("the body holds half of a character: \\ud800 to \\udfff alone")
    issues = [
        Issue(pointer=where, message=f"`{where}` must be a finite number, got {found!r}")
        for where, found in _not_finite(value)
    ]
    if issues:
        raise InvalidRequestError(issues)
    return value


def _without_duplicates(pairs: list[tuple[str, object]]) -> dict[str, object]:
    table: dict[str, object] = {}
    for key, value in pairs:
        if key in table:
            raise MalformedBodyError(f"the key {key!r} is given twice in one object")
        table[key] = value
    return table


def _whole_characters(value: object) -> bool:
    """Whether every text can be encoded; two escapes may well make one character."""
    try:
        json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _not_finite(value: object) -> list[tuple[str, float]]:
    """Pointers of the numbers that are not finite; without recursion, the parser has its own limit."""
    found: list[tuple[str, float]] = []
    pending: list[tuple[str, object]] = [("", value)]
    while pending:
        where, item = pending.pop()
        if isinstance(item, dict):
            pending.extend((where + pointer(key), inner) for key, inner in item.items())
        elif isinstance(item, list):
            pending.extend((where + pointer(index), inner) for index, inner in enumerate(item))
        elif isinstance(item, float) and not math.isfinite(item):
            found.append((where, item))
    return sorted(found, key=lambda pair: pair[0])


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
