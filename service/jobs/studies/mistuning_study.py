"""The study `mistuning`: the blades of many disks that are not quite equal, against the tuned disk."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from optim.criteria.key import Name
from service.jobs.common.result_models import Table, answered
from service.jobs.common.scene_requests import FrequencyHz, HarmonicRequest, stored_scene
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import band_issues
from service.jobs.job_parts import Division, JobPart, PartOutput, PartStoppedError
from service.jobs.kind_registry import Flag, JobKind
from service.jobs.outputs import JobOutput, OnProgress, ShouldStop
from service.jobs.stored_figures import StoredArray
from service.jobs.study import NO_SECTORS, Answer, Proposed, Question, Study
from solver.errors import Issue, SceneError, SettingError
from solver.jit.timer import clock

if TYPE_CHECKING:
    from solver import BladePeaks
    from solver.scene.scene import Scene

_MOST_SAMPLES = 10_000
_QUICK_CONTACTS = 24  # of a whole disk; with more one response takes a minute
_MOST_NAMES = 100
_WORK_OF_A_PART = 4  # sectors × harmonics: 0.1 s, measured on bladed-disk
_MOST_DIVIDED = 256
_OF_THE_PEAKS = ("value", "at_hz")


def _listed(value: object) -> object:
    """A part alone is a list of one."""
    return [value] if isinstance(value, str) else value


_PartName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,100}$")]
PartNames = Annotated[
    list[_PartName],
    Field(min_length=1, max_length=_MOST_NAMES),
    BeforeValidator(_listed),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string"},
                {"type": "array", "items": {"type": "string"}, "minItems": 1, "maxItems": _MOST_NAMES},
            ]
        }
    ),
]


def disk_issues(scene: Scene, dof: str | None) -> list[Issue]:
    """Return why a scene is no disk, or that no sector has a DOF."""
    if not scene.structure.has_sectors:
        return [Issue(("scene",), f"{scene.name!r} must have a cyclic structure to be mistuned")]
    if dof is not None and dof not in scene.dofs:
        words = f"must be a DOF of every sector, one of {', '.join(scene.dofs)}, got {dof!r}"
        return [Issue(("dof",), words)]
    return []


def part_issues(attempt: Callable[[], object]) -> list[Issue]:
    """Return what is wrong if `attempt`, which mistunes a disk, does not go through."""
    try:
        attempt()
    except SceneError as error:
        of = ("structure", "mistuning", "of")
        within = [issue.at(*issue.subject[2:]) for issue in error.issues if issue.subject[:3] == of]
        return within or [issue.at("of") for issue in error.issues]
    except SettingError as error:
        return [error.issue]
    return []


def blades_differ(scene: Scene) -> Proposed | str:
    """Return what blades are assumed to be told apart by: the mass where the scene observes them."""
    from solver.studies.mistuning import disk_factors

    if not scene.structure.has_sectors:
        return NO_SECTORS
    wrong = part_issues(lambda: disk_factors(scene, [scene.observe.dof], 0.0, 1, 1))
    if wrong:
        return f"Nothing tells its blades apart: {wrong[0].message.removeprefix('`of`: ')}."
    return Proposed({"of": [scene.observe.dof]}, ("of",))


mistuning_result = answered(
    "solver.studies.study_results:MistuningStudy", "MistuningResult", dof=str, samples=list[Table],
    quantiles=list[Table], worst=Table | None,
)  # fmt: skip


class Mistuning(Study, HarmonicRequest):
    """Study disks whose blades are not quite equal.

    Of each disk the highest peak of every blade, and how much higher it is than that of the tuned disk.
    """

    EXAMPLES = ({
        "scene": "bladed-disk", "of": ["tip_middle", "tip"], "spread": 0.02, "samples": 100, "seed": 1,
        "harmonics": 5,
    },)  # fmt: skip
    NAME, FUNCTION, RESULT = "mistuning", "solver:mistuning_study", mistuning_result
    ASKS = Question("What do unequal blades do?", "engine", 1_000)
    TOLD = "solver.views.tables.disks:mistuning"
    SHOWS = "the magnification over many disks and the worst of them ([disks](disks.md))"
    SWEEPS, COUNTED = "the tuned disk's, and that of the worst blade", "disks"
    EMPTY = ("worst", "the peaks of no disk are known")
    FIGURE = "solver.views.plots.disks:mistuning_figure"

    of: Annotated[PartNames, Flag(metavar="NAME")] = Field(
        description="Springs (k), dashpots (c) and masses by name, or DOFs (their mass)."
    )
    spread: Annotated[float, Field(strict=True, ge=0.0, le=1.0), Flag(metavar="S")] = Field(
        default=0.02, description="Standard deviation of the factors 1 + spread z, z normal."
    )
    samples: Annotated[int, Field(strict=True, ge=1, le=_MOST_SAMPLES), Flag(metavar="N")] = Field(
        default=100, description="How many disks."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**53), Flag(metavar="N")] = Field(
        default=1, description="Of the first disk; disk k has the seed of the first plus k."
    )
    dof: Annotated[Name | None, Flag(metavar="DOF")] = Field(
        default=None, description="DOF of one sector whose amplitude counts; the observed one."
    )
    start: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="from", description="Lowest frequency [Hz]; the scene's band."
    )
    stop: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="to", description="Highest frequency [Hz]; the scene's band."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Return what the blades are told apart by; of a dear disk, few of them with few harmonics."""
        told, sectors = blades_differ(scene), scene.structure.sector_count
        if isinstance(told, str):
            return told
        few = {"samples": 20, "harmonics": 3} if sectors * len(scene.contacts) > _QUICK_CONTACTS else {}
        disks = cls.model_construct(None, **few).samples
        return told._replace(body={**told.body, **few}, times=disks * sectors)

    def issues(self, scene: Scene) -> list[Issue]:
        """Return why it is no disk, and what is wrong with DOF and range."""
        found = disk_issues(scene, self.dof)
        return found + band_issues(scene, self.start, self.stop) if scene.structure.has_sectors else found

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large; the factors are drawn if they are not too many, to see that they can."""
        points, words = (
            POINTS_OF_A_SWEEP * self.samples * scene.structure.sector_count,
            "points of all sweeps",
        )
        large = balance_issues("samples", scene, self.harmonics, points, words, every_sector=True)
        return large or self._drawn(scene)

    def _drawn(self, scene: Scene) -> list[Issue]:
        """Refuse parts that are not there, and factors that are not above 0."""
        from solver.studies.mistuning import disk_factors

        return part_issues(lambda: disk_factors(scene, self.of, self.spread, self.samples, self.seed))

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job, which is computed in parts."""
        return replace(super().as_kind(), run=PARTS.run, parts=PARTS)


def split(spec: Mapping[str, Any]) -> list[JobPart]:
    """The tuned disk, and then some of the others at a time."""
    sectors = stored_scene(spec).structure.sector_count
    a_disk, samples = sectors * max(spec["harmonics"], 1), spec["samples"]
    size = max(math.ceil(_WORK_OF_A_PART / a_disk), math.ceil(samples / _MOST_DIVIDED))
    return [JobPart(spec={"tuned": True})] + [
        JobPart(spec={"first": first, "last": min(first + size, samples)}, weight=min(size, samples - first))
        for first in range(0, samples, size)
    ]


def run_part(
    spec: Mapping[str, Any], part: Mapping[str, Any], progress: OnProgress, should_stop: ShouldStop
) -> PartOutput:
    """Find the peaks of all blades of the tuned disk, or of some others."""
    import numpy as np

    import solver
    from service.jobs.common.sweep_records import packed, sweep_records
    from solver.studies.mistuning import without_mistuning, worst_branch

    scene, begun = stored_scene(spec), clock()
    tuned = bool(part.get("tuned"))
    disks = range(1) if tuned else range(part["first"], part["last"])
    found: list[BladePeaks] = []
    worst: BladePeaks | None = None
    for done, k in enumerate(disks):

        def each(share: float, _blades: int, done: int = done) -> None:
            progress((done + share) / len(disks), done)

        peaks = solver.blade_peaks(
            without_mistuning(scene)
            if tuned
            else solver.mistuned(scene, of=spec["of"], spread=spec["spread"], seed=spec["seed"] + k),
            spec["start"],
            spec["stop"],
            dof=spec["dof"],
            harmonics=spec["harmonics"],
            every_branch=False,
            on_progress=each,
            should_stop=should_stop,
        )
        if should_stop():
            raise PartStoppedError
        found.append(replace(peaks, branches=()))
        if peaks.largest > (0.0 if worst is None else worst.largest):
            worst = peaks
    sweeps, arrays = packed(sweep_records(() if worst is None else worst_branch(worst)))
    arrays |= {
        key: StoredArray.of(np.array([getattr(peaks, key) for peaks in found])) for key in _OF_THE_PEAKS
    }
    status = [[each.name for each in peaks.status] for peaks in found]
    return PartOutput(
        result={
            "dof": found[0].dof, "measured": found[0].measured.to_json(), "status": status, "sweeps": sweeps,
            "known": [peaks.highest.to_json() for peaks in found],
            "largest": 0.0 if worst is None else worst.largest, "seconds": clock() - begun,
        },
        arrays=arrays, points=0 if tuned else len(found), final=tuned and worst is None,
    )  # fmt: skip


def join(spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
    """The study of all disks; the stored sweeps are those of the tuned disk and of the worst blade of all."""
    from service.jobs.common.sweep_records import unpacked
    from solver.studies.mistuning import joined_study

    parts = list(outputs.values())
    [tuned], others = _peaks(parts[0]), parts[1:]
    study = joined_study(
        stored_scene(spec), of=spec["of"], spread=spec["spread"], seed=spec["seed"],
        harmonics=spec["harmonics"], tuned=tuned,
        disks=[peaks for part in others for peaks in _peaks(part)],
        seconds=sum(part.result["seconds"] for part in parts),
    )  # fmt: skip
    # The first of those that are equally high.
    highest = max(others, key=lambda part: part.result["largest"], default=None)
    sweeps = [part for part in (parts[0], highest) if part is not None]
    records = [record for part in sweeps for record in unpacked(part.result["sweeps"], part.arrays)]
    return Mistuning.output(Answer.of(study), records)


def _peaks(part: PartOutput) -> list[BladePeaks]:
    """The peaks that a part found, a disk each."""
    import solver
    from solver.results.known import Known, Measured

    value, at_hz = (part.arrays[key].array() for key in _OF_THE_PEAKS)
    return [
        solver.BladePeaks(
            dof=part.result["dof"], value=value[i], at_hz=at_hz[i], branches=(),
            status=tuple(solver.BranchStatus[name] for name in names), highest=Known.from_json(known),
            measured=Measured.of_result(part.result),
        )
        for i, (names, known) in enumerate(zip(part.result["status"], part.result["known"], strict=True))
    ]  # fmt: skip


PARTS = Division(split=split, run_part=run_part, join=join)
