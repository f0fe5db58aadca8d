"""The kind `design`: the best damper of a scene, with every frequency response computed on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

import optim
from optim.errors import DesignError
from service.jobs import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from service.kinds.records import sweep_record
from service.kinds.scenes import (
    FrequencyHz,
    HarmonicRequest,
    Number,
    ParameterPath,
    PositiveNumber,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.strict_json import pointer
from solver.errors import Issue, SettingError
from solver.scene import Scene

Bounds = Annotated[list[Number], Field(min_length=2, max_length=2)]


class DesignRequest(HarmonicRequest):
    """A design, in the words of the command.

    Attributes
    ----------
    variables : dict or None
        Parameter path to [low, high]; the normal load of the first damper if left out.
    limit : float or None
        Amplitude [m] above which the resonance band is measured.
    max_band_hz : float or None
        Largest width of that band allowed [Hz].
    start : dict or None
        A design to start from, parameter path to value.
    """

    variables: Annotated[dict[ParameterPath, Bounds], Field(min_length=1, max_length=50)] | None = Field(
        default=None, description='Parameter path to [low, high], {"damper.N0": [20, 1000]}.'
    )
    limit: PositiveNumber | None = Field(
        default=None, description="Amplitude [m] above which the resonance band is measured."
    )
    max_band_hz: FrequencyHz | None = Field(
        default=None, description="Largest width of that band allowed [Hz]."
    )
    start: dict[ParameterPath, Number] | None = Field(
        default=None, max_length=50, description="A design to start from, parameter path to value."
    )


def resolve(request: DesignRequest, source: SceneSource) -> Resolved:
    """Look up the scene, fill in the variables, check their bounds."""
    scene = resolve_scene(request, source)
    variables = _variables(request, scene)
    require(_start_issues(request.start, variables))
    return resolved(
        scene,
        variables=variables,
        limit=request.limit,
        max_band_hz=request.max_band_hz,
        harmonics=request.harmonics,
        start=request.start,
    )


def _variables(request: DesignRequest, scene: Scene) -> dict[str, list[float]]:
    """The variables with their bounds, each checked by the design layer."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.variables import check_variables

    issues: list[Issue] = []
    found: dict[str, list[float]] = {}
    asked = [None] if request.variables is None else [{p: b} for p, b in request.variables.items()]
    for one in asked:
        where = pointer("variables") if one is None else pointer("variables", *one)
        bounds = None if one is None else {path: (low, high) for path, (low, high) in one.items()}
        try:
            checked = check_variables(scene, bounds)
        except (SettingError, DesignError) as error:
            issues.append(refusal(where, str(error)))
            continue
        found |= {variable.name: [variable.low, variable.high] for variable in checked}
    require(issues)
    return found


def _start_issues(start: Mapping[str, float] | None, variables: Mapping[str, list[float]]) -> list[Issue]:
    if start is None:
        return []
    paths = ", ".join(variables)
    issues = [
        refusal(pointer("start", path), f"`start` must name the variables {paths}, got {path!r}")
        for path in start
        if path not in variables
    ]
    for path, (low, high) in variables.items():
        if path not in start:
            message = f"`start` must name the variables {paths}, {path} is missing"
            issues.append(refusal(pointer("start"), message))
        elif not low <= start[path] <= high:
            message = f"`start.{path}` must be from {low!r} to {high!r}, got {start[path]!r}"
            issues.append(refusal(pointer("start", path), message))
    return issues


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Search."""
    found = optim.design(
        Scene.from_dict(spec["scene"]),
        variables={path: (low, high) for path, (low, high) in spec["variables"].items()},
        limit=spec["limit"],
        max_band_hz=spec["max_band_hz"],
        harmonics=spec["harmonics"],
        start=spec["start"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput(
        result=found.to_json(),
        sweeps=tuple(sweep_record(branch) for branch in found.sweeps if len(branch.values)),
        shortfall=None if found.reached else found.status.value,
    )


DESIGN = JobKind(
    name="design",
    summary="The best damper of a scene.",
    request=DesignRequest,
    resolve=resolve,
    run=run,
)
