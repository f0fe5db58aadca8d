"""The kind `accuracy`: what accuracy costs, error against time of one point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.records import sweep_records
from service.jobs.common.results import Amplitude, EndedResult, Table
from service.jobs.common.scenes import (
    FrequencyHz,
    Harmonics,
    SceneRequest,
    check,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import pointer
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EXAMPLE: dict[str, Any] = {"scene": "two-dof", "frequency_hz": 1.2, "harmonics": [1, 3, 7], "samples": [64]}
_MOST_WAYS = 30
_MOST_SAMPLES = 65536
_MOST_SAMPLED = 50_000_000
_Samples = Annotated[int, Field(strict=True, ge=4, le=_MOST_SAMPLES)]


class AccuracyRequest(SceneRequest):
    """A study of one point.

    Attributes
    ----------
    frequency_hz : float or None
        Excitation frequency [Hz]; the highest peak of the scene's band if left out.
    harmonics : list or None
        Highest harmonics to try.
    samples : list or None
        Samples of a period to try with each.
    repeats : int or None
        Of each timing.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    frequency_hz: FrequencyHz | None = Field(
        default=None, description="Excitation frequency [Hz]; the highest peak of the scene's band."
    )
    harmonics: Annotated[list[Harmonics], Field(min_length=1, max_length=_MOST_WAYS)] | None = Field(
        default=None, description="Highest harmonics to try; nine numbers from 1 to 41."
    )
    samples: Annotated[list[_Samples], Field(max_length=_MOST_WAYS)] | None = Field(
        default=None, description="Samples of a period to try with each, multiples of 4; 64 to 8192."
    )
    repeats: Annotated[int, Field(strict=True, ge=1, le=1000)] | None = Field(
        default=None, description="Of each timing; 15."
    )


class AccuracyResult(EndedResult):
    """Error and time of every way to compute one point."""

    scene: str
    frequency_hz: float
    reference: float | None
    reference_harmonics: int
    reference_error: Amplitude
    rows: list[Table]


def resolve(request: AccuracyRequest, source: SceneSource) -> Resolved:
    """Look up the scene, fill in the ways to compute, check them."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from solver.studies.convergence import HARMONICS, REPEATS, SAMPLES, check_samples

    scene = resolve_scene(request, source)
    harmonics = list(HARMONICS) if request.harmonics is None else request.harmonics
    samples = list(SAMPLES) if request.samples is None else request.samples
    repeats = REPEATS if request.repeats is None else request.repeats
    issues = [
        issue
        for i, count in enumerate(samples)
        for issue in check(pointer("samples", i), partial(check_samples, count))
    ]
    sampled = repeats * len(harmonics) * sum([max(harmonics), *samples])
    if sampled > _MOST_SAMPLED:
        words = "repetitions × numbers of harmonics × samples"
        issues.append(refusal("/repeats", f"{words} must be at most {_MOST_SAMPLED}, got {sampled}"))
    require(issues)
    return resolved(
        scene, frequency_hz=request.frequency_hz, harmonics=harmonics, samples=samples, repeats=repeats
    )


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Measure; the stored sweep is the one that found the peak, if one did."""
    study = solver.accuracy_study(
        Scene.from_dict(spec["scene"]),
        spec["frequency_hz"],
        harmonics=spec["harmonics"],
        samples=spec["samples"],
        repeats=spec["repeats"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput.of(
        study,
        reached=study.completed,
        sweeps=() if study.branch is None else sweep_records([study.branch], intermediate=True),
    )


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """Error against time."""
    from solver.views.plots.accuracy import accuracy_figure

    if not result["rows"]:
        raise NothingToDrawError("it has no rows")
    return accuracy_figure(result)


ACCURACY = JobKind(
    name="accuracy",
    summary="What accuracy costs: error against time of one point.",
    request=AccuracyRequest,
    resolve=resolve,
    run=run,
    result=AccuracyResult,
    view=KindView(
        result="error against time ([accuracy](accuracy.md))",
        sweeps="the one that found the peak",
        keys="`frequency_hz`, `harmonics` and `samples` (lists of what is tried), `repeats`",
        flags={"frequency_hz": "--frequency"},
        draw=draw,
    ),
)
