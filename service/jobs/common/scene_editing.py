"""A scene's text and its tables side by side: what either becomes when the other is changed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from service.errors import MalformedBodyError
from service.jobs.common.scene_text import issues_of_scene, read_text
from service.jobs.registry import SceneSource
from solver.scene.editing import TextPlace, edited, place_at, places

_AT = re.compile(r"\bline (\d+)(?:, column (\d+))?")

Told = dict[str, Any]


def side_by_side(text: str, scene: Mapping[str, Any] | None, source: SceneSource) -> Told:
    """The text, the tables in it, and what is wrong with its line and column.

    Parameters
    ----------
    text : TOML.
    scene : the tables it is to hold; None: those it holds, None too where it cannot be read.
    """
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
