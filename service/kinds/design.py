"""The kind `design`: the best damper of a scene, of what is known or in spite of what is not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

import optim
from service.jobs import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from service.kinds.problem import ProblemRequest, arguments
from service.kinds.problem_check import problem_issues, uncertainty_issues
from service.kinds.records import design_record, robust_record, sweep_record
from service.kinds.scenes import refusal, require, resolve_scene, resolved
from service.kinds.uncertain import Uncertain
from service.strict_json import pointer
from solver.errors import Issue
from solver.scene import Scene

UNCERTAIN = "uncertain"
_NOT_ROBUST = ("basins",)
ROBUST = (UNCERTAIN, "aim", "quantile", "samples", "seed")


class DesignRequest(ProblemRequest):
    """A design problem, in the words of `optim.design`, or with `uncertain` of `optim.robust_design`.

    Attributes
    ----------
    uncertain : dict, list or None
        What is not known.
    aim : str or None
        What is minimised over it: ``worst-case``, ``mean`` or ``quantile``.
    quantile : float or None
        The share of the samples, for the aim of that name.
    samples, seed : int or None
        How many scenarios are drawn, and the seed of the random numbers.
    """

    uncertain: Uncertain | None = Field(
        default=None,
        description="What is not known: a table of intervals, a table of an ellipsoid, or a list of samples.",
        examples=[{"damper.mu": [0.2, 0.4], "damper.kt": {"deviation": 0.1}}],
    )
    aim: Literal["worst-case", "mean", "quantile"] | None = Field(
        default=None, description="What is minimised over the uncertainty; worst-case."
    )
    quantile: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] | None = Field(
        default=None, description="Share of the samples that the aim `quantile` minimises; 0.95."
    )
    samples: Annotated[int, Field(strict=True, ge=2, le=10_000)] | None = Field(
        default=None, description="Scenarios drawn; 32 of a worst case, else 64."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] | None = Field(
        default=None, description="Of the random numbers; 0."
    )


def resolve(request: DesignRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check the problem, fill in the variables."""
    scene = resolve_scene(request, source)
    given = arguments(request)
    require(design_issues(scene, given))
    return resolved(scene, **given, **default_variables(scene, given))


def design_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """Everything wrong with the arguments of a design, robust or not."""
    known = {key: value for key, value in given.items() if key not in ROBUST}
    issues = problem_issues(scene, known)
    if UNCERTAIN in given:
        issues += [
            refusal(
                pointer(key), f"`{key}` is for a design without `uncertain` parameters, got {given[key]!r}"
            )
            for key in _NOT_ROBUST
            if key in given
        ]
        return issues + uncertainty_issues(scene, known, given[UNCERTAIN])
    alone = [key for key in ROBUST if key in given]
    return issues + [
        refusal(pointer(key), f"`{key}` is for a design with `uncertain` parameters, got {given[key]!r}")
        for key in alone
    ]


def default_variables(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    """The variables that stand for none, so that a spec says what is chosen."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.variables import check_variables

    if "variables" in given:
        return {}
    return {"variables": {v.name: [v.low, v.high] for v in check_variables(scene, None)}}


def problem_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of the design layer in a spec; those of an older version name what was not given too."""
    return {key: value for key, value in spec.items() if key != "scene" and value is not None}


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Search."""
    scene, given = Scene.from_dict(spec["scene"]), problem_of(spec)
    if UNCERTAIN in given:
        return _run_robust(scene, given, progress, should_stop)
    found = optim.design(scene, **given, on_progress=progress, should_stop=should_stop)
    return JobOutput(
        result=found.to_json(),
        sweeps=tuple(sweep_record(branch) for branch in found.sweeps if len(branch.values)),
        design=design_record(found),
        shortfall=None if found.reached else found.status.value,
    )


def _run_robust(
    scene: Scene, given: Mapping[str, Any], progress: Progress, should_stop: ShouldStop
) -> JobOutput:
    """Search over the uncertainty; the stored sweeps are those of the search without it."""
    found = optim.robust_design(scene, **given, on_progress=progress, should_stop=should_stop)
    return JobOutput(
        result=found.to_json(),
        sweeps=tuple(sweep_record(branch) for branch in found.design.sweeps if len(branch.values)),
        design=robust_record(found),
        shortfall=None if found.reached else found.status.value,
    )


DESIGN = JobKind(
    name="design",
    summary="The best damper of a scene.",
    request=DesignRequest,
    resolve=resolve,
    run=run,
)
