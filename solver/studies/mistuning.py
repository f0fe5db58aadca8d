"""Many mistuned disks: how much more their blades move than those of the tuned one.

Disk k of a study has the factors of the seed `seed` + k, so that each can be had again by `mistuned`, in any
order and on any number of machines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from solver.continuation.branch import Branch, BranchStatus
from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from solver.response.solve import relative_sum
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.scene import Scene
from solver.scene.scene_records import LumpedStructure, Mistuning
from solver.studies.blades import BladePeaks, blade_peaks, mistuned, with_mistuning
from solver.studies.study_results import MistunedDisk, MistuningStatus, MistuningStudy

MOST_SAMPLES = 1_000_000


def _until_stopped(
    drawn: Iterable[BladePeaks], tuned: BladePeaks, asked: Callable[[], bool]
) -> tuple[list[BladePeaks], tuple[Branch, ...], bool]:
    """Return the disks without their responses, the tuned response with the worst, and whether it stopped."""
    disks: list[BladePeaks] = []
    highest, branches = -math.inf, worst_branch(tuned)
    if asked():
        return disks, branches, True
    for peaks in drawn:
        if asked():
            return disks, branches, True
        disks.append(replace(peaks, branches=()))
        if peaks.largest > highest:
            highest, branches = peaks.largest, worst_branch(tuned) + worst_branch(peaks)
    return disks, branches, False


@shows_progress("mistuning")
def mistuning_study(
    scene: Scene,
    *,
    of: str | Sequence[str],
    spread: float = 0.02,
    samples: int = 100,
    seed: int = 1,
    start: float | None = None,
    stop: float | None = None,
    dof: str | None = None,
    harmonics: int = 11,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> MistuningStudy:
    """Compute the peaks of every blade of disks with random factors.

    Parameters
    ----------
    scene : a cyclic scene; mistuning that it has is left out.
    of : names of springs (k), dashpots (c) and masses, or DOFs (their mass), see `mistuned`.
    spread : standard deviation of the factors.
    samples : how many disks.
    seed : of the first disk, those of the others follow.
    start, stop : frequencies [Hz], the scene's band if left out.
    dof : name of the DOF in one sector; the observed one if left out.
    harmonics : highest harmonic kept.
    on_progress : called with (share done, disks so far).
    should_stop : asked between disks and between the steps of their responses.

    Returns
    -------
    The study; equal arguments give equal numbers.

    Raises
    ------
    SettingError, SceneError
        The scene is not cyclic, a part or DOF it does not have, factors that are not above 0, a bad number of
        samples, range or number of harmonics.
    """
    begun = clock()
    names = (of,) if isinstance(of, str) else tuple(of)
    disk_factors(scene, names, spread, samples, seed)  # refuses what cannot be drawn
    asked = should_stop or (lambda: False)

    def peaks_of(disk: Scene, done: int) -> BladePeaks:
        share, disks = 1.0 / (samples + 1.0), max(done - 1, 0)
        progress = part_of(on_progress, done * share, (done + 1) * share, disks, counting=False)
        return blade_peaks(
            disk, start, stop, dof=dof, harmonics=harmonics, every_branch=False, on_progress=progress,
            should_stop=should_stop,
        )  # fmt: skip

    tuned = peaks_of(without_mistuning(scene), 0)
    ahead = range(samples if worst_branch(tuned) else 0)
    drawn = (peaks_of(mistuned(scene, of=names, spread=spread, seed=seed + k), k + 1) for k in ahead)
    disks, branches, stopped = _until_stopped(drawn, tuned, asked)
    study = joined_study(
        scene, of=names, spread=spread, seed=seed, harmonics=harmonics, tuned=tuned, disks=disks,
        seconds=clock() - begun,
    )  # fmt: skip
    return replace(study, branches=branches, status=MistuningStatus.STOPPED if stopped else study.status)


def joined_study(
    scene: Scene,
    *,
    of: Sequence[str],
    spread: float,
    seed: int,
    harmonics: int,
    tuned: BladePeaks,
    disks: Sequence[BladePeaks],
    seconds: float,
) -> MistuningStudy:
    """Return the study of disks whose peaks are known already, wherever they were computed; no branches.

    Parameters
    ----------
    scene, of, spread, seed, harmonics : as in `mistuning_study`.
    tuned : peaks of the disk `without_mistuning`.
    disks : peaks of the disks ``mistuned(scene, of=of, spread=spread, seed=seed + k)``, k = 0, 1, …
    seconds : that they took.
    """
    compared = tuned.largest > 0.0
    drawn = disk_factors(scene, of, spread, max(len(disks), 1), seed)
    found = [
        MistunedDisk(
            seed=seed + k, factors=drawn[k], peaks=peaks, magnification=peaks.magnification(tuned),
            magnification_error=peaks.magnification(tuned) * relative_sum(peaks.highest, tuned.highest),
        )
        for k, peaks in enumerate(disks if compared else ())
    ]  # fmt: skip
    return MistuningStudy(
        scene=scene.name, of=tuple(of), spread=spread, tuned=replace(tuned, branches=()), disks=tuple(found),
        branches=(), n_harmonics=harmonics, status=_status(tuned, found), seconds=seconds,
    )  # fmt: skip


def disk_factors(
    scene: Scene, of: Sequence[str], spread: float, samples: int, seed: int
) -> list[tuple[float, ...]]:
    """Return the factors of every disk of a study, one for each sector; errors as `mistuning_study`."""
    with_mistuning(scene, {"of": list(of), "spread": 0.0, "seed": seed})  # refuses parts that are not there
    check_count("samples", samples, 1, MOST_SAMPLES)
    if not (math.isfinite(spread) and spread >= 0.0):
        raise SettingError("spread", spread, "must be a number >= 0")
    sectors = scene.structure.sector_count
    drawn = [Mistuning(of=tuple(of), spread=spread, seed=seed + k).factors(sectors) for k in range(samples)]
    for k, row in enumerate(drawn):
        if min(row) <= 0.0:
            wanted = f"must be smaller: with it the disk of seed {seed + k} has the factor {min(row):.4g}"
            raise SettingError("spread", spread, wanted)
    return drawn


def without_mistuning(scene: Scene) -> Scene:
    """Return the scene with sectors that are equal."""
    structure = scene.structure
    if isinstance(structure, LumpedStructure):
        return scene
    return scene.model_copy(update={"structure": structure.model_copy(update={"mistuning": None})})


def worst_branch(peaks: BladePeaks) -> tuple[Branch, ...]:
    """Return the response of the blade with the highest peak, if all are known and one moves."""
    found = peaks.worst_branch
    return () if found is None else (found,)


def _status(tuned: BladePeaks, disks: Sequence[MistunedDisk]) -> MistuningStatus:
    """Return how a study ended that was not stopped."""
    every = (tuned, *(disk.peaks for disk in disks))
    if any(BranchStatus.UNDAMPED in peaks.status for peaks in every):
        return MistuningStatus.UNDAMPED
    if not tuned.largest > 0.0:
        return MistuningStatus.NO_RESPONSE
    known = all(disk.known for disk in disks)
    return MistuningStatus.COMPLETED if known else MistuningStatus.INCOMPLETE
