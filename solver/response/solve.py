"""One periodic response: `solve`, and its flags."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from solver.balance.balance import Balance, Kind, build, check_harmonics
from solver.balance.kernels.gauge import FREE
from solver.balance.kernels.output import HALF_RANGE, MEAN, extremes
from solver.balance.rounding import resonates_undamped
from solver.balance.simplifications import Effects
from solver.balance.workspace import PointSolution, Workspace
from solver.contacts.kernels.stick_slip_events import STUCK
from solver.contacts.kernels.system import UNHELD, evaluation_by_value
from solver.continuation.branch import Branch, unsettled
from solver.continuation.branches.adaptive_harmonics import solve_to
from solver.continuation.branches.symmetry_breaking import assumed_flags, seen
from solver.continuation.extrema.error_estimate import UNKNOWN, ErrorEstimator, truncation_error
from solver.continuation.from_nothing import solve_from_nothing
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.lab import from_lab
from solver.linear.condensation import loose_ports
from solver.linear.natural_frequencies import undamped_resonance
from solver.response.contact_response import contact_responses, flags_of
from solver.response.history_dependence import has_another_solution, history_of
from solver.response.plausibility import band_end_of
from solver.response.solution import HISTORY_DEPENDENT, MEAN_UNDETERMINED, Solution, SolutionStatus
from solver.results.known import ABOVE_FRICTION, HALF_PEAK_TO_PEAK, Known
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.continuation.branch import Branch

NEARBY = 0.9  # of a frequency: there, an undamped resonance is no reason for a large receptance

_OPEN = (MEAN_UNDETERMINED, HISTORY_DEPENDENT)


def solve(
    scene: Scene,
    *,
    frequency_hz: float,
    harmonics: int = 11,
    accuracy: float | None = None,
    effects: Effects | None = None,
    exact: bool = False,
) -> Solution:
    """Find the periodic response of a scene at one frequency.

    Parameters
    ----------
    scene : what vibrates.
    frequency_hz : excitation frequency [Hz].
    harmonics : highest harmonic kept, unless `accuracy` is given.
    accuracy : estimated error of the amplitude, relative to it, that the fewest harmonics are chosen for.
    effects : what is paid for though the scene does not call for it; see
    `solver.balance.simplifications.Effects`.
    exact : from there follow the events of the contacts, to rounding (`stickslip.lab.proofs.exact`), as is
    always done of scenes with rigid contacts, from rest. Where no orbit is found the balance answers, with
    ACCURACY_NOT_REACHED.

    Raises
    ------
    SettingError
        A bad frequency, number of harmonics or accuracy; a scene that has no place in an exact solution.
    """
    begun = clock()
    check_frequency("frequency_hz", frequency_hz)
    scene = scene.at_frequency(frequency_hz)
    omega = 2.0 * math.pi * frequency_hz
    good_enough = True
    rigid = scene.rigid_contact is not None
    if exact or rigid:
        solve_exactly = from_lab("proofs.exact.answer:solve_exactly")
        orbit: Solution = solve_exactly(scene, frequency_hz, check_harmonics(harmonics))
        if rigid or orbit.converged:
            return orbit
        good_enough = False
    if accuracy is None:
        workspace = Workspace.of(build(scene, harmonics=harmonics, effects=effects))
        found = solve_from_nothing(workspace, omega)
    else:
        workspace, found, reached = solve_to(
            lambda h: build(scene, harmonics=h, effects=effects), omega, accuracy
        )
        good_enough = good_enough and reached
    if not found.converged:
        # Loaded here: it brings the kernels of a walk along, which an answer does without.
        from solver.continuation.stretches import too_stiff

        failed = _failure(workspace.balance, frequency_hz, found, clock() - begun)
        if not found.ratchets and (workspace.law_fails(omega) or workspace.law_fails(omega, found.u)):
            failed = replace(failed, status=SolutionStatus.LAW_FAILED)
        elif failed.status is SolutionStatus.NOT_CONVERGED and too_stiff(workspace, omega, NEARBY * omega):
            failed = replace(failed, status=SolutionStatus.TOO_STIFF)
        elif failed.status is SolutionStatus.NOT_CONVERGED and found.loses_power:
            failed = replace(failed, status=SolutionStatus.POWER_LOST)
        return failed
    found, flags = seen(workspace, found, omega)
    solution = describe(workspace, found, frequency_hz, begun)
    solution = replace(solution, flags=(*solution.flags, *assumed_flags(workspace.balance), *flags))
    if exact:
        polished: Solution = solve_exactly(scene, frequency_hz, harmonics, near=solution)
        if polished.converged:
            return polished
        good_enough = False
    return solution if good_enough else replace(solution, status=SolutionStatus.ACCURACY_NOT_REACHED)


def describe(
    workspace: Workspace, found: PointSolution, frequency_hz: float, begun: float, *, estimated: bool = True
) -> Solution:
    """Turn a converged point of a frequency balance into a `Solution`, with its error estimate or without."""
    balance = workspace.balance
    omega = 2.0 * math.pi * frequency_hz
    if resonates_undamped(balance, omega, omega):
        failed = _failure(balance, frequency_hz, found, clock() - begun)
        return replace(failed, status=SolutionStatus.UNDAMPED)
    error = truncation_error(workspace, found.u, omega) if estimated else UNKNOWN
    measures = workspace.measure(found.u, omega)
    if measures is None:
        return _failure(balance, frequency_hz, found, clock() - begun)
    contacts = contact_responses(workspace, found.u, omega)
    high, _, low, _ = extremes(balance.system, measures.observed)
    observed = fourier.to_full(measures.observed, balance.system.ks, balance.highest_harmonic)
    solution = Solution(
        scene=balance.scene.at_frequency(frequency_hz),
        frequency_hz=frequency_hz,
        n_harmonics=balance.n_harmonics,
        status=SolutionStatus.CONVERGED,
        max_abs=max(high, -low),
        half_peak_to_peak=float(measures.values[HALF_RANGE]),
        mean=float(measures.values[MEAN]),
        harmonics=np.abs(fourier.to_complex(observed)),
        observed=observed,
        contacts=contacts,
        flags=(),
        residual=found.residual,
        error_estimate=error.max_abs,
        newton_iterations=found.iterations,
        seconds=0.0,
    )
    history, nothing_holds = history_of(solution), _nothing_holds_a_part(workspace)
    mean_open, open_anyway = nothing_holds or history.mean_open, history.half_range_open
    # Another solution would open both: where they are open already none is looked for.
    another = not (mean_open and open_anyway) and has_another_solution(
        workspace, found.u, omega, from_nothing=estimated
    )
    mean_open = mean_open or another
    return replace(
        solution,
        flags=flags_of(contacts, mean_open=mean_open, half_range_open=open_anyway or another),
        error_estimate=error.half_peak_to_peak if mean_open else error.max_abs,
        mean_range=(math.nan, math.nan) if nothing_holds else history.mean_range,
        seconds=clock() - begun,
    )


def peak_flags(branch: Branch) -> tuple[str, ...]:
    """Return the flags of the response at the highest peak of a branch that has one, see `Solution`."""
    return peak_response(branch).flags


def peak_response(branch: Branch) -> Solution:
    """Return the response at the highest peak of a branch that has one, without its error estimate."""
    peak = branch.peaks[0]
    return _described(branch, peak.at, peak.solution)


def described_at(branch: Branch, i: int) -> Solution:
    """Return the response at point number `i` of a branch, without its error estimate."""
    return _described(branch, float(branch.values[i]), branch.solutions[i, :-1].copy())


def _described(branch: Branch, at: float, u: Real) -> Solution:
    """Return the response `u` at a value of a branch's parameter, without its error estimate."""
    balance, (scene, frequency_hz) = branch.balance, branch.scene_at(at)
    if balance.parameter.kind is not Kind.FREQUENCY:
        effects = replace(balance.effects, even_harmonics=int(balance.system.ks[0]) == 0)
        balance = build(scene, harmonics=balance.n_harmonics, effects=effects)
    found = PointSolution(converged=True, u=u, iterations=0, residual=0.0)
    return describe(Workspace.of(balance), found, frequency_hz, clock(), estimated=False)


def _nothing_holds_a_part(workspace: Workspace) -> bool:
    """Return whether a part that contacts alone hold is free to stand anywhere, where last evaluated."""
    balance, point = workspace.balance, evaluation_by_value(workspace.point)
    if balance.system.ks[0] == 0:
        return bool(point.counts[UNHELD] > 0 or np.any(point.elastic > 0.0))
    loose, kt = loose_ports(balance.scene)
    if not len(loose):
        return False
    friction = np.array([contact.friction is not None for contact in balance.scene.contacts])
    holds = (~friction | (point.states == STUCK))[balance.system.owner]
    held = (loose * (kt * holds)) @ loose.T
    return bool(np.linalg.eigvalsh(held)[0] < FREE)


def _failure(balance: Balance, frequency_hz: float, found: PointSolution, seconds: float) -> Solution:
    status = SolutionStatus.RATCHETS if found.ratchets else SolutionStatus.NOT_CONVERGED
    if not found.ratchets and undamped_resonance(balance.scene, frequency_hz, balance.system.ks):
        status = SolutionStatus.UNDAMPED
    return Solution.without_numbers(
        scene=balance.scene, frequency_hz=frequency_hz, n_harmonics=balance.n_harmonics, status=status,
        highest=balance.highest_harmonic, flags=(ABOVE_FRICTION,) if found.above_friction else (),
        residual=found.residual, newton_iterations=found.iterations, seconds=seconds,
    )  # fmt: skip


def known_of(branch: Branch) -> Known:
    """Return how well the highest peak of a branch is known, `Branch.known`.

    Where the mean of the peak is free, it is judged by half peak to peak: max|x| depends on the history.
    So it is where the scene observes half peak to peak.
    """
    peak = branch.peak
    if peak is None:
        return Known(flags=branch.flags)
    there = peak_response(branch)
    known = Known(
        peak_max_abs=peak.value, error_estimate=branch.error_estimate,
        flags=tuple(dict.fromkeys((*branch.flags, *(flag for flag in there.flags if flag in _OPEN)))),
        notes=band_end_of(branch), peaks_open=tuple(unsettled([branch.peak_certificate])),
    )  # fmt: skip
    if branch.balance.scene.observe.centred:
        return replace(
            known, measure=HALF_PEAK_TO_PEAK, peak_max_abs=there.max_abs, error_estimate=math.nan,
            peak_half_peak_to_peak=peak.value, half_peak_to_peak_error=branch.error_estimate,
        )  # fmt: skip
    if MEAN_UNDETERMINED not in there.flags:
        return known
    at = float(branch.balance.parameter.inside(peak.at))
    error = ErrorEstimator(Workspace.of(branch.balance)).at(peak.solution, at, across=peak.interior)
    return replace(
        known, measure=HALF_PEAK_TO_PEAK, peak_half_peak_to_peak=there.half_peak_to_peak,
        half_peak_to_peak_error=error.half_peak_to_peak,
    )  # fmt: skip


def known_of_solution(solution: Solution) -> Known:
    """Return how well the amplitude of one response is known."""
    flags = tuple(flag for flag in solution.flags if flag not in ("all_stuck", "separation"))
    if not solution.converged:
        return Known(flags=flags)
    if MEAN_UNDETERMINED in flags or solution.scene.observe.centred:
        return Known(
            measure=HALF_PEAK_TO_PEAK, peak_max_abs=solution.max_abs,
            peak_half_peak_to_peak=solution.half_peak_to_peak,
            half_peak_to_peak_error=solution.error_estimate, flags=flags,
        )  # fmt: skip
    return Known(peak_max_abs=solution.max_abs, error_estimate=solution.error_estimate, flags=flags)


def relative_sum(*parts: Known) -> float:
    """Return the relative error of a product or a ratio of peaks; NaN if one of them is not known."""
    total = sum(part.relative for part in parts)
    return total if math.isfinite(total) else math.nan
