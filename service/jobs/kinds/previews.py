"""Previews: small responses answered at once and never stored, for people who move sliders.

A preview is a kind like those of jobs, with limits that keep it within a blink.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

import solver
from optim.results.studies_result import ParameterSensitivity, SensitivityResult
from service.jobs.common.periods import Period, period_of
from service.jobs.common.result_models import KindResult, PeakAt, result_model
from service.jobs.common.scene_requests import (
    FrequencyHz,
    HarmonicRequest,
    Number,
    PositiveNumber,
    check,
    linear_limit,
    require,
    resolve_scene,
    resolved,
    stored_scene,
)
from service.jobs.common.sizes import (
    POINTS_OF_A_SWEEP,
    balance_issues,
    coefficients,
    contact_motions,
    dofs_solved,
)
from service.jobs.kind_registry import JobKind, Registry, Resolved, SceneSource
from service.jobs.outputs import JobOutput, Progress, ShouldStop, Silent
from service.jobs.studies.modes_study import Diameter
from service.jobs.studies.solve_study import solve_result
from solver.continuation.branch import AnyBranch, PeakCertificate
from solver.errors import Issue, Naming
from solver.jit.compiler_process import interpret
from solver.scene.descriptions import DAMPER_LOAD
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from solver.views.shapes import Shape


MOST_HARMONICS = 41
MOST_UNKNOWNS = 50_000
POINT_UNKNOWNS = 500
"""Of the balance at one point."""
FEW_MOTIONS = 8
"""Of contacts: so few are quick with all harmonics."""


class PreviewRequest(HarmonicRequest):
    """What every preview takes; `client` names who asks: of its previews only the newest is computed."""

    client: str = Field(
        default="", max_length=64, description="Who asks: of its previews only the newest is computed."
    )


def scene_of(request: PreviewRequest, source: SceneSource, points: int, harmonics: int) -> Scene:
    """The scene, if it is small enough for so many points."""
    scene = resolve_scene(request, source)
    issues: list[Issue] = []
    if request.harmonics > MOST_HARMONICS:
        issues.append(
            Issue(("harmonics",), f"of a preview must be at most {MOST_HARMONICS}", request.harmonics)
        )
    unknowns = dofs_solved(scene) * (2 * request.harmonics + 1)
    if unknowns > MOST_UNKNOWNS:
        words = "DOFs × coefficients of a preview"
        issues.append(
            Issue(
                ("scene",),
                f"{words} must be at most {MOST_UNKNOWNS}, got {unknowns}: submit a job",
                named=False,
            )
        )
    require(issues or balance_issues("harmonics", scene, harmonics, points))
    return scene


def harmonics_in_time(scene: Scene, asked: int, unknowns: int) -> int:
    """The harmonics asked for; with many contacts those whose balance has at most so many unknowns.

    A disk that is solved whole has the contacts of all its sectors: too many to be followed live with all
    harmonics.
    """
    motions = contact_motions(scene)
    if motions <= FEW_MOTIONS:
        return asked
    return next((h for h in range(asked, 1, -1) if motions * coefficients(scene, h) <= unknowns), 1)


SHAPE_SAMPLES = 96
"""Of what a contact does over the period."""
DIGITS = 6
MOST_TOLD = 2000
Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Amplitudes = list[list[list[Point]]]


class ShapeContact(BaseModel):
    """A contact that is drawn, and what it does."""

    name: str
    point: int = Field(description="Number of its point.")
    states: list[str | None] = Field(description="Of each sector that was solved.")
    motions: list[list[int] | None] = Field(
        description="The same over one period: 0 stick, 1 slip, 2 separation; null where it is not known."
    )


class DrawnShape(BaseModel):
    """Points at rest, what is drawn between them, and how they move.

    Point p of sector j is at R_j (x_p + Re Σ_k U_kp e^{ik(τ + j turn)}), where R_j turns about the axis by
    that many of the sectors. Where every sector was solved each has motions of its own.
    """

    frequency_hz: float
    unit: str = Field(description="Of the motions: m, or 1/√kg of a linear mode.")
    nodal_diameter: int | None
    sectors: int
    axis: Point
    turn: float = Field(description="Phase of harmonic 1 from a sector to the next [rad].")
    to_scale: bool = Field(description="Whether the scene tells the places; they are of unit size else.")
    points: list[Point] = Field(description="At rest [m].")
    names: list[str]
    roles: list[str] = Field(description="mesh, node, mass, body, contact or ground.")
    edges: list[tuple[int, int]] = Field(description="Lines between points.")
    ahead: list[tuple[int, int]] = Field(description="Lines to points of the next sector.")
    faces: list[tuple[int, int, int]]
    harmonics: list[int] = Field(description="Those that move something.")
    real: Amplitudes = Field(description="Sector × harmonic × point × direction.")
    imag: Amplitudes
    amplitude: list[list[float]] = Field(description="Largest motion about the mean, sector × point.")
    contacts: list[ShapeContact]
    notes: list[str] = Field(description="What is not drawn, and why.")


class ShapePreview(KindResult):
    """How everything moves over a period."""

    reached: bool
    status: str = Field(description="How it ended, and what to try if it fell short.")
    shape: DrawnShape | None


class ShapeMotion(BaseModel):
    """Harmonic 1 of every DOF over the amplitude of a nonlinear mode, as `motions` of its result has it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    dofs: Annotated[list[str], Field(min_length=1, max_length=MOST_TOLD)]
    real: Annotated[list[Number], Field(max_length=MOST_TOLD, description="[1/√kg].")]
    imag: Annotated[list[Number], Field(max_length=MOST_TOLD, description="[1/√kg].")]
    frequency_hz: FrequencyHz
    states: Annotated[dict[str, str], Field(max_length=MOST_TOLD)] = Field(
        default={}, description="What contacts do."
    )


class ShapePreviewRequest(PreviewRequest):
    """The deflection at `frequency_hz`; or a linear `mode`; or the `motion` that a result has of one."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"scene": "two-dof", "frequency_hz": 1.05},
                {"scene": "bladed-disk", "mode": 1, "nodal_diameter": 2},
            ]
        }
    )

    frequency_hz: FrequencyHz | None = Field(default=None, description="Excitation frequency [Hz].")
    mode: Annotated[int, Field(strict=True, ge=1, le=100_000)] | None = Field(
        default=None, description="In place of it: which mode, 1 the slowest, contacts as they are at rest."
    )
    motion: ShapeMotion | None = Field(
        default=None, description="In place of both: what a nonlinear mode does at a point of its curve."
    )
    nodal_diameter: Diameter | None = Field(
        default=None, description="Of a mode of a disk; that of the engine order if left out."
    )


def resolve_shape(request: ShapePreviewRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check its size and what is asked, and choose the harmonics that can be kept."""
    if sum(each is not None for each in (request.frequency_hz, request.mode, request.motion)) != 1:
        named = Naming("must be given, or {mode} or {motion} in its place; one of them")
        require([Issue(("frequency_hz",), named, request.frequency_hz)])
    if request.frequency_hz is not None and request.nodal_diameter is not None:
        require([Issue(("nodal_diameter",), Naming("needs {mode} or {motion}"), request.nodal_diameter)])
    scene = scene_of(request, source, 1, request.harmonics)
    if request.mode is not None:
        from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode

        mode = request.mode
        require(check(lambda: check_mode(at_nodal_diameter(scene, request.nodal_diameter), mode)))
    motion = request.motion
    if motion is not None and not len(motion.dofs) == len(motion.real) == len(motion.imag):
        wanted = f"must have as many numbers in `real` and `imag` as `dofs` has names, {len(motion.dofs)}"
        require([Issue(("motion",), wanted, f"{len(motion.real)} and {len(motion.imag)}")])
    kept = harmonics_in_time(scene, request.harmonics, POINT_UNKNOWNS)
    given = request.model_dump(include={"frequency_hz", "mode", "motion", "nodal_diameter"})
    return resolved(scene, harmonics=kept, **given)


def run_shape(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Solve at the frequency, or find the mode, and tell how everything moves."""
    import numpy as np

    import solver
    from solver.views.shapes import deflection_shape, mode_shape, shape_of_motion

    scene, over, diameter = stored_scene(spec), dict[str, Any](), spec["nodal_diameter"]
    if (told := spec["motion"]) is not None:
        motion = np.array(told["real"]) + 1j * np.array(told["imag"])
        shape = shape_of_motion(scene, told["dofs"], motion, told["frequency_hz"], told["states"], diameter)
    elif spec["mode"] is not None:
        shape = mode_shape(scene, spec["mode"], nodal_diameter=diameter, harmonics=spec["harmonics"])
    else:
        solution = solver.solve(scene, frequency_hz=spec["frequency_hz"], harmonics=spec["harmonics"])
        if not solution.converged:
            status = solution.status.value
            return JobOutput(result={"reached": False, "status": status, "shape": None}, shortfall=status)
        shape = deflection_shape(scene, solution)
        over = {each["name"]: each["motion"] for each in period_of(solution, SHAPE_SAMPLES)["contacts"]}
    return JobOutput(result={"reached": True, "status": "It was found.", "shape": _told(scene, shape, over)})


def _told(scene: Scene, shape: Shape, over: Mapping[str, list[int] | None]) -> dict[str, Any]:
    """What is drawn, as JSON."""
    picture, count = shape.picture, len(shape.motions)

    def each(name: str) -> list[str]:
        return [name] if count == 1 else [f"{name}@{j}" for j in range(count)]

    return {
        "frequency_hz": shape.frequency_hz, "unit": shape.unit,
        "nodal_diameter": shape.nodal_diameter, "sectors": scene.structure.sector_count,
        "axis": list(picture.axis), "turn": shape.turn, "to_scale": picture.to_scale,
        "points": picture.points, "names": picture.names, "roles": picture.roles, "edges": picture.edges,
        "ahead": picture.ahead, "faces": picture.faces, "harmonics": shape.harmonics.tolist(),
        "real": _short(shape.motions.real), "imag": _short(shape.motions.imag),
        "amplitude": _short(shape.amplitude),
        "contacts": [
            {
                "name": name, "point": point,
                "states": [shape.states.get(one) for one in each(name)],
                "motions": [over.get(one) for one in each(name)],
            }
            for name, point in picture.contacts.items()
        ],
        "notes": picture.notes,
    }  # fmt: skip


def _short(values: Any) -> Any:
    """Numbers to so many digits of the largest: enough for a drawing."""
    import numpy as np

    largest = float(np.abs(values).max(initial=0.0))
    return np.round(values, DIGITS - math.floor(math.log10(largest)) if largest else 0).tolist()


MOST_POINTS = 2000
LIVE_UNKNOWNS = 130
"""Of the balance of a response that is followed live: one of more takes longer than a second or two."""
SAMPLES = 400
_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "set": {DAMPER_LOAD: 80}, "client": "a1b2"}


_OF_A_LIMIT = ("parameter", "amplitude", "peak", "peaks", "peak_certificate", "completed")
_OF_A_SWEEP = (
    *_OF_A_LIMIT, "band_hz", "band_limit", "band_intervals_hz", "points", "band_known", "error_estimate",
    "mean_undetermined", "unstable", "flags", "seconds", "status",
)  # fmt: skip
_OF_SENSITIVITIES = (
    "peaks", "band_hz", "limit", "left_out", "peak_certificate", "seconds", "reached", "status",
)  # fmt: skip
_CERTIFICATE: dict[str, Any] = {"peak_certificate": result_model(PeakCertificate, "PeakCertificate")}
_PEAKS: dict[str, Any] = {"peak": PeakAt | None, "peaks": list[PeakAt], **_CERTIFICATE}
_KEPT: Any = (int, Field(description="Kept; fewer than asked for where a whole disk takes too long."))
SweepPreview = result_model(
    AnyBranch, "SweepPreview", only=_OF_A_SWEEP, **_PEAKS, points=int,  # type: ignore[type-abstract]
    unstable=(list[list[int]], Field(description="First and last point of what is not stable.")),
    n_harmonics=_KEPT,
    states=(dict[str, str], Field(description="What every contact does at the highest peak.")),
)  # fmt: skip
LinearResponse: Any = result_model(
    AnyBranch, "LinearResponse", only=_OF_A_LIMIT, **_PEAKS,  # type: ignore[type-abstract]
)  # fmt: skip
ParameterEffect = result_model(
    ParameterSensitivity, "ParameterEffect", only=("path", "unit", "value"),
    peaks_percent=(list[float | None], Field(description="Of every competing peak, in their order [%].")),
    band_percent=(float | None, Field(description="Of the width of the resonance band [%].")),
)  # fmt: skip
SensitivitiesPreview = result_model(
    SensitivityResult, "SensitivitiesPreview", only=_OF_SENSITIVITIES, peaks=list[PeakAt], n_harmonics=_KEPT,
    **_CERTIFICATE,
    rows=(list[ParameterEffect], ...),  # type: ignore[valid-type]
)  # fmt: skip


class LimitsPreview(KindResult):
    """The linear responses between which friction works."""

    free: LinearResponse
    stuck: LinearResponse


class PointPreview(solve_result()):  # type: ignore[misc]
    """A periodic response at one frequency; `period` is left out if there is no solution."""

    period: Period | None = None


class SweepPreviewRequest(PreviewRequest):
    """The frequency response over the scene's band; `limit` is the amplitude [m] its band is measured at."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    limit: PositiveNumber | None = Field(
        default=None, description="Amplitude [m] above which the resonance band is measured."
    )


class SensitivitiesPreviewRequest(SweepPreviewRequest):
    """Per cent of peaks and band for one per cent of each parameter; `limit` is that of the band [m]."""


class LimitsPreviewRequest(PreviewRequest):
    """The linear responses between which friction works; `contact` is first removed, then stuck."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    contact: Annotated[str, Field(max_length=105)] | None = Field(
        default=None, description="The contact that is removed, the others stuck; all if left out."
    )


class PointPreviewRequest(PreviewRequest):
    """One period at `frequency_hz`: time history, loops and states of the contacts, harmonics."""

    model_config = ConfigDict(json_schema_extra={"examples": [{**_EXAMPLE, "frequency_hz": 1.05}]})

    frequency_hz: FrequencyHz = Field(description="Excitation frequency [Hz].")


def resolve_sweep(request: SweepPreviewRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check its size, and choose the harmonics that can be kept in time."""
    scene = scene_of(request, source, POINTS_OF_A_SWEEP, request.harmonics)
    kept = harmonics_in_time(scene, request.harmonics, LIVE_UNKNOWNS)
    return resolved(scene, harmonics=kept, limit=request.limit)


def resolve_limits(request: LimitsPreviewRequest, source: SceneSource) -> Resolved:
    """Look up the scene and the contact."""
    scene = scene_of(request, source, 2 * POINTS_OF_A_SWEEP, 1)
    if scene.dampers:
        words = "has dampers that move by themselves: leave them out with `stickslip sweep --without`"
        require([Issue(("scene",), words, scene.name)])
    names = [contact.name for contact in scene.contacts]
    if request.contact is not None and request.contact not in names:
        require([Issue(("contact",), f"must be one of {', '.join(names)}", request.contact)])
    return resolved(scene, harmonics=request.harmonics, contact=request.contact)


def resolve_point(request: PointPreviewRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check its size, and choose the harmonics that can be kept in time."""
    scene = scene_of(request, source, 1, request.harmonics)
    kept = harmonics_in_time(scene, request.harmonics, POINT_UNKNOWNS)
    return resolved(scene, harmonics=kept, frequency_hz=request.frequency_hz)


def run_sweep(spec: Mapping[str, Any], _progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the response over the band; with the state of every contact at the highest peak."""
    scene = stored_scene(spec)
    branch = _response(scene, spec["harmonics"], spec["limit"], should_stop)
    found = branch.to_json()
    result = {key: found[key] for key in _OF_A_SWEEP}
    result |= {"n_harmonics": spec["harmonics"], "states": {}}
    if len(branch.values):
        at = int(branch.amplitude.argmax())
        # Those of all sectors where one does not stand for them.
        names = [contact.name for contact in branch.scene.contacts]
        result["states"] = _states(names, branch.states[at].tolist())
    return JobOutput(result=result, shortfall=None if branch.reached else branch.status.value)


def run_sensitivities(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Differentiate the peaks and the band by every parameter of the scene."""
    import optim

    found = optim.sensitivities(stored_scene(spec), limit=spec["limit"], harmonics=spec["harmonics"])
    told = found.to_json()
    result = {key: told[key] for key in _OF_SENSITIVITIES} | {
        "rows": [{key: row[key] for key in ParameterEffect.model_fields} for row in told["rows"]],
        "n_harmonics": spec["harmonics"],
    }
    return JobOutput(result=result, shortfall=None if found.reached else found.status.value)


def run_limits(spec: Mapping[str, Any], _progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the response with the contact removed, and with it stuck."""
    scene = stored_scene(spec)
    result: dict[str, Any] = {}
    one = spec["contact"]
    freed = [contact.name for contact in scene.contacts] if one is None else [one]
    for name, removed in (("free", freed), ("stuck", [])):
        found = _response(linear_limit(scene, removed), 1, None, should_stop).to_json()
        result[name] = {key: found[key] for key in _OF_A_LIMIT}
    return JobOutput(result=result)


def run_point(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Solve the balance, and look at one period of it."""
    solution = solver.solve(
        stored_scene(spec), frequency_hz=spec["frequency_hz"], harmonics=spec["harmonics"]
    )
    result = solution.to_json()
    if solution.converged:
        result["period"] = period_of(solution, SAMPLES)
    return JobOutput(result=result, shortfall=None if solution.converged else solution.status.value)


def _response(scene: Scene, harmonics: int, limit: float | None, should_stop: ShouldStop) -> solver.AnyBranch:
    low, high = scene.observe.band
    return solver.sweep(
        scene, start=low, stop=high, harmonics=harmonics, limit=limit, should_stop=should_stop,
        settings=solver.ContinuationSettings(most_points=MOST_POINTS),
    )  # fmt: skip


def _states(names: list[str], codes: list[int]) -> dict[str, str]:
    from solver.response.contact_response import state_of

    return {name: state_of(code).value for name, code in zip(names, codes, strict=True)}


def warm_up() -> None:
    """Load and compile what previews need; where nothing is compiled yet they are interpreted."""
    runs = (run_point,) if interpret() else (run_sweep, run_sensitivities, run_limits, run_point, run_shape)
    scene = solver.load_scene("two-dof")

    def nothing(*_: object) -> bool:
        return False

    spec = {
        "scene": scene.to_dict(), "harmonics": 3, "limit": None, "contact": None, "frequency_hz": 1.05,
        "mode": None, "motion": None, "nodal_diameter": None,
    }  # fmt: skip
    for run in runs:
        run(spec, Silent(), nothing)


PREVIEWS = Registry(
    [
        JobKind(
            name="sweep", summary="The frequency response over the scene's band.",
            request=SweepPreviewRequest, resolve=resolve_sweep, run=run_sweep, result=SweepPreview,
        ),
        JobKind(
            name="sensitivities", summary="Per cent of peaks and band for one per cent of each parameter.",
            request=SensitivitiesPreviewRequest, resolve=resolve_sweep, run=run_sensitivities,
            result=SensitivitiesPreview,
        ),
        JobKind(
            name="limits", summary="The linear responses with a contact removed and stuck.",
            request=LimitsPreviewRequest, resolve=resolve_limits, run=run_limits, result=LimitsPreview,
        ),
        JobKind(
            name="point", summary="One period at a frequency, with loops and states of the contacts.",
            request=PointPreviewRequest, resolve=resolve_point, run=run_point, result=PointPreview,
        ),
        JobKind(
            name="shape", summary="How everything moves over a period, at a frequency or in a mode.",
            request=ShapePreviewRequest, resolve=resolve_shape, run=run_shape, result=ShapePreview,
        ),
    ],
    warm_up,
)  # fmt: skip
