"""Answers that are no JSON of a model, for the description of the API."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Responses = dict[int | str, dict[str, Any]]

TEXT: dict[str, Any] = {"type": "string"}
BINARY: dict[str, Any] = {"type": "string", "contentMediaType": "application/octet-stream"}
UNCHANGED: Responses = {304: {"description": "`If-None-Match` has its ETag."}}


def media(schemas: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """An answer in further media types."""
    return {"content": {name: {"schema": dict(schema)} for name, schema in schemas.items()}}


LISTED: Responses = {200: media({"text/csv": TEXT})}
