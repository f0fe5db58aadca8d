"""The kind `design`: the best damper of a scene, with every frequency response computed on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import optim
from service.jobs import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from service.kinds.problem import ProblemRequest, arguments
from service.kinds.problem_check import problem_issues
from service.kinds.records import design_record, sweep_record
from service.kinds.scenes import require, resolve_scene, resolved
from solver.scene import Scene


class DesignRequest(ProblemRequest):
    """A design problem, in the words of the command."""


def resolve(request: DesignRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the problem, fill in the variables."""
    scene = resolve_scene(request, source)
    given = arguments(request)
    require(problem_issues(scene, given))
    return resolved(scene, **given, **default_variables(scene, given))


def default_variables(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    """The variables that stand for none, so that a spec says what is chosen."""
    from optim.variables import check_variables

    if "variables" in given:
        return {}
    return {"variables": {v.name: [v.low, v.high] for v in check_variables(scene, None)}}


def problem_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of the design layer in a spec; those of an older version name what was not given too."""
    return {key: value for key, value in spec.items() if key != "scene" and value is not None}


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Search."""
    found = optim.design(
        Scene.from_dict(spec["scene"]), **problem_of(spec), on_progress=progress, should_stop=should_stop
    )
    return JobOutput(
        result=found.to_json(),
        sweeps=tuple(sweep_record(branch) for branch in found.sweeps if len(branch.values)),
        design=design_record(found),
        shortfall=None if found.reached else found.status.value,
    )


DESIGN = JobKind(
    name="design",
    summary="The best damper of a scene.",
    request=DesignRequest,
    resolve=resolve,
    run=run,
)
