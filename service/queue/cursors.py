"""Where a page of a list ended, as text for the next request; opaque to clients."""

from __future__ import annotations

import base64
import binascii
import json
import math
from urllib.parse import urlencode

from pydantic import BaseModel

from service.errors import InvalidRequestError
from solver.errors import Issue

Position = tuple[float | None, str]


def encode(value: float | None, row_id: str) -> str:
    """The position behind a row: its sort value (None if sorted by id alone) and its id."""
    return base64.urlsafe_b64encode(json.dumps([value, row_id]).encode()).decode().rstrip("=")


def decode(cursor: str) -> Position:
    """The position of a cursor.

    Raises
    ------
    InvalidRequestError
        If this service did not make it.
    """
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        value, row_id = json.loads(base64.urlsafe_b64decode(padded.encode("ascii")))
    except (ValueError, TypeError, binascii.Error, RecursionError) as error:
        raise _refused(cursor) from error
    number = value is None or (isinstance(value, int | float) and math.isfinite(value))
    if not number or isinstance(value, bool) or not isinstance(row_id, str):
        raise _refused(cursor)
    return value, row_id


def next_link(path: str, query: BaseModel, value: float | None, row_id: str) -> str:
    """The link to the page behind a row: what was asked, but with that row's position."""
    given = query.model_dump(exclude_defaults=True, exclude={"cursor"}, mode="json")
    words = {key: str(item).lower() if isinstance(item, bool) else item for key, item in given.items()}
    return f"{path}?" + urlencode({**words, "cursor": encode(value, row_id)}, doseq=True)


def _refused(cursor: str) -> InvalidRequestError:
    message = f"`cursor` must come from the `next` link of a page, got {cursor[:80]!r}"
    return InvalidRequestError([Issue(pointer="/cursor", message=message)], source="query")
