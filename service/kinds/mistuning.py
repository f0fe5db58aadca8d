"""The kind `mistuning`: the blades of many disks that are not quite equal, against the tuned disk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, ConfigDict, Field, WithJsonSchema

import solver
from service.jobs import JobKind, JobOutput, Progress, Resolved, SceneSource, ShouldStop
from service.kinds.problem import Name
from service.kinds.records import sweep_records
from service.kinds.scenes import FrequencyHz, HarmonicRequest, refusal, require, resolve_scene, resolved
from service.kinds.sizes import POINTS_OF_A_SWEEP, size_issues, whole_disk_dofs
from service.strict_json import pointer
from solver.errors import Issue, SceneError, SettingError
from solver.scene import CyclicStructure, Scene

_EXAMPLE: dict[str, Any] = {
    "scene": "bladed-disk",
    "of": ["tip_middle", "tip"],
    "spread": 0.02,
    "samples": 100,
    "seed": 1,
    "harmonics": 5,
}
_MOST_SAMPLES = 10_000
_MOST_PARTS = 100


def _listed(value: object) -> object:
    """A part alone is a list of one."""
    return [value] if isinstance(value, str) else value


_Part = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,100}$")]
Parts = Annotated[
    list[_Part],
    Field(min_length=1, max_length=_MOST_PARTS),
    BeforeValidator(_listed),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string"},
                {"type": "array", "items": {"type": "string"}, "minItems": 1, "maxItems": _MOST_PARTS},
            ]
        }
    ),
]


class MistuningRequest(HarmonicRequest):
    """A study of mistuned disks, in the words of the command.

    Attributes
    ----------
    of : str or list
        The parts that have factors: springs, dashpots and masses by name, or DOFs.
    spread : float
        Standard deviation of the factors.
    samples : int
        How many disks.
    seed : int
        Of the first disk; those of the others follow.
    dof : str or None
        DOF of one sector whose amplitude counts.
    from_, to : float or None
        Frequencies [Hz] (`from` in the body).
    """

    model_config = ConfigDict(validate_by_alias=True, json_schema_extra={"examples": [_EXAMPLE]})

    of: Parts = Field(description="Springs (k), dashpots (c) and masses by name, or DOFs (their mass).")
    spread: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] = Field(
        default=0.02, description="Standard deviation of the factors 1 + spread z, z normal."
    )
    samples: Annotated[int, Field(strict=True, ge=1, le=_MOST_SAMPLES)] = Field(
        default=100, description="How many disks."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**53)] = Field(
        default=1, description="Of the first disk; disk k has the seed of the first plus k."
    )
    dof: Name | None = Field(
        default=None, description="DOF of one sector whose amplitude counts; the observed one."
    )
    from_: FrequencyHz | None = Field(
        default=None, alias="from", description="Lowest frequency [Hz]; the scene's band."
    )
    to: FrequencyHz | None = Field(default=None, description="Highest frequency [Hz]; the scene's band.")


def resolve(request: MistuningRequest, source: SceneSource) -> Resolved:
    """Look up the scene, fill in the range, draw all factors to see that they can be had."""
    scene = resolve_scene(request, source)
    start = scene.observe.band[0] if request.from_ is None else request.from_
    stop = scene.observe.band[1] if request.to is None else request.to
    require(_issues(request, scene, start, stop))
    return resolved(
        scene,
        of=request.of,
        spread=request.spread,
        samples=request.samples,
        seed=request.seed,
        dof=request.dof,
        start=start,
        stop=stop,
        harmonics=request.harmonics,
    )


def _issues(request: MistuningRequest, scene: Scene, start: float, stop: float) -> list[Issue]:
    """Everything wrong with the study for the scene."""
    structure = scene.structure
    if not isinstance(structure, CyclicStructure):
        message = f"`scene` {scene.name!r} must have a cyclic structure to be mistuned"
        return [refusal("/scene", message)]
    sweeps = POINTS_OF_A_SWEEP * request.samples * structure.sectors
    words = "points of all sweeps"
    issues = size_issues("/samples", words, sweeps, request.harmonics, whole_disk_dofs(scene))
    # Drawn only if there are not too many.
    issues = issues or _factor_issues(request, scene)
    if request.dof is not None and request.dof not in structure.dofs:
        known = ", ".join(structure.dofs)
        issues.append(
            refusal("/dof", f"`dof` must be a DOF of every sector, one of {known}, got {request.dof!r}")
        )
    if start >= stop:
        issues.append(refusal("/to", f"`to` must be above `from` = {start!r} Hz, got {stop!r}"))
    return issues


def _factor_issues(request: MistuningRequest, scene: Scene) -> list[Issue]:
    """Refuse parts that are not there, and factors that are not above 0."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from solver.mistuned_disks import disk_factors

    try:
        disk_factors(scene, request.of, request.spread, request.samples, request.seed)
    except SceneError as error:
        prefix = "/structure/mistuning/of"
        within = [issue for issue in error.issues if issue.pointer.startswith(prefix)]
        known = [refusal("/of" + issue.pointer.removeprefix(prefix), issue.message) for issue in within]
        return known or [refusal("/of", issue.message) for issue in error.issues]
    except SettingError as error:
        return [refusal(pointer(error.name), str(error))]
    return []


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Compute all disks; the stored sweeps are those of the tuned disk and of the worst blade of all."""
    study = solver.mistuning_study(
        Scene.from_dict(spec["scene"]),
        of=spec["of"],
        spread=spec["spread"],
        samples=spec["samples"],
        seed=spec["seed"],
        dof=spec["dof"],
        start=spec["start"],
        stop=spec["stop"],
        harmonics=spec["harmonics"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput(
        result=study.to_json(),
        sweeps=sweep_records(study.branches),
        shortfall=None if study.completed else study.status.value,
    )


MISTUNING = JobKind(
    name="mistuning",
    summary="The blades of many mistuned disks against the tuned one.",
    request=MistuningRequest,
    resolve=resolve,
    run=run,
)
