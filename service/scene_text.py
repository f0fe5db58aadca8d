"""Scenes as text: read from TOML or JSON with everything wrong in them, written as TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from service import strict_json
from service.errors import InvalidRequestError, MalformedBodyError
from service.kinds.scenes import read_scene
from solver.errors import Issue

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_MOST_INLINE = 88


def read_text(text: str, form: str) -> dict[str, Any]:
    """The tables of a scene in TOML or JSON, not yet checked; JSON values alone.

    Raises
    ------
    MalformedBodyError
        With line and column.
    """
    try:
        raw = tomllib.loads(text) if form == "toml" else strict_json.loads(text.encode())
    except tomllib.TOMLDecodeError as error:
        raise MalformedBodyError(f"this is not valid TOML: {error}") from error
    except RecursionError as error:
        raise MalformedBodyError("this is nested too deeply for a scene") from error
    if not isinstance(raw, dict):
        raise MalformedBodyError(f"a scene must be a table, got {type(raw).__name__}")
    # Dates are TOML but no JSON; a number that is not finite is found below.
    plain: dict[str, Any] = json.loads(json.dumps(raw, default=str))
    return plain


def issues_of_scene(raw: Mapping[str, Any]) -> list[Issue]:
    """Everything wrong with a scene."""
    try:
        read_scene(raw)
    except InvalidRequestError as error:
        return list(error.issues)
    return []


def toml_text(raw: Mapping[str, Any], comments: tuple[str, ...] = ()) -> str:
    """A scene as TOML; `comments` lead it."""
    lines = [f"# {line}" for comment in comments for line in comment.splitlines()]
    lines += _table(raw, ())
    return "\n".join(lines).strip("\n") + "\n"


def _table(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """A table's own values, then the tables below it, as TOML wants them."""
    lines = [f"{_key(key)} = {_value(item)}" for key, item in table.items() if not _below(item, path)]
    for key, item in table.items():
        here = (*path, key)
        name = ".".join(_key(part) for part in here)
        if isinstance(item, Mapping) and _below(item, path):
            lines += ["", f"[{name}]", *_table(item, here)]
        elif _below(item, path):
            for entry in item:
                lines += ["", f"[[{name}]]", *_table(entry, here)]
    return lines


def _below(item: object, path: tuple[str, ...]) -> bool:
    """Whether it gets a header of its own: tables of the scene, and lists of tables that are too long."""
    if path:
        return False
    return isinstance(item, Mapping) or (
        isinstance(item, list) and bool(item) and all(isinstance(entry, Mapping) for entry in item)
    )


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def _value(item: object) -> str:
    if isinstance(item, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(value)}" for key, value in item.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(item, list):
        entries = [_value(entry) for entry in item]
        short = f"[{', '.join(entries)}]"
        if len(short) <= _MOST_INLINE:
            return short
        return "[\n" + "".join(f"  {entry},\n" for entry in entries) + "]"
    return json.dumps(item, ensure_ascii=False)
