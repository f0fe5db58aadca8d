"""The revision of what can be changed, as `ETag` of its answers and in `If-Match` of changes (RFC 9110)."""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import Depends, Header, Response

from service.http.dependencies import as_json
from service.schemas.workbench_answers import ProjectAnswer, RunAnswer

_TAG = re.compile(r'"(\d{1,9})"')
_TOLD: dict[str, Any] = {"ETag": {"description": "The revision.", "schema": {"type": "string"}}}
REVISED: dict[int | str, dict[str, Any]] = {200: {"headers": _TOLD}}
"""Of an answer that has its revision as `ETag`, for the description of the API."""


async def expected(
    if_match: Annotated[
        str | None,
        Header(max_length=200, description="The `ETag` of what is to be changed; anything if left out."),
    ] = None,
) -> frozenset[int] | None:
    """The revisions of which it must have one; None for any."""
    if if_match is None or if_match.strip() == "*":
        return None
    found = (_TAG.fullmatch(one.strip()) for one in if_match.split(","))
    return frozenset(int(one[1]) for one in found if one is not None)


ExpectedDependency = Annotated[frozenset[int] | None, Depends(expected)]


def revised(answer: RunAnswer | ProjectAnswer, status: int = 200) -> Response:
    """An answer with its revision as `ETag`.

    Its words are what the tag is of: the progress of a run that computes changes without it, so the answer is
    not one to be kept by caches.
    """
    headers = {"ETag": f'"{answer.revision}"', "Cache-Control": "no-store"}
    return as_json(answer, status, headers)
