"""Scenes as text: read with everything wrong in them; what text and tables become when either is changed."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from service.errors import InvalidRequestError, MalformedBodyError
from service.jobs import strict_json
from service.jobs.common.scene_requests import read_scene
from service.jobs.kind_registry import SceneSource
from service.jobs.strict_json import MOST_DEPTH
from solver.errors import Issue
from solver.scene.editing import TextPlace, edited, place_at, places
from solver.scene.toml import TomlError, read_toml

MOST_OF_TOML = 1_500_000
"""Characters of a text in TOML: a sector of finite elements with the matrices of its nodal diameters has 1.4
million. What takes long to read in so many meets the limit of time of an answer."""

_WORD = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
# Without the limit a key of n words takes a time of n².
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_WORD}[ \t]*+\.[ \t]*+){{{MOST_DEPTH},}}+")
_LONG_INTEGER = re.compile(r"(?<![0-9A-Za-z_.])(?:0[xob][0-9A-Fa-f_]{250,}|[0-9][0-9_]{308,})")


def read_text(text: str, form: str) -> dict[str, Any]:
    """The tables of a scene in TOML or JSON, not yet checked; JSON values alone.

    What JSON has no value for stands there as text: dates, and numbers that are not finite.

    Raises
    ------
    MalformedBodyError
        With line and column.
    InvalidRequestError
        A number of JSON that is not finite; a text that is too long.
    """
    raw = _toml(text) if form == "toml" else _json(text)
    if not isinstance(raw, dict):
        raise MalformedBodyError(f"a scene must be a table, got {type(raw).__name__}")
    return raw


def _json(text: str) -> object:
    try:
        return strict_json.loads(text.encode())
    except InvalidRequestError as error:
        raise InvalidRequestError([one.at("text") for one in error.issues]) from error


def _toml(text: str) -> object:
    if len(text) > MOST_OF_TOML:
        raise InvalidRequestError.of(("text",), f"in TOML may have {MOST_OF_TOML} characters", len(text))
    too_long = _LONG_KEY.search(text)
    if too_long:
        line = _line(text, too_long.start())
        raise MalformedBodyError(f"line {line} is nested too deeply: a key has {MOST_DEPTH} words at most")
    try:
        # Dates are TOML but no JSON.
        written = json.dumps(read_toml(text), default=str, check_circular=False)
    except TomlError as error:
        raise MalformedBodyError(f"this is not valid TOML: {error}") from error
    except RecursionError as error:
        detail = f"this is nested too deeply for a scene: {MOST_DEPTH} levels are the most"
        raise MalformedBodyError(detail) from error
    except ValueError as error:
        raise MalformedBodyError(_about_number(text, error)) from error
    return strict_json.marked(written.encode())


def _about_number(text: str, error: ValueError) -> str:
    found = _LONG_INTEGER.search(text)
    if found is None:
        return f"this is not valid TOML: {error}"
    where = f"line {_line(text, found.start())}"
    return f"{where} has an integer of {len(found[0])} digits, none may have more than 308"


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def issues_of_scene(raw: Mapping[str, Any], source: SceneSource) -> list[Issue]:
    """Everything wrong with a scene, whose uploads are looked up in `source`."""
    found = strict_json.issues_of_numbers(raw)
    known = {issue.pointer for issue in found}
    try:
        read_scene(source.with_uploads(raw))
    except InvalidRequestError as error:
        found += [issue for issue in error.issues if issue.pointer not in known]
    return found


_AT = re.compile(r"\bline (\d+)(?:, column (\d+))?")

Told = dict[str, Any]


def side_by_side(text: str, scene: Mapping[str, Any] | None, source: SceneSource) -> Told:
    """The text, the tables in it, and what is wrong with its line and column.

    Parameters
    ----------
    text : TOML.
    scene : the tables it is to hold; None: those it holds, None too where it cannot be read.
    """
    text = text.removeprefix("\ufeff")
    try:
        held = read_text(text, "toml")
    except MalformedBodyError as error:
        if scene is None:
            return {"text": text, "scene": None, "issues": [_unreadable(text, error.detail)]}
        text, held = "", {}
    if scene is not None:
        held = _without_null(scene)
        text = edited(text, held, lambda changed: read_text(changed, "toml"))
    issues = issues_of_scene(held, source)
    lines = text.replace("\r\n", "\n")
    root = places(lines) if issues else None
    found = [_told(lines, root, issue.pointer, issue.said()) for issue in issues]
    return {"text": text, "scene": held, "issues": found}


def _without_null(value: Any) -> Any:
    """A table without its keys that have no value: TOML has no null."""
    if isinstance(value, Mapping):
        return {key: _without_null(one) for key, one in value.items() if one is not None}
    return [_without_null(one) for one in value] if isinstance(value, list) else value


def _unreadable(text: str, detail: str) -> Told:
    """Where a text is no TOML; its end if the reader names no line."""
    found = _AT.search(detail)
    line = int(found[1]) if found else max(text.count("\n") + (not text.endswith("\n")), 1)
    column = int(found[2]) if found and found[2] else None
    return {"pointer": "", "detail": detail, "line": line, "column": column}


def _told(text: str, root: TextPlace | None, pointer: str, detail: str) -> Told:
    at = place_at(root, pointer).start if root is not None and pointer else 0
    line = text.count("\n", 0, at) + 1
    return {"pointer": pointer, "detail": detail, "line": line, "column": at - text.rfind("\n", 0, at)}
