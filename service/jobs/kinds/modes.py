"""The kind `modes`: frequency and damping ratio of a mode over its amplitude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field, RootModel

import solver
from service.jobs.common.modes import MOST_PEAKS, MOST_POINTS, exact_peaks, excitations, motions_of
from service.jobs.common.results import Curve, EndedResult, Table
from service.jobs.common.scenes import (
    HarmonicRequest,
    Number,
    PositiveNumber,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue, SettingError, pointer
from solver.results.watch import part_of
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "mode": 1, "from": 0.01, "to": 100}
_POINTS = 200  # a curve seldom has more
_MOST_MODES = 100_000
_OF_THE_CURVE = 0.3  # share of the progress, where exact peaks follow


class ModesRequest(HarmonicRequest):
    """A nonlinear mode, in the words of the command.

    Attributes
    ----------
    mode : int
        Number of the mode, 1 the slowest.
    from_, to : float
        Modal amplitudes [√kg m] (`from` in the body).
    nodal_diameter : int or None
        Of a cyclic structure.
    performance : bool
        Peaks over excitation and load too.
    aero_damping : float or None
        Damping ratio of the gas, for the limit cycles.
    mode_alone : bool
        Whether the gas feeds this mode alone.
    motions : bool
        Loops and shapes too.
    exact_peaks : int
        How many excitations the performance curve is compared at.
    disturbance : float or None
        Modal amplitude that is to die down.
    phase_resonance : bool
        The forced responses instead.
    """

    model_config = ConfigDict(validate_by_alias=True, json_schema_extra={"examples": [_EXAMPLE]})

    mode: Annotated[int, Field(strict=True, ge=1, le=_MOST_MODES)] = Field(
        default=1, description="Which mode, 1 the slowest, contacts as they are at rest."
    )
    from_: PositiveNumber = Field(alias="from", description="Smallest modal amplitude [√kg m].")
    to: PositiveNumber = Field(description="Largest modal amplitude [√kg m].")
    nodal_diameter: Annotated[int, Field(strict=True, ge=-10_000, le=10_000)] | None = Field(
        default=None, description="Of a disk, negative for a backward wave; that of the engine order."
    )
    performance: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Resonance peaks over excitation and load too, from the one mode."
    )
    aero_damping: Annotated[Number, Field(ge=-10.0, le=10.0)] | None = Field(
        default=None, description="Aerodynamic damping ratio, below 0 if it feeds: the limit cycles too."
    )
    mode_alone: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="With `aero_damping`: the gas feeds this mode alone, not every one."
    )
    motions: Annotated[bool, Field(strict=True)] = Field(
        default=False, description=f"Loops and shapes of up to {MOST_POINTS} points too."
    )
    exact_peaks: Annotated[int, Field(strict=True, ge=0, le=MOST_PEAKS)] = Field(
        default=0, description="With `performance`: of so many excitations the whole response as well."
    )
    disturbance: PositiveNumber | None = Field(
        default=None, description="Modal amplitude [√kg m] that is to die down: the least loads that do it."
    )
    phase_resonance: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        description="In place of the mode the forced responses that lag by 90°: which force each takes.",
    )


class _AmplitudeCurve(EndedResult):
    """A curve over the modal amplitude, and what the contacts do along it."""

    scene: str
    mode: int
    amplitude: Curve
    frequency: Curve
    dof: str
    max_abs: Curve
    contacts: list[str]
    states: list[list[str]]
    seconds: float


class PhaseResonanceResult(_AmplitudeCurve):
    """Frequency and force of phase resonance over the amplitude."""

    excitation: Curve


class NonlinearModeResult(_AmplitudeCurve):
    """Frequency and damping ratio over the amplitude."""

    nodal_diameter: int | None
    damping_ratio: Curve
    frequency_error: Curve
    damping_error: Curve
    n_harmonics: int
    newton_iterations: int
    rejected_steps: int
    performance: Table | None = None
    limit_cycles: Table | None = None
    motions: Table | None = None


class ModesResult(RootModel[NonlinearModeResult | PhaseResonanceResult]):
    """A nonlinear mode; with `phase_resonance` the forced responses."""


def resolve(request: ModesRequest, source: SceneSource) -> Resolved:
    """Look up the scene; check amplitudes, mode, nodal diameter and the size."""
    scene = resolve_scene(request, source)
    points = _POINTS + POINTS_OF_A_SWEEP * request.exact_peaks
    require(_issues(request, scene) or balance_issues("/harmonics", scene, request.harmonics, points))
    return resolved(
        scene,
        mode=request.mode,
        start=request.from_,
        stop=request.to,
        nodal_diameter=request.nodal_diameter,
        harmonics=request.harmonics,
        performance=request.performance,
        aero_damping=request.aero_damping,
        mode_alone=request.mode_alone,
        motions=request.motions,
        exact_peaks=request.exact_peaks,
        disturbance=request.disturbance,
        phase_resonance=request.phase_resonance,
    )


def _issues(request: ModesRequest, scene: Scene) -> list[Issue]:
    """Everything wrong with the mode for the scene."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode

    issues: list[Issue] = []
    if request.exact_peaks and not request.performance:
        words = f"`exact_peaks` needs `performance`, which is false here, got {request.exact_peaks!r}"
        issues.append(refusal("/exact_peaks", words))
    if request.from_ >= request.to:
        words = f"`to` must be above `from` = {request.from_!r} √kg m, got {request.to!r}"
        issues.append(refusal("/to", words))
    if request.harmonics < 1:
        issues.append(refusal("/harmonics", f"`harmonics` must be from 1, got {request.harmonics!r}"))
    issues += _of_questions(request)
    try:
        check_mode(at_nodal_diameter(scene, request.nodal_diameter), request.mode)
    except SettingError as error:
        issues.append(refusal(pointer(error.name), str(error)))
    return issues


def _of_questions(request: ModesRequest) -> list[Issue]:
    """Questions that do not go together."""
    issues = []
    if request.disturbance is not None and request.aero_damping is None:
        words = "`disturbance` needs `aero_damping`: without gas that feeds, every disturbance dies down"
        issues.append(refusal("/disturbance", words))
    if request.mode_alone and request.aero_damping is None:
        words = "`mode_alone` needs `aero_damping`: it says what the gas feeds"
        issues.append(refusal("/mode_alone", words))
    if request.phase_resonance and (request.performance or request.aero_damping is not None):
        words = "`phase_resonance` is a curve of its own: leave `performance` and `aero_damping` out"
        issues.append(refusal("/phase_resonance", words))
    return issues


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the mode, or the phase resonances."""
    if spec["phase_resonance"]:
        return _resonance(spec, progress, should_stop)
    scene = Scene.from_dict(spec["scene"])
    checked = spec["exact_peaks"]
    found = solver.nonlinear_mode(
        scene,
        spec["mode"],
        amplitudes=(spec["start"], spec["stop"]),
        nodal_diameter=spec["nodal_diameter"],
        harmonics=spec["harmonics"],
        on_progress=part_of(progress, 0.0, _OF_THE_CURVE if checked else 1.0),
        should_stop=should_stop,
    )
    answer = found.to_json()
    if spec["performance"]:
        curve = solver.performance_curve(found)
        answer["performance"] = curve.to_json()
        if checked:
            factors = excitations(curve, scene.observe.band, checked)
            rest = part_of(progress, _OF_THE_CURVE, 1.0, len(found.amplitude))
            exact = exact_peaks(found.scene, factors, spec["harmonics"], rest, should_stop)
            answer["performance"]["exact"] = exact
    if spec["aero_damping"] is not None:
        cycles = solver.limit_cycles(found, spec["aero_damping"], mode_alone=spec.get("mode_alone", False))
        answer["limit_cycles"] = cycles.to_json(spec["disturbance"])
    if spec["motions"]:
        answer["motions"] = motions_of(found)
    return JobOutput(result=answer, shortfall=None if found.completed else found.status.value)


def _resonance(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the phase resonances."""
    found = solver.phase_resonance(
        Scene.from_dict(spec["scene"]),
        spec["mode"],
        amplitudes=(spec["start"], spec["stop"]),
        nodal_diameter=spec["nodal_diameter"],
        harmonics=spec["harmonics"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput(result=found.to_json(), shortfall=None if found.completed else found.status.value)


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """Frequency and damping ratio over the amplitude, or frequency and force of phase resonances."""
    from solver.views.plots.modes import mode_figure, resonance_figure

    if not result["amplitude"]:
        raise NothingToDrawError("no point of the mode was found")
    return mode_figure(result) if result.get("damping_ratio") is not None else resonance_figure(result)


MODES = JobKind(
    name="modes",
    summary="Frequency and damping ratio of a mode over its amplitude.",
    request=ModesRequest,
    resolve=resolve,
    run=run,
    result=ModesResult,
    view=KindView(
        result="frequency and damping ratio over the amplitude ([modes](modes.md))",
        flags={"aero_damping": "--aero"},
        draw=draw,
    ),
)
