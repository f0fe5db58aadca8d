"""The main job end to end: designs through the embedded service, stored sweeps read back, pictures.

This is what ``stickslip demo`` and ``make demo`` run, and an example of the service inside a program.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import solver
from optim.views.tables.design import design
from stickslip.lab.demo.demo_cases import CASES, REMOVED, STUCK, DemoCase
from service.cli.failures import ShortfallError
from service.cli.progress import Reporter, bars
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.errors import InputError
from service.jobs.drawing import response_of
from service.jobs.kinds import warm_up
from service.rendering.text import print_told, say
from service.schemas.answers import JobAnswer, SweepDetail
from service.settings.settings import load_settings
from solver.views.plots.html import save
from solver.views.plots.responses import Family, family_figure, peak_figure

_LOOK_SECONDS = 0.1


def run(folder: Path, cases: Sequence[DemoCase] = CASES, told: int = 0) -> list[Path]:
    """Design, read back, draw; everything goes into `folder`. Returns the pictures.

    Optima of the first `told` cases are on the screen already.

    Raises
    ------
    InputError
        The folder cannot be used.
    ShortfallError
        A job did not reach its goal.
    DatabaseError
        The database in the folder cannot be used.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"`--out`: {str(folder)!r} cannot be used: {error.strerror}") from error
    # Here first: several workers would otherwise each compile the same kernels on a first run.
    warm_up()
    with EmbeddedService(load_settings(database=f"sqlite:///{folder / 'demo.db'}")) as service:
        designs = _designs(service, cases, told)
        sweeps = _sweeps(service, cases)
        pictures: list[Path] = []
        for case, design, jobs in zip(cases, designs, sweeps, strict=True):
            optimum = service.results(design.id).result["optimum"][case.variable]
            pictures += _draw(folder, case, optimum, _read_back(service, [design, *jobs]))
    say("\n".join(["Pictures:", *(f"  {picture}" for picture in pictures)]))
    return pictures


def _designs(service: EmbeddedService, cases: Sequence[DemoCase], told: int) -> list[JobAnswer]:
    """Have the dampers designed, and say what came out but for the first ones, which are told already."""
    specs = [{"scene": c.scene, "variables": {c.variable: list(c.bounds)}, "fresh": True} for c in cases]
    submitted = [service.submit("design", spec) for spec in specs]
    ended = []
    # Each is told as soon as it is there; the others are computed meanwhile.
    for number, (case, job) in enumerate(zip(cases, submitted, strict=True)):
        with bars([f"design {case.scene}"], "responses") as reporters:
            ((done,),) = _follow(service, [[job]], reporters)
        if number >= told:
            print_told(design(service.results(done.id).result))
            say("")
        ended.append(done)
    return ended


def _sweeps(service: EmbeddedService, cases: Sequence[DemoCase]) -> list[list[JobAnswer]]:
    """Have the other responses of the pictures computed; one that is stored is not computed again."""
    groups = [
        [
            service.submit("sweep", {"scene": case.scene, "set": values})
            for values in (*case.limits, *({case.variable: load} for load in case.loads))
        ]
        for case in cases
    ]
    with bars([f"responses {case.scene}" for case in cases], "done") as reporters:
        return _follow(service, groups, reporters)


def _follow(
    service: EmbeddedService, groups: Sequence[Sequence[str]], reporters: Sequence[Reporter | None]
) -> list[list[JobAnswer]]:
    """Wait for groups of jobs, each with its progress bar; ShortfallError if one was not successful.

    A bar counts the points of a single job, or the jobs that are done.
    """
    ended: dict[str, JobAnswer] = {}
    while True:
        for group, report in zip(groups, reporters, strict=True):
            jobs = [ended.get(job) or service.job(job) for job in group]
            ended |= {job.id: job for job in jobs if job.status.finished}
            if report is not None:
                shares = [1.0 if job.status.finished else job.progress for job in jobs]
                count = jobs[0].points if len(jobs) == 1 else sum(job.status.finished for job in jobs)
                report(sum(shares) / len(shares), count)
        if all(job in ended for group in groups for job in group):
            break
        time.sleep(_LOOK_SECONDS)
    for job in ended.values():
        if job.status is not JobState.SUCCESSFUL:
            reason = (job.error or {}).get("detail", "for no known reason")
            raise ShortfallError(f"the {job.kind} of {job.scene} is {job.status.value}: {reason}")
    return [[ended[job] for job in group] for group in groups]


def _read_back(service: EmbeddedService, jobs: Sequence[JobAnswer]) -> list[SweepDetail]:
    """The stored sweeps of some jobs, in their order."""
    stored = [service.sweep(sweep.id) for job in jobs for sweep in service.results(job.id).sweeps]
    points = sum(sweep.points for sweep in stored)
    say(f"{stored[0].scene}: {len(stored)} stored sweeps read back, {points} points")
    return stored


def _draw(folder: Path, case: DemoCase, optimum: float, stored: Sequence[SweepDetail]) -> tuple[Path, Path]:
    """Write the two pictures of a case: a family of responses, and the peak against the load."""
    family, peaks = _select(case, optimum, stored)
    curve = peak_figure(
        case.scene,
        case.variable,
        np.array(list(peaks)),
        np.array(list(peaks.values())),
        optimum=(optimum, peaks[optimum]),
        measured=family.measured,
    )
    pictures = (folder / f"{case.scene}-responses.png", folder / f"{case.scene}-peak.png")
    save(family_figure(family), pictures[0])
    save(curve, pictures[1])
    return pictures


def _select(
    case: DemoCase, optimum: float, stored: Sequence[SweepDetail]
) -> tuple[Family, Mapping[float, float]]:
    """The responses to draw together; the highest peak [m] at every load [N] within the bounds, ascending."""
    loads = [sweep.contacts[case.contact].N0 for sweep in stored]
    by_load = {load: sweep for load, sweep in zip(loads, stored, strict=True) if load is not None}
    low, high = case.bounds
    measured = solver.load_scene(case.scene).measured
    family = Family(
        variable=case.variable,
        members=tuple(
            (load, response_of(by_load[load], measured)) for load in sorted({*case.shown, optimum})
        ),
        optimum=optimum,
        free=response_of(by_load[REMOVED], measured),
        stuck=response_of(by_load[STUCK], measured),
        measured=measured,
    )
    inside = {load: by_load[load].peak for load in sorted(by_load) if low <= load <= high}
    return family, {load: peak.value for load, peak in inside.items() if peak is not None}
