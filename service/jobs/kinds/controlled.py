"""The kind `controlled`: responses over the frequency at a held amplitude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import solver
from optim.criteria.json_types import Name
from service.jobs.common.results import Curve, EndedResult, Table
from service.jobs.common.scenes import (
    HarmonicRequest,
    PositiveNumber,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "amplitude": 1.0}
_POINTS = 200  # a curve seldom has more


class ControlledRequest(HarmonicRequest):
    """Responses of one amplitude, in the words of the command.

    Attributes
    ----------
    amplitude : float
        Of harmonic 1 [m].
    from_, to : float or None
        Frequencies [Hz] (`from` in the body).
    dof : str or None
        Whose amplitude.
    no_stability : bool
        Leave out whether responses are stable.
    """

    model_config = ConfigDict(validate_by_alias=True, json_schema_extra={"examples": [_EXAMPLE]})

    amplitude: PositiveNumber = Field(description="Amplitude of harmonic 1 that is held [m].")
    from_: PositiveNumber | None = Field(
        default=None, alias="from", description="First frequency [Hz]; the scene's band if left out."
    )
    to: PositiveNumber | None = Field(default=None, description="Last frequency [Hz].")
    dof: Name | None = Field(default=None, description="Whose amplitude; what the scene observes.")
    no_stability: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Leave out whether responses are stable: faster."
    )


class ControlledResult(EndedResult):
    """The force that holds the amplitude, over the frequency."""

    scene: str
    dof: str
    amplitude: float
    frequency: Curve
    excitation: Curve
    excitation_error: Curve
    phase: Curve
    max_abs: Curve
    contacts: list[str]
    states: list[list[str]]
    changes: list[Table]
    stable: list[bool | None]
    stability_unknown: str
    least: Table | None
    n_harmonics: int
    seconds: float


def resolve(request: ControlledRequest, source: SceneSource) -> Resolved:
    """Look up the scene; check the range, the DOF and the size."""
    scene = resolve_scene(request, source)
    require(_issues(request, scene) or balance_issues("/harmonics", scene, request.harmonics, _POINTS))
    return resolved(
        scene,
        amplitude=request.amplitude,
        start=request.from_,
        stop=request.to,
        dof=request.dof,
        no_stability=request.no_stability,
        harmonics=request.harmonics,
    )


def _issues(request: ControlledRequest, scene: Scene) -> list[Issue]:
    """Everything wrong with the request for the scene."""
    issues: list[Issue] = []
    low, high = scene.observe.band
    low = low if request.from_ is None else request.from_
    high = high if request.to is None else request.to
    if low >= high:
        issues.append(refusal("/to", f"`to` must be above `from` = {low!r} Hz, got {high!r}"))
    if request.harmonics < 1:
        issues.append(refusal("/harmonics", f"`harmonics` must be from 1, got {request.harmonics!r}"))
    if request.dof is not None and request.dof not in scene.dofs:
        words = f"`dof` must be one of {', '.join(scene.dofs)}, got {request.dof!r}"
        issues.append(refusal("/dof", words))
    if any(force.harmonic != 1 for force in scene.excitation):
        issues.append(
            refusal("/scene", "must have an excitation of harmonic 1 alone: it holds the amplitude")
        )
    return issues


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the responses."""
    found = solver.held_amplitude(
        Scene.from_dict(spec["scene"]),
        spec["amplitude"],
        start=spec["start"],
        stop=spec["stop"],
        dof=spec["dof"],
        harmonics=spec["harmonics"],
        stability=False if spec["no_stability"] else None,
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput(result=found.to_json(), shortfall=None if found.completed else found.status.value)


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """Force and phase over the frequency."""
    from solver.views.plots.modes import held_figure

    if not result["frequency"]:
        raise NothingToDrawError("no response with this amplitude was found")
    return held_figure(result)


CONTROLLED = JobKind(
    name="controlled",
    summary="Responses over the frequency at a held amplitude: which force they take.",
    request=ControlledRequest,
    resolve=resolve,
    run=run,
    result=ControlledResult,
    view=KindView(
        result="force and phase over the frequency ([a held amplitude](modes.md#a-held-amplitude))",
        draw=draw,
    ),
)
