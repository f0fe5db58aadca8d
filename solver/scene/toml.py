"""Scenes from files, shipped ones by name and others by path; tables as TOML text."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
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
        raise TomlError(f"{error}{_hint(line[0] if line else '')}") from error


def _hint(line: str) -> str:
    """What to write in place of what stands in a line that is no TOML."""
    if any(quote in line for quote in "“”„‘’"):
        return '; plain quotes, "…", around texts'
    if "\\" in line and '"' in line:
        return "; paths with / , or in '…', where a backslash stands for itself"
    return comma_hint(line)


@cache
def shipped_scenes() -> tuple[str, ...]:
    """Names of the scenes that come with the package, sorted."""
    folder = resources.files("solver.scene") / "shipped"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def shipped_text(name: str) -> str:
    """The file of a shipped scene."""
    return (resources.files("solver.scene") / "shipped" / f"{name}.toml").read_text(encoding="utf-8")


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
        return _parse(shipped_text(name_or_path), name_or_path, ".toml")
    if not isinstance(name_or_path, str | Path):
        raise _refusal(f"a scene must be a name or a path, got {name_or_path!r}")
    path = Path(found_scene(name_or_path))
    if path.suffix.lower() in _TAKEN_BY and path.is_file():
        raise _refusal(f"{str(path)!r} is no scene (.toml, .json): {_TAKEN_BY[path.suffix.lower()]}")
    try:
        data = path.read_bytes()
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        packed = next((words for head, words in _PACKED.items() if data.startswith(head)), "")
        words = packed or f"not UTF-8 text (byte {error.start}): save it as UTF-8"
        raise _refusal(f"{str(path)!r} is {words}") from error
    except (OSError, ValueError) as error:
        raise _refusal(f"no scene {str(name_or_path)!r}: {_nowhere(path, error)}") from error
    return _parse(text, str(path), path.suffix.lower())


_IMPORT = "`stickslip import` makes one of matrices, modes or a mesh"
_IDENTIFY = "measurements are for `stickslip identify SCENE DATA…`"
_TAKEN_BY = {
    **dict.fromkeys((".mtx", ".npz", ".mat", ".inp", ".bdf", ".dat", ".cdb", ".op4", ".pch", ".hb"), _IMPORT),
    **dict.fromkeys((".csv", ".parquet", ".uff", ".unv", ".txt"), _IDENTIFY),
}
_PACKED = {
    **dict.fromkeys((b"\xff\xfe", b"\xfe\xff"), "UTF-16 text: save it as UTF-8"),
    b"\x1f\x8b": "packed by gzip: unpack it", b"PK": "a zip archive: unpack it",
}  # fmt: skip


def found_scene(name: str | Path) -> str | Path:
    """The name of a shipped scene or a file as it is; of a file without its ending, the file."""
    if not name or name in shipped_scenes() or Path(name).is_file():
        return name
    return next((f"{name}{end}" for end in (".toml", ".json") if Path(f"{name}{end}").is_file()), name)


def _nowhere(path: Path, error: Exception) -> str:
    """Why there is no scene at a path, with the name that was meant, if one is near."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    hint = ""
    with suppress(OSError, ValueError):
        beside = sorted(str(one) for end in ("toml", "json") for one in path.parent.glob(f"*.{end}"))
        if path.is_dir():
            inside = sorted(str(one) for one in path.glob("*.toml"))
            return f"it is a folder, a scene is a file{f' such as {inside[0]!r}' if inside else ''}"
        near = difflib.get_close_matches(str(path), [*shipped_scenes(), *beside], n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"neither a shipped scene ({', '.join(shipped_scenes())}) nor a readable file ({reason}){hint}"


def _parse(text: str, source: str, suffix: str) -> dict[str, object]:
    try:
        if suffix == ".toml":
            raw = read_toml(text)
        elif suffix == ".json":
            raw = json.loads(text, object_pairs_hook=_without_duplicates)
        else:
            raise _refusal(f"{source!r} must end in .toml or .json, got {suffix!r}")
    except TomlError as error:
        raise _refusal(f"{source!r} is not valid TOML: {error}") from error
    except json.JSONDecodeError as error:
        line = text.splitlines()[error.lineno - 1] if text else ""
        hint = "; double quotes around keys and texts" if "'" in line else comma_hint(line)
        if not hint and text[: error.pos].rstrip().endswith(","):
            hint = "; no comma behind the last entry"
        raise _refusal(f"{source!r} is not valid JSON: {error}{hint}") from error
    except ValueError as error:
        raise _refusal(f"{source!r} holds a number that cannot be read: {error}") from error
    except RecursionError as error:
        raise _refusal(f"{source!r} is nested too deeply for a scene") from error
    if not isinstance(raw, dict):
        raise _refusal(f"{source!r} must hold one table, got {type(raw).__name__}")
    if "structure" not in raw and "variables" in raw:
        raise _refusal(f"{source!r} is a design problem, no scene: give it as `--problem {source}`")
    if "structure" not in raw and {"kind", "status"} & raw.keys():
        raise _refusal(f"{source!r} is a result, no scene: `stickslip check-proof` reads those with proofs")
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
