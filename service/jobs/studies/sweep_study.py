"""The study `sweep`: a branch of periodic responses over one parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.checkpoints import Checkpoints
from service.jobs.common.result_models import PeakAt, Table, answered
from service.jobs.common.scene_requests import (
    FrequencyHz,
    HarmonicRequest,
    Number,
    ParameterPath,
    PositiveNumber,
    check,
)
from service.jobs.common.sizes import POINTS_OF_A_SWEEP
from service.jobs.common.study_keys import (
    AUTO,
    Accuracy,
    EffectsWord,
    effects_issues,
    solved_issues,
    with_effects,
)
from service.jobs.kind_registry import Flag, JobKind, Json, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.study import Answer, Question, Study, Watch
from solver.errors import Issue, Naming, SettingError, Shown
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver import AnyBranch, Course, Stretch
    from solver.jit.fourier import Real
    from solver.scene.scene import Scene

FREQUENCY, SPEED = "frequency", "speed"


_LEAVING = "At each branch point its tangents and the branches that leave there."
sweep_result = answered(
    "solver.continuation.branch:AnyBranch", "SweepResult", peak=PeakAt | None, peaks=list[PeakAt], points=int,
    unstable=(list[list[int]], Field([], description="First and last point of what is not stable.")),
    marks=(list[Table], Field([], description="Folds, branch points, an early end; behind which point.")),
    stability_known_by=(str, Field("", description="uniqueness, determinant, multipliers or nothing.")),
    branches=(list[Table] | None, Field(None, description=_LEAVING)),
    drift_per_period=(float | None, None),
)  # fmt: skip


class Sweep(Study, HarmonicRequest):
    """Follow the response over a parameter.

    By continuation: folds are passed, and only converged points count.
    """

    EXAMPLES = (
        {"scene": "bladed-disk", "from": 500, "to": 900, "set": {DISK_LOAD: 150}},
        {"scene": "bladed-disk", "parameter": DISK_LOAD, "from": 20, "to": 300, "frequency_hz": 755},
    )
    NAME, FUNCTION, RESULT = "sweep", "solver:sweep", sweep_result
    ASKS = Question("How does it respond?", "damper", 350)
    TOLD = "solver.views.tables.responses:branch"
    SHOWS, SWEEPS = "peaks, band, folds", "the branch"
    EMPTY = ("parameter", "it stored no sweep to draw")

    parameter: Annotated[ParameterPath, Flag(metavar="PATH", words=(FREQUENCY,))] = Field(
        default=FREQUENCY, description=f"Path of what is swept: frequency, {DISK_LOAD}, …"
    )
    start: Annotated[Number | None, Flag(metavar="A")] = Field(
        default=None,
        alias="from",
        description="Start of the range; for the frequency, the scene's band if left out.",
    )
    stop: Annotated[Number | None, Flag(metavar="B")] = Field(
        default=None, alias="to", description="End of the range."
    )
    frequency_hz: Annotated[FrequencyHz | None, Flag("--frequency", "HZ")] = Field(
        default=None, description="Excitation frequency [Hz], needed when another parameter is swept."
    )
    limit: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None,
        description="Amplitude [m] above which the resonance band is measured; peak/√2 if left out.",
    )
    accuracy: Accuracy = None
    effects: EffectsWord = AUTO
    multipliers: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        alias="stability",
        description="Floquet multipliers at every point: period doublings and second frequencies are marked.",
    )
    switched: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        alias="branches",
        description="Follow the branches that leave at branch points, to the ends of the range.",
    )

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with parameter and range."""
        from solver.scene.parameter_paths import check_frequency

        path, order, ends = self.parameter, scene.speed_order, [self.start, self.stop]
        if path == SPEED and order is not None:  # the frequency in other units
            path, ends = FREQUENCY, [None if end is None else end * order / 60.0 for end in ends]
        over_frequency = path == FREQUENCY
        if over_frequency:
            band = zip(ends, scene.observe.band, strict=True)
            ends = [end if given is None else given for given, end in band]
        if unknown := check(partial(scene.check_path, path), "parameter"):
            return unknown
        issues = effects_issues(self.effects)
        for name, end in zip(("from", "to"), ends, strict=True):
            if end is None:
                issues.append(Issue((name,), f"is needed for a sweep of `{path}`"))
            elif not over_frequency:
                issues += check(partial(scene.with_values, {path: end}), name)
            else:
                issues += check(partial(check_frequency, name, end), name)
        if ends[0] is not None and ends[0] == ends[1]:
            issues.append(Issue(("to",), Naming("must differ from {from}"), Shown(f"{ends[1]!r} for both")))
        at = self.frequency_hz
        if over_frequency and at is not None:
            words = Naming("must be left out when the frequency is swept, from {from} to {to}")
            issues.append(Issue(("frequency_hz",), words, at))
        if not over_frequency and at is None:
            issues.append(Issue(("frequency_hz",), f"is needed for a sweep of `{path}`"))
        return issues

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        asked, points = (self.harmonics, self.effects), POINTS_OF_A_SWEEP
        return solved_issues("harmonics", scene, *asked, accuracy=self.accuracy, points=points)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Follow the branch."""
        return _followed(scene, asked, watch)[0]

    @classmethod
    def run(cls, spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
        """Follow the branch, and keep nothing of it."""
        return cls.run_on(spec, progress, should_stop, Checkpoints.none())

    @classmethod
    def run_on(
        cls, spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop, checkpoints: Checkpoints
    ) -> JobOutput:
        """Follow the branch, from where an earlier attempt got; keep what is new from time to time."""
        scene, asked = cls.asked(spec)
        once_more = partial(_kept, scene, asked, progress, should_stop, checkpoints)
        try:
            answer, branches = once_more()
        except SettingError as error:
            if error.name != "resume":
                raise
            checkpoints.begin_anew(str(error))
            answer, branches = once_more()
        from service.jobs.common.sweep_records import sweep_record

        at = asked.get("frequency_hz")
        return cls.output(answer, [sweep_record(each, at) for each in branches if len(each.values)])

    @classmethod
    def figure(cls, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
        """Return the stored branch."""
        from service.jobs.drawing import best_sweep_figure

        return best_sweep_figure(result, sweeps, read)

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job, which keeps what it has found."""
        return replace(super().as_kind(), run_on=cls.run_on)


def _followed(
    scene: Scene, asked: Mapping[str, Any], watch: Watch, course: Course | None = None
) -> tuple[Answer, list[AnyBranch]]:
    """Follow the branch, and those that leave it."""
    import solver

    given = with_effects(asked)
    multipliers, switched = given.pop("multipliers", False), given.pop("switched", False)
    branch = solver.sweep(scene, **given, **watch._asdict(), course=course)
    found, branches = branch.to_json(), [branch]
    if multipliers:
        found |= solver.bifurcations(branch, multipliers=True).of_a_branch()
    if switched:
        points = solver.switch_branches(branch)
        found["branches"] = [each.to_json() for each in points]
        branches += (other for each in points for other in each.branches)
    plot = partial(branch.plot, limit=asked.get("limit"))
    return Answer(branch, found, branch.reached, branch.status.value, plot), branches


def _kept(
    scene: Scene, asked: Mapping[str, Any], progress: Progress, should_stop: ShouldStop,
    checkpoints: Checkpoints,
) -> tuple[Answer, list[AnyBranch]]:  # fmt: skip
    """Follow the branch as `_followed`, from what was kept."""
    import solver

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

    def points(values: Real, amplitudes: Real) -> None:
        progress.found(list(zip(values.tolist(), amplitudes.tolist(), strict=True)))

    resume = solver.joined(known) if known else None
    course = solver.Course(resume=resume, on_stretch=add, on_points=points)
    answer, branches = _followed(scene, asked, Watch(progress, should_stop), course)
    if branches[0].status is solver.BranchStatus.STOPPED and fresh:
        keep()
    return answer, branches


def _beginning(checkpoints: Checkpoints) -> list[Stretch]:
    """What earlier attempts found of the branch."""
    import solver

    try:
        return [solver.Stretch.from_arrays(arrays) for _, arrays in sorted(checkpoints.found().items())]
    except (KeyError, ValueError, IndexError) as error:
        checkpoints.begin_anew(f"{type(error).__name__}: {error}")
        return []
