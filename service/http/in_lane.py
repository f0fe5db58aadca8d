"""Endpoints that look something up or compute, run in the lane they belong to."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import wraps
from typing import Any, TypeVar

from service.http.dependencies import Context
from service.queue.lanes import Lane, Lanes

_T = TypeVar("_T")
_Decorator = Callable[[Callable[..., _T]], Callable[..., Awaitable[_T]]]


def _in(lane_of: Callable[[Lanes], Lane]) -> _Decorator[Any]:
    """Have a function with a parameter `context` run in a lane when it is its owner's turn."""

    def decorate(endpoint: Callable[..., _T]) -> Callable[..., Awaitable[_T]]:
        @wraps(endpoint)
        async def run(**values: Any) -> _T:
            context: Context = values["context"]
            return await lane_of(context.service.lanes).run(context.caller.owner, endpoint, **values)

        return run

    return decorate


reading = _in(lambda lanes: lanes.reads)
writing = _in(lambda lanes: lanes.writes)
writing_files = _in(lambda lanes: lanes.files)
drawing = _in(lambda lanes: lanes.pictures)
