"""What a route looks up or has computed: in the lane it belongs to, or beside the service."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

from service.errors import InvalidRequestError, issues_to_json
from service.http.dependencies import Context
from service.jobs.answering import PREVIEW, RESOLVE, Prepared
from service.jobs.kind_registry import JobRequest, Json, SceneSource
from service.jobs.strict_json import JsonText
from service.queue.core import SOLVER_VERSION
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


_MOST_LOOKED_UP = 8
"""Scenes and uploads of one request; shipped scenes need no looking up."""


async def computed(context: Context, task: str, words: Mapping[str, Any], about: str = "scene") -> Any:
    """What a task of `service.jobs.answering` finds; `Answers.ask` has `about` and the errors."""
    service, caller = context.service, context.caller
    source = service.scenes.of(caller)
    spec: dict[str, Any] = {"words": words, "scenes": {}, "uploads": {}}
    for _ in range(_MOST_LOOKED_UP + 1):
        told = await service.answers.ask(task, spec, caller.owner, about)
        if "needs" not in told:
            return told["found"]
        await service.lanes.reads.run(caller.owner, _look_up, told["needs"], source, spec)
    raise RuntimeError(f"the task {task!r} looks up more than {_MOST_LOOKED_UP} scenes")


async def prepared(context: Context, body: Json, request: JobRequest, task: str = RESOLVE) -> Prepared:
    """What a body asks for, a job or a preview, which was checked, resolved; `computed` lists the errors."""
    settings = context.service.settings
    memory = settings.answer_memory_bytes if task == PREVIEW else settings.worker_memory_bytes or None
    work = context.caller.limits.work
    words = {"request": request, "body": body, "work": work, "memory": memory, "version": SOLVER_VERSION}
    found = await computed(context, task, words)
    return Prepared(**{**found, "spec": JsonText(found["spec"])})


def _look_up(needs: Mapping[str, Any], source: SceneSource, spec: dict[str, Any]) -> None:
    """Put what a task needs where it finds it."""
    if "scene" in needs:
        spec["scenes"][needs["scene"]] = source.scene_body(needs["scene"])
        return
    try:
        found: dict[str, Any] = {"scene": source.with_uploads(needs["uploads"])}
    except InvalidRequestError as error:
        found = {"issues": issues_to_json(error.issues)}
    spec["uploads"][needs["as"]] = found
