"""Tables as TOML text: the scene that reproduces a result."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")
MOST_INLINE = 88


def toml_text(raw: Mapping[str, Any], comments: tuple[str, ...] = ()) -> str:
    """A scene or a problem as TOML; `comments` lead it.

    Parameters
    ----------
    raw : tables, lists, texts, numbers and booleans, without null.
    comments : lines without their ``#``.
    """
    lines = [f"# {line}" for comment in comments for line in comment.splitlines()]
    lines += _table(raw, ())
    return "\n".join(lines).strip("\n") + "\n"


def _table(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """A table's own values, then the tables below it, as TOML wants them."""
    lines = [f"{key_text(key)} = {value_text(item)}" for key, item in table.items() if not _below(item, path)]
    for key, item in table.items():
        if not _below(item, path):
            continue
        here = (*path, key)
        name = ".".join(key_text(part) for part in here)
        if isinstance(item, Mapping):
            lines += ["", f"[{name}]", *_table(item, here)]
        else:
            for entry in item:
                lines += ["", f"[[{name}]]", *_table(entry, here)]
    return lines


def _below(item: object, path: tuple[str, ...]) -> bool:
    """Whether it gets a header of its own: tables, and lists of tables, of the whole."""
    if path:
        return False
    return isinstance(item, Mapping) or (
        isinstance(item, list) and bool(item) and all(isinstance(entry, Mapping) for entry in item)
    )


def key_text(key: str) -> str:
    """A key as TOML, quoted where it has to be."""
    return key if _BARE.fullmatch(key) else json.dumps(key)


def value_text(item: object) -> str:
    """A value as TOML in one place: tables in braces."""
    if isinstance(item, Mapping):
        inner = ", ".join(f"{key_text(key)} = {value_text(value)}" for key, value in item.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(item, (list, tuple)):
        entries = [value_text(entry) for entry in item]
        short = f"[{', '.join(entries)}]"
        if len(short) <= MOST_INLINE:
            return short
        return "[\n" + "".join(f"  {entry},\n" for entry in entries) + "]"
    return json.dumps(item, ensure_ascii=False)
