"""Scenes from files, shipped ones by name and others by path; tables as TOML text."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from solver.errors import SceneError
from solver.wording import comma_hint


class TomlError(ValueError):
    """A text that is not TOML: the line, and what would be right where that shows."""


_LINE = re.compile(r"at line (\d+)")


def read_toml(text: str) -> dict[str, Any]:
    """The tables of a text in TOML, which may begin with a byte order mark.

    Raises
    ------
    TomlError
        It is none.
    ValueError
        A number that is too long.
    """
    text = text.removeprefix("\ufeff")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        at = _LINE.search(str(error))
        line = text.splitlines()[int(at[1]) - 1 : int(at[1])] if at else text.splitlines()[-1:]
        raise TomlError(f"{error}{comma_hint(line[0] if line else '')}") from error


@cache
def shipped_scenes() -> tuple[str, ...]:
    """Names of the scenes that come with the package, sorted."""
    folder = resources.files("solver.scene") / "shipped"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def scene_folder(name_or_path: object) -> Path:
    """Where relative names of files in a scene begin: the folder of its file."""
    if isinstance(name_or_path, str | Path) and name_or_path not in shipped_scenes():
        return Path(name_or_path).parent
    return Path(str(resources.files("solver.scene") / "shipped"))


def load_raw(name_or_path: object) -> dict[str, object]:
    """The tables and lists of a shipped scene or a file, not yet checked.

    Raises
    ------
    SceneError
        No such scene, or a file that cannot be read as TOML or JSON (with the line).
    """
    if isinstance(name_or_path, str) and name_or_path in shipped_scenes():
        text = (resources.files("solver.scene") / "shipped" / f"{name_or_path}.toml").read_text(
            encoding="utf-8"
        )
        return _parse(text, name_or_path, ".toml")
    if not isinstance(name_or_path, str | Path):
        raise _refusal(f"a scene must be a name or a path, got {name_or_path!r}")
    path = Path(name_or_path)
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refusal(f"{str(path)!r} is not UTF-8 text (byte {error.start}): not a scene file") from error
    except (OSError, ValueError) as error:
        name = str(name_or_path)
        known = ", ".join(shipped_scenes())
        near = difflib.get_close_matches(name, shipped_scenes(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _refusal(
            f"no scene {name!r}: neither a shipped scene ({known}) nor a readable file ({reason}){hint}"
        ) from error
    return _parse(text, str(path), path.suffix.lower())


def _parse(text: str, source: str, suffix: str) -> dict[str, object]:
    try:
        if suffix == ".toml":
            return read_toml(text)
        if suffix == ".json":
            raw = json.loads(text, object_pairs_hook=_without_duplicates)
        else:
            raise _refusal(f"{source!r} must end in .toml or .json, got {suffix!r}")
    except TomlError as error:
        raise _refusal(f"{source!r} is not valid TOML: {error}") from error
    except json.JSONDecodeError as error:
        raise _refusal(f"{source!r} is not valid JSON: {error}") from error
    except ValueError as error:
        raise _refusal(f"{source!r} holds a number that cannot be read: {error}") from error
    except RecursionError as error:
        raise _refusal(f"{source!r} is nested too deeply for a scene") from error
    if not isinstance(raw, dict):
        raise _refusal(f"{source!r} must hold one table, got {type(raw).__name__}")
    return raw


def _without_duplicates(pairs: list[tuple[str, object]]) -> dict[str, object]:
    table: dict[str, object] = {}
    for key, value in pairs:
        if key in table:
            raise _refusal(f"`{key}` is given twice in one table: {table[key]!r} and {value!r}; keep one")
        table[key] = value
    return table


def _refusal(message: str) -> SceneError:
    return SceneError.of((), message, named=False)


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
