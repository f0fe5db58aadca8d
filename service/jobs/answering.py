"""What is computed of a request before it is answered, in a process with limits: plans, texts, checks.

Scenes are a stranger's: reading one, resolving what is asked about it and planning it may take any time and
memory. The service hands these tasks to worker processes, and looks up what they need: they have no database.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, Any

from service.errors import BodyTooLargeError, InvalidRequestError, MalformedBodyError, issues_to_json
from service.jobs.common.measurements import look_at, read_measurements
from service.jobs.common.scene_parameters import scene_parameters
from service.jobs.common.scene_requests import read_scene, refers_to_uploads, require, resolve_scene
from service.jobs.common.scene_text import issues_of_scene, read_text, side_by_side
from service.jobs.common.sizes import memory_limited, work_limited
from service.jobs.kind_registry import KIND, JobRequest, Registry, Resolve, RunOn, SceneSource
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.strict_json import JsonText, digest, encoded
from service.jobs.studies.plan_study import Plan
from service.jobs.study import Watch
from solver.jit.compiler_process import interpret

PLAN, READ, TEXT, STORE, RESOLVE, PREVIEW = "plan", "read", "text", "store", "resolve", "preview"
MEASURED, LOOK, EDIT, PARAMETERS = "measured", "look", "edit", "parameters"

Words = Mapping[str, Any]
Answer = Callable[[Words, SceneSource], Any]


class NeededError(Exception):
    """A task needs what the service has to look up."""

    def __init__(self, what: dict[str, Any]) -> None:
        self.what = what
        super().__init__(str(what))


@dataclass(frozen=True, slots=True)
class LookedUp:
    """What the service has looked up for a task, as a `SceneSource`."""

    scenes: Annotated[Mapping[str, Any], "Stored scenes by name; None for a name that has none."]
    uploads: Annotated[
        Mapping[str, Any],
        "Scenes with what their uploads hold, or what is wrong with these, by the digest of the scene.",
    ]

    def scene_body(self, name: str) -> Mapping[str, object] | None:
        """Tables and lists of a stored scene, or None."""
        if name not in self.scenes:
            raise NeededError({"scene": name})
        body: Mapping[str, object] | None = self.scenes[name]
        return body

    def with_uploads(self, body: Mapping[str, object]) -> Mapping[str, object]:
        """A scene with what its uploads hold in place of their ids."""
        if not refers_to_uploads(body):
            return body
        found = self.uploads.get(key := digest(body))
        if found is None:
            raise NeededError({"uploads": body, "as": key})
        if "issues" in found:
            raise InvalidRequestError.from_json(found["issues"])
        whole: Mapping[str, object] = found["scene"]
        return whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A request for a job with everything looked up and checked, as its row keeps it."""

    spec: JsonText
    spec_hash: str
    request_hash: str
    scene_name: str | None
    scene_hash: str | None


def prepared(
    resolve: Resolve, request: JobRequest, body: Words, source: SceneSource, *,
    work: int | None, memory: int | None, version: str,
) -> Prepared:  # fmt: skip
    """Resolve a request for a job.

    InvalidRequestError with everything that is wrong.

    Parameters
    ----------
    request, body : what is asked of the kind, and as it came, with its kind.
    work : limit of the caller's key.
    memory : most that the dense matrices may take [bytes].
    version : of the solver, on which results depend.
    """
    with work_limited(work), memory_limited(memory):
        found = resolve(request, source)
    return Prepared(
        spec=encoded(found.spec),
        spec_hash=digest({"kind": body[KIND], "spec": found.spec, "version": version}),
        request_hash=digest(body),
        scene_name=found.scene_name,
        scene_hash=found.scene_hash,
    )


@dataclass(frozen=True, slots=True)
class _Resolving:
    """The task that resolves requests of some kinds; sent to the processes by the names of its parts."""

    kinds: Mapping[str, Resolve]

    @classmethod
    def of(cls, registry: Registry) -> _Resolving:
        return cls({kind.name: kind.resolve for kind in registry})

    def __call__(self, words: Words, source: SceneSource) -> dict[str, Any]:
        return asdict(prepared(self.kinds[words["body"][KIND]], source=source, **words))


def _plan(words: Words, source: SceneSource) -> dict[str, Any]:
    request: Plan = words["request"]
    scene = resolve_scene(request, source)
    require(request.issues(scene))
    return Plan.compute(scene, request.spec(scene), Watch()).json


def _read(words: Words, source: SceneSource) -> JsonText:
    raw = read_text(words["text"], words["form"])
    issues = [{"pointer": issue.pointer, "detail": issue.said()} for issue in issues_of_scene(raw, source)]
    return encoded({"scene": raw, "issues": issues})


def _edit(words: Words, source: SceneSource) -> JsonText:
    return encoded(side_by_side(words["text"], words["scene"], source))


def _text(words: Words, source: SceneSource) -> str:
    from solver.scene.toml import toml_text

    scene = resolve_scene(words["request"], source)
    return toml_text(scene.to_dict(), tuple(words["comments"]))


def _parameters(words: Words, source: SceneSource) -> JsonText:
    return encoded(scene_parameters(resolve_scene(words["request"], source)).model_dump())


def _measured(words: Words, source: SceneSource) -> JsonText:
    scene = resolve_scene(words["request"], source)
    return encoded(read_measurements(scene, words["files"]))


def _look(words: Words, source: SceneSource) -> JsonText:
    return encoded(look_at(resolve_scene(words["request"], source), words["files"]))


def _store(words: Words, source: SceneSource) -> dict[str, Any]:
    scene = read_scene(source.with_uploads(words))
    tables = scene.to_dict()
    return {"name": scene.name, "scene_hash": digest(tables), "tables": encoded(tables)}


@dataclass(frozen=True, slots=True)
class Answering:
    """A task as workers run it: what it finds, what is wrong, or what it needs, and the time it took."""

    task: Answer

    def __call__(
        self, spec: Words, _progress: Progress, _should_stop: ShouldStop, _kept: object
    ) -> JobOutput:
        """Do the task."""
        begin = time.process_time()
        result = self._result(spec["words"], LookedUp(spec["scenes"], spec["uploads"]))
        return JobOutput(result={**result, "seconds": time.process_time() - begin})

    def _result(self, words: Words, source: SceneSource) -> dict[str, Any]:
        try:
            return {"found": self.task(words, source)}
        except NeededError as error:
            return {"needs": error.what}
        except InvalidRequestError as error:
            return {"issues": issues_to_json(error.issues)}
        except MalformedBodyError as error:
            return {"malformed": error.detail}
        except BodyTooLargeError as error:
            return {"too_large": error.detail}


def runs(jobs: Registry, previews: Registry) -> dict[str, RunOn]:
    """The functions of the processes, by the names of the tasks."""
    tasks: dict[str, Answer] = {
        PLAN: _plan, READ: _read, TEXT: _text, EDIT: _edit, STORE: _store, MEASURED: _measured, LOOK: _look,
        PARAMETERS: _parameters, RESOLVE: _Resolving.of(jobs), PREVIEW: _Resolving.of(previews),
    }  # fmt: skip
    return {name: Answering(task) for name, task in tasks.items()}


def warm_up() -> None:
    """Load and compile what the tasks need; where nothing is compiled yet they are interpreted."""
    interpret()
    import solver
    from solver.scene import toml

    solver.plan(solver.load_scene("two-dof"), harmonics=3)
    toml.toml_text({})
