"""The kind `solve`: the periodic response at one frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.kinds.scenes import FrequencyHz, HarmonicRequest, require, resolve_scene, resolved
from service.jobs.kinds.sizes import balance_issues
from service.jobs.registry import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from solver.scene.scene import Scene

_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.2, "set": {"damper.N0": 80}}


class SolveRequest(HarmonicRequest):
    """One response; `frequency_hz` is the excitation frequency [Hz]."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    frequency_hz: FrequencyHz = Field(description="Excitation frequency [Hz].")


def resolve(request: SolveRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the size."""
    scene = resolve_scene(request, source)
    require(balance_issues("/harmonics", scene, request.harmonics))
    return resolved(scene, frequency_hz=request.frequency_hz, harmonics=request.harmonics)


def run(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Solve the balance."""
    solution = solver.solve(
        Scene.from_dict(spec["scene"]), frequency_hz=spec["frequency_hz"], harmonics=spec["harmonics"]
    )
    return JobOutput(
        result=solution.to_json(), shortfall=None if solution.converged else solution.status.value
    )


SOLVE = JobKind(
    name="solve",
    summary="The periodic response at one frequency.",
    request=SolveRequest,
    resolve=resolve,
    run=run,
)
