"""Scenes as text: read from TOML or JSON with everything wrong in them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from typing import Any

from service.errors import InvalidRequestError, MalformedBodyError
from service.jobs import strict_json
from service.jobs.common.scenes import read_scene
from service.jobs.registry import SceneSource
from solver.errors import Issue


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


def issues_of_scene(raw: Mapping[str, Any], source: SceneSource) -> list[Issue]:
    """Everything wrong with a scene, whose uploads are looked up in `source`."""
    try:
        read_scene(source.with_uploads(raw))
    except InvalidRequestError as error:
        return list(error.issues)
    return []
