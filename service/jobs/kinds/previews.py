"""Previews: small responses answered at once and never stored, for people who move sliders.

A preview is a kind like those of jobs, with limits that keep it within a blink.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import ConfigDict, Field

import solver
from optim.results.studies_result import ParameterSensitivity, SensitivityResult
from service.jobs.common.periods import Period, period_of
from service.jobs.common.result_models import KindResult, PeakAt, result_model
from service.jobs.common.scene_requests import (
    FrequencyHz,
    PositiveNumber,
    linear_limit,
    require,
    resolved,
    stored_scene,
)
from service.jobs.common.sizes import POINTS_OF_A_SWEEP
from service.jobs.kind_registry import JobKind, Registry, Resolved, SceneSource
from service.jobs.kinds.preview_request import (
    POINT_UNKNOWNS,
    PreviewRequest,
    harmonics_in_time,
    scene_of,
)
from service.jobs.kinds.shape_preview import (
    ShapePreview,
    ShapePreviewRequest,
    resolve_shape,
    run_shape,
)
from service.jobs.outputs import JobOutput, Progress, ShouldStop, Silent
from service.jobs.studies.solve_study import solve_result
from solver.continuation.branch import AnyBranch, PeakCertificate
from solver.errors import Issue
from solver.jit.beside import interpret
from solver.scene.descriptions import DAMPER_LOAD
from solver.scene.scene import Scene

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
        "scene": scene.to_dict(),
        "harmonics": 3,
        "limit": None,
        "contact": None,
        "frequency_hz": 1.05,
        "mode": None,
        "motion": None,
        "nodal_diameter": None,
    }
    for run in runs:
        run(spec, Silent(), nothing)


PREVIEWS = Registry(
    [
        JobKind(
            name="sweep", summary="The frequency response over the scene's band.",
            request=SweepPreviewRequest, resolve=resolve_sweep, run=run_sweep,
            result=SweepPreview,
        ),
        JobKind(
            name="sensitivities", summary="Per cent of peaks and band for one per cent of each parameter.",
            request=SensitivitiesPreviewRequest, resolve=resolve_sweep, run=run_sensitivities,
            result=SensitivitiesPreview,
        ),
        JobKind(
            name="limits", summary="The linear responses with a contact removed and stuck.",
            request=LimitsPreviewRequest, resolve=resolve_limits, run=run_limits,
            result=LimitsPreview,
        ),
        JobKind(
            name="point", summary="One period at a frequency, with loops and states of the contacts.",
            request=PointPreviewRequest, resolve=resolve_point, run=run_point,
            result=PointPreview,
        ),
        JobKind(
            name="shape", summary="How everything moves over a period, at a frequency or in a mode.",
            request=ShapePreviewRequest, resolve=resolve_shape, run=run_shape,
            result=ShapePreview,
        ),
    ],
    warm_up,
)  # fmt: skip
