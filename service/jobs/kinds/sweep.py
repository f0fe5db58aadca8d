"""The kind `sweep`: a branch of periodic responses over one parameter."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.checkpoints import Checkpoints
from service.jobs.common.records import sweep_record
from service.jobs.common.results import Amplitude, Curve, EndedResult, PeakAt, Table
from service.jobs.common.scenes import (
    FrequencyHz,
    HarmonicRequest,
    Number,
    ParameterPath,
    PositiveNumber,
    check,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import KindView
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue, SettingError
from solver.scene.descriptions import DISK_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver import AnyBranch, Stretch

FREQUENCY, SPEED = "frequency", "speed"
_EXAMPLE: dict[str, Any] = {
    "scene": "bladed-disk",
    "from": 500,
    "to": 900,
    "set": {DISK_LOAD: 150},
}
_OVER_A_LOAD: dict[str, Any] = {
    "scene": "bladed-disk",
    "parameter": DISK_LOAD,
    "from": 20,
    "to": 300,
    "frequency_hz": 755,
}


class SweepRequest(HarmonicRequest):
    """A sweep, in the words of the command.

    Attributes
    ----------
    parameter : str
        Path of what is swept.
    from_, to : float or None
        Its range (`from` in the body), Hz for the frequency; the observed band if both are left out.
    frequency_hz : float or None
        Excitation frequency [Hz] of a sweep of another parameter.
    limit : float or None
        Amplitude [m] above which the resonance band is measured.
    multipliers : bool
        Floquet multipliers at every point (`stability` in the body).
    switched : bool
        Follow the branches that leave at branch points too (`branches` in the body).
    """

    model_config = ConfigDict(
        validate_by_alias=True, json_schema_extra={"examples": [_EXAMPLE, _OVER_A_LOAD]}
    )

    parameter: ParameterPath = Field(default=FREQUENCY, description="Path of what is swept.")
    from_: Number | None = Field(default=None, alias="from", description="Start of the range.")
    to: Number | None = Field(default=None, description="End of the range.")
    frequency_hz: FrequencyHz | None = Field(
        default=None, description="Excitation frequency [Hz] while another parameter is swept."
    )
    limit: PositiveNumber | None = Field(
        default=None, description="Amplitude [m] above which the resonance band is measured."
    )
    multipliers: bool = Field(
        default=False, alias="stability", strict=True, description="Floquet multipliers at every point."
    )
    switched: bool = Field(
        default=False, alias="branches", strict=True,
        description="Follow the branches that leave at branch points too.",
    )  # fmt: skip


class SweepResult(EndedResult):
    """A branch: its points, its peaks and its resonance band."""

    scene: str
    parameter: Curve
    parameter_path: str
    unit: str
    speed_rpm: Curve | None = Field(description="Speeds [1/min] of the points along an engine-order line.")
    amplitude: Curve
    half_peak_to_peak: Curve
    mean: Curve
    peak: PeakAt | None
    peaks: list[PeakAt]
    stable: str | None = Field(
        default=None, description="Whether the highest peak is stable: yes, no, not known."
    )
    stable_ground: str | None = Field(default=None, description="Why.")
    peaks_stable: list[str] = Field(default=[], description="The same word for each of `peaks`.")
    band_hz: float | None
    band_limit: Amplitude
    band_intervals_hz: list[list[float]] | None
    band_known: bool | None
    peak_certificate: Table
    points: int
    n_harmonics: int
    error_estimate: Amplitude
    newton_iterations: int
    rejected_steps: int
    folds: int
    unstable: list[list[int]] = Field(
        default=[], description="First and last point of every stretch that is not stable."
    )
    marks: list[dict[str, Any]] = Field(
        default=[], description="Folds, branch points and an early end, with the point each comes behind."
    )
    stability_known_by: str = Field(
        default="", description="uniqueness, determinant (real perturbations of the same period) or nothing."
    )
    branches: list[dict[str, Any]] | None = Field(
        default=None, description="At each branch point its tangents and the branches that leave there."
    )
    mean_undetermined: bool
    largest_residual: float | None
    seconds: float
    flags: list[str]
    drift_per_period: float | None = Field(
        default=None, description="How far a part that ratchets drifts in a period [m], if that is known."
    )


def resolve(request: SweepRequest, source: SceneSource) -> Resolved:
    """Look up the scene, fill in the range, check that the sweep makes sense."""
    scene = resolve_scene(request, source)
    start, stop = request.from_, request.to
    if request.parameter == SPEED and scene.speed_order is not None:  # the frequency in other units
        start, stop = (None if end is None else end * scene.speed_order / 60.0 for end in (start, stop))
        request = request.model_copy(update={"parameter": FREQUENCY})
    if request.parameter == FREQUENCY:
        start = scene.observe.band[0] if start is None else start
        stop = scene.observe.band[1] if stop is None else stop
    require(
        _issues(request, scene, start, stop)
        or balance_issues("/harmonics", scene, request.harmonics, POINTS_OF_A_SWEEP)
    )
    return resolved(
        scene,
        parameter=request.parameter,
        start=start,
        stop=stop,
        frequency_hz=request.frequency_hz,
        harmonics=request.harmonics,
        limit=request.limit,
        **({"stability": True} if request.multipliers else {}),
        **({"branches": True} if request.switched else {}),
    )


def _issues(request: SweepRequest, scene: Scene, start: float | None, stop: float | None) -> list[Issue]:
    path = request.parameter
    unknown = check("/parameter", partial(scene.check_path, path))
    if unknown:
        return unknown
    issues: list[Issue] = []
    for pointer, value in (("/from", start), ("/to", stop)):
        name = pointer.removeprefix("/")
        if value is None:
            issues.append(refusal(pointer, f"`{name}` is needed for a sweep of `{path}`"))
        elif path != FREQUENCY:
            issues += check(pointer, partial(scene.with_values, {path: value}))
        elif value <= 0.0:
            issues.append(refusal(pointer, f"`{name}` must be a frequency > 0 Hz, got {value!r}"))
    if start is not None and start == stop:
        issues.append(refusal("/to", f"`to` must differ from `from`, got {stop!r} for both"))
    if path == FREQUENCY and request.frequency_hz is not None:
        message = f"`frequency_hz` must be left out when the frequency is swept, got {request.frequency_hz!r}"
        issues.append(refusal("/frequency_hz", message))
    if path != FREQUENCY and request.frequency_hz is None:
        issues.append(refusal("/frequency_hz", f"`frequency_hz` is needed for a sweep of `{path}`"))
    return issues


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the branch."""
    return run_on(spec, progress, should_stop, Checkpoints.none())


def run_on(
    spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
) -> JobOutput:
    """Follow the branch, from where an earlier attempt got; keep what is new from time to time."""
    try:
        branch = _follow(spec, progress, should_stop, checkpoints)
    except SettingError as error:
        if error.name != "resume":
            raise
        checkpoints.begin_anew(str(error))
        branch = _follow(spec, progress, should_stop, checkpoints)
    found = branch.to_json()
    others: tuple[AnyBranch, ...] = ()
    if spec.get("stability"):
        found |= solver.bifurcations(branch, multipliers=True).of_a_branch()
    if spec.get("branches"):
        switched = solver.switch_branches(branch)
        found["branches"] = [each.to_json() for each in switched]
        others = tuple(other for each in switched for other in each.branches)
    return JobOutput(
        result=found,
        sweeps=tuple(
            sweep_record(each, spec["frequency_hz"]) for each in (branch, *others) if len(each.values)
        ),
        shortfall=None if branch.completed else branch.status.value,
    )


def _follow(
    spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
) -> AnyBranch:
    known = _beginning(checkpoints)
    part = len(known)
    fresh: list[Stretch] = []

    def keep() -> None:
        nonlocal part
        checkpoints.add(part, solver.joined(fresh).to_arrays())
        part += 1
        fresh.clear()

    def add(stretch: Stretch) -> None:
        fresh.append(stretch)
        if checkpoints.due():
            keep()

    branch = solver.sweep(
        Scene.from_dict(spec["scene"]),
        parameter=spec["parameter"],
        start=spec["start"],
        stop=spec["stop"],
        harmonics=spec["harmonics"],
        frequency_hz=spec["frequency_hz"],
        limit=spec["limit"],
        resume=solver.joined(known) if known else None,
        on_stretch=add,
        on_progress=progress,
        on_points=lambda values, amplitudes: progress.found(
            list(zip(values.tolist(), amplitudes.tolist(), strict=True))
        ),
        should_stop=should_stop,
    )
    if branch.status is solver.BranchStatus.STOPPED and fresh:
        keep()
    return branch


def _beginning(checkpoints: Checkpoints) -> list[Stretch]:
    """What earlier attempts found of the branch."""
    try:
        return [solver.Stretch.from_arrays(arrays) for _, arrays in sorted(checkpoints.found().items())]
    except (KeyError, ValueError, IndexError) as error:
        checkpoints.begin_anew(f"{type(error).__name__}: {error}")
        return []


SWEEP = JobKind(
    name="sweep",
    summary="A branch of periodic responses over one parameter.",
    request=SweepRequest,
    resolve=resolve,
    run=run,
    run_on=run_on,
    result=SweepResult,
    view=KindView(
        result="peaks, band, folds",
        sweeps="the branch",
        flags={"frequency_hz": "--frequency", "multipliers": "--stability", "switched": "--branches"},
    ),
)
