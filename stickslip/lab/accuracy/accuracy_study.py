"""What accuracy costs: error against time, for numbers of harmonics, in closed form and by samples.

The last row is the exact solution where there is one, and what errors are measured against.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, build, check_harmonics
from solver.balance.kernels.output import MAX_ABS
from solver.balance.balance import more_harmonics, pad
from solver.balance.workspace import Workspace
from solver.contacts.kernels.laws import law_number
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.error_estimate import truncation_error
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.lab import LAB, from_lab, is_there
from solver.response.solve import solve
from solver.results.watch import ShouldStop, shows_progress
from solver.scene.scene_harmonics import kept_harmonics
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene
from stickslip.lab.accuracy.kernels import aft
from stickslip.lab.accuracy.accuracy_result import AccuracyRow, AccuracyStatus, AccuracyStudy

CLOSED_FORM, SAMPLED, EXACT = "closed form", "sampled", "exact"
HARMONICS = (1, 3, 5, 7, 11, 15, 21, 31, 41)
SAMPLES = (64, 256, 1024, 8192)
LEAST_REFERENCE = 101  # harmonics
_BEYOND = 3  # reference harmonics over the most studied
_AWAY = 1e-3  # relative distance in frequency of the neighbour that Newton's method starts from
REPEATS = 15
# Fewest samples for the shortest wave kept: below, the harmonics are aliased.
_PER_WAVE = 4


def _highest_peak(scene: Scene, should_stop: ShouldStop) -> tuple[Branch, float]:
    """Return the response over the scene's band and the frequency of its highest peak [Hz]."""
    branch = sweep(scene, should_stop=should_stop)
    if branch.peak is None:
        ended = branch.status.value.rstrip(".")
        raise SettingError("frequency_hz", None, f"is needed: the scene's band gave no response ({ended})")
    return branch, branch.peak.at


def _ways(scene: Scene, harmonics: Sequence[int], samples: Sequence[int]) -> list[tuple[int, int]]:
    """Return highest harmonic and samples a period of each way to evaluate; no samples: the closed form."""
    shortest = {h: int(kept_harmonics(scene, (), h, odd=False)[-1]) for h in harmonics}
    sampled = [(h, n) for n in samples for h in harmonics if n >= _PER_WAVE * max(shortest[h], 1)]
    return [(h, 0) for h in harmonics] + sampled


@shows_progress("accuracy")
def accuracy_study(
    scene: Scene,
    frequency_hz: float | None = None,
    *,
    harmonics: Sequence[int] = HARMONICS,
    samples: Sequence[int] = SAMPLES,
    repeats: int = REPEATS,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> AccuracyStudy:
    """Measure error and time of one point for several numbers of harmonics and both evaluators.

    Parameters
    ----------
    scene : what vibrates.
    frequency_hz : where [Hz]; at the highest peak of the scene's band if left out.
    harmonics : highest harmonics to try.
    samples : in a period, to try for each of them; multiples of 4. Fewer than four for the shortest wave are
        left out.
    repeats : of each timing.
    on_progress : called with (share done, rows so far).
    should_stop : asked between ways and between turns of the timing.

    Raises
    ------
    SettingError
        A bad frequency, number of harmonics or of samples, or no solution at the frequency to compare with.
    """
    _check_ways(harmonics, samples, repeats)
    branch = None
    if frequency_hz is None:
        branch, frequency_hz = _highest_peak(scene, should_stop)
    p = 2.0 * math.pi * check_frequency("frequency_hz", frequency_hz)
    reference = _reference(scene, p, max(LEAST_REFERENCE, _BEYOND * max(harmonics)))
    if reference is None:
        raise SettingError("frequency_hz", frequency_hz, "has no solution to compare with")
    workspace, u, most = reference
    counted, doubt = workspace.balance.n_harmonics, truncation_error(workspace, u, p).max_abs
    polished = _polished(scene, frequency_hz)
    if polished is not None:
        most, counted, doubt = polished[0].max_abs, 0, polished[0].error
    ways = _ways(scene, harmonics, samples)
    prepared: list[tuple[AccuracyRow, Callable[[], object]]] = []
    asked = should_stop or (lambda: False)
    tell = on_progress or (lambda _share, _rows: None)
    steps = len(ways) + repeats
    for done, (highest, count) in enumerate(ways):
        if asked():
            break
        way = _prepared(scene, p, highest, count, most)
        if way is not None:
            prepared.append(way)
        tell((done + 1) / steps, len(prepared))
    prepared += [] if polished is None else [polished]
    rows = _timed(prepared, repeats, asked, lambda turns: tell((len(ways) + turns) / steps, len(prepared)))
    stopped = asked()
    return AccuracyStudy(
        scene=scene.name, frequency_hz=frequency_hz, reference=most, reference_harmonics=counted,
        reference_error=doubt,
        rows=() if stopped else tuple(replace(row, pareto=_leads(row, rows)) for row in rows),
        branch=branch, status=AccuracyStatus.STOPPED if stopped else AccuracyStatus.COMPLETED,
    )  # fmt: skip


def _check_ways(harmonics: Sequence[int], samples: Sequence[int], repeats: int) -> None:
    for count in harmonics:
        check_harmonics(count)
    for count in samples:
        check_samples(count)
    if not harmonics or repeats < 1:
        raise SettingError("harmonics", list(harmonics), "needs one number at least, and one repetition")


def check_samples(samples: int) -> int:
    """Return `samples` if a period may be sampled so; SettingError if it is no positive multiple of 4."""
    whole = isinstance(samples, (int, np.integer)) and not isinstance(samples, bool)
    if not whole or samples < 4 or samples % 4:
        raise SettingError("samples", samples, "must be a positive multiple of 4")
    return int(samples)


def sampled(balance: Balance, samples: int) -> Balance:
    """Return the balance with contact forces from samples of a period; SettingError if they are too few."""
    if check_samples(samples) <= 2 * balance.highest_harmonic:
        raise SettingError("samples", samples, f"must be > {2 * balance.n_harmonics} for these harmonics")
    system, contacts = balance.system, balance.scene.contacts
    laws, table = system.laws.copy(), system.contacts.copy()
    for e, contact in enumerate(contacts):
        if contact.JENKINS:
            laws[e], table[e, aft.SAMPLES] = law_number(f"{aft.__name__}:coulomb_sampled"), samples
    return replace(balance, system=system._replace(samples=samples, laws=laws, contacts=table))


def _reference(scene: Scene, p: float, top: int) -> tuple[Workspace, Real, float] | None:
    """Return the solution with `top` harmonics and its max|x|, reached by and by."""
    workspace = Workspace.of(build(scene, harmonics=11))
    found = workspace.solve(p)
    while found.converged and workspace.balance.n_harmonics < top:
        balance = workspace.balance
        workspace = Workspace.of(more_harmonics(balance, min(2 * balance.n_harmonics, top)))
        found = workspace.solve(p, pad(found.u, balance, workspace.balance))
    measures = workspace.measure(found.u, p) if found.converged else None
    return None if measures is None else (workspace, found.u, float(measures.values[MAX_ABS]))


def _polished(scene: Scene, frequency_hz: float) -> tuple[AccuracyRow, Callable[[], object]] | None:
    """Return the row of the exact solution beside that of the balance; None where there is none."""
    beside = solve(scene, frequency_hz=frequency_hz)
    # Without contacts harmonics are exact themselves.
    if not scene.contacts or not beside.converged or not is_there(f"{LAB}.proofs"):
        return None
    solve_exactly = from_lab("proofs.exact.answer:solve_exactly")
    orbit_beside = from_lab("proofs.exact.orbit:orbit_beside")
    try:
        found = solve_exactly(scene, frequency_hz, beside.n_harmonics, near=beside)
    except SettingError:  # a part of the scene has no place in it: harmonics are all there is
        return None
    row = AccuracyRow(
        harmonics=0, evaluator=EXACT, samples=0, max_abs=found.max_abs, error=found.error_estimate,
        milliseconds=math.nan, iterations=found.newton_iterations, residual=found.residual,
    )  # fmt: skip
    return (row, lambda: orbit_beside(beside)) if found.converged else None


def _prepared(
    scene: Scene, p: float, harmonics: int, samples: int, exact: float
) -> tuple[AccuracyRow, Callable[[], object]] | None:
    """Return one way's row without its time, and what is to be timed; None where it does not converge."""
    balance = build(scene, harmonics=harmonics)
    workspace = Workspace.of(sampled(balance, samples) if samples else balance)
    neighbour = workspace.solve(p * (1.0 + _AWAY))
    if not neighbour.converged:
        return None
    found = workspace.solve(p, neighbour.u)
    measures = workspace.measure(found.u, p) if found.converged else None
    if measures is None:
        return None
    max_abs = float(measures.values[MAX_ABS])
    row = AccuracyRow(
        harmonics=harmonics, evaluator=SAMPLED if samples else CLOSED_FORM, samples=samples, max_abs=max_abs,
        error=abs(max_abs - exact), milliseconds=math.nan, iterations=found.iterations,
        residual=found.residual,
    )  # fmt: skip
    return row, lambda: workspace.solve(p, neighbour.u)


def _timed(
    prepared: list[tuple[AccuracyRow, Callable[[], object]]],
    repeats: int,
    asked: Callable[[], bool],
    tell: Callable[[int], None],
) -> list[AccuracyRow]:
    """Return the rows with their times, all measured in turn: a busy moment slows every one of them."""
    seconds = np.zeros((repeats, len(prepared)))
    for turn in range(repeats):
        if asked():
            return []
        for i, (_, work) in enumerate(prepared):
            work()  # the one before may have filled the caches
            begun = time.thread_time()  # other programs do not count
            work()
            seconds[turn, i] = time.thread_time() - begun
        tell(turn + 1)
    medians = 1e3 * np.median(seconds, axis=0)
    return [
        replace(row, milliseconds=float(ms)) for (row, _), ms in zip(prepared, medians, strict=True)
    ]  # fmt: skip


def _leads(row: AccuracyRow, rows: Sequence[AccuracyRow]) -> bool:
    """Return whether no other row is at least as good in both, and better in one."""
    return not any(
        other.error <= row.error
        and other.milliseconds <= row.milliseconds
        and (other.error < row.error or other.milliseconds < row.milliseconds)
        for other in rows
    )
