"""One periodic response: `solve`, and what can be read off it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from solver.balance.balance import Balance, build, check_frequency
from solver.balance.kernels.gauge import FREE
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS, MEAN
from solver.balance.simplifications import Effects
from solver.balance.workspace import PointSolution, Workspace
from solver.branches.adaptive_harmonics import solve_to
from solver.branches.symmetry_breaking import assumed_flags, seen
from solver.contacts.kernels.stick_slip_events import STUCK
from solver.contacts.kernels.system import UNHELD, evaluation_by_value
from solver.extrema.error_estimate import UNKNOWN, truncation_error
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.linear.condensation import loose_ports
from solver.response.contact_response import OPENS, ContactResponse, ContactState, contact_responses
from solver.results.base import Drawn
from solver.results.views import Views
from solver.scene.scene import FrictionContact, Scene

if TYPE_CHECKING:
    pass


MEAN_UNDETERMINED = "mean_undetermined"
HISTORY_DEPENDENT = "history_dependent"


class SolutionStatus(Enum):
    """How a solve ended; the value is a sentence a user can act on."""

    CONVERGED = "The balance is satisfied."
    ACCURACY_NOT_REACHED = (
        "The balance is satisfied, but the accuracy asked for was not reached with the most harmonics "
        "allowed: ask for less, or set the harmonics yourself."
    )
    NOT_CONVERGED = (
        "No solution was found at this frequency: try more harmonics, or a sweep that passes through it."
    )
    RATCHETS = (
        "There is no periodic motion: a part that contacts alone hold ratchets, it drifts a little further "
        "every period. Press it harder, take away what pulls it to one side, or hold it by a spring."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Solution(Drawn):
    """A periodic response at one frequency.

    Attributes
    ----------
    status : SolutionStatus
        Whether and why; every number below is NaN if it is NOT_CONVERGED or RATCHETS.
    max_abs, half_peak_to_peak, mean : float
        Of the observed DOF over the period [m]. Not unique when `flags` has ``mean_undetermined``: the first
        and the last then depend on the history, and with ``history_dependent`` the second does too. Without
        these flags they are what a start from rest with contacts free of force leads to.
    n_harmonics : int
        The number asked for.
    harmonics : (H + 1,) array
        |mean| and the amplitude of each harmonic of the observed DOF [m], up to the highest one kept: that is
        above `n_harmonics` where a force is, see `solver.scene.harmonics.kept_harmonics`. Zero if not kept.
    observed : (2H + 1,) array
        Its coefficients [m].
    contacts : tuple of ContactResponse
        One for each contact of the scene.
    flags : tuple of str
        ``mean_undetermined``, ``history_dependent``, ``all_stuck``, ``separation``, ``not_unique``,
        ``symmetric_unstable``, ``travelling_wave_assumed`` where they apply; for the last three see
        `solver.branches.symmetry_breaking`.
    residual : float
        Relative residual of the balance.
    error_estimate : float
        Estimated error of `max_abs` by the harmonics left out and the residual [m]; of `half_peak_to_peak`
        where the mean is not determined. See `solver.extrema.error_estimate`.
    mean_range : (float, float)
        Bounds of the mean over every history [m], forces left in contacts by assembly included; NaN where no
        bound is known. See `solver.response.history_dependence`.
    """

    scene: Scene
    frequency_hz: float
    n_harmonics: int
    status: SolutionStatus
    max_abs: float
    half_peak_to_peak: float
    mean: float
    harmonics: Real
    observed: Real
    contacts: tuple[ContactResponse, ...]
    flags: tuple[str, ...]
    residual: float
    error_estimate: float
    newton_iterations: int
    seconds: float
    mean_range: tuple[float, float] = (math.nan, math.nan)

    @property
    def converged(self) -> bool:
        """Whether the numbers are a solution."""
        return self.status not in (SolutionStatus.NOT_CONVERGED, SolutionStatus.RATCHETS)

    @property
    def highest_harmonic(self) -> int:
        """The last one in `harmonics`, H of every (2H + 1,) array."""
        return int(self.harmonics.size) - 1

    @property
    def reached(self) -> bool:
        """Whether they are, with the accuracy asked for."""
        return self.status is SolutionStatus.CONVERGED

    VIEWS: ClassVar = Views("solver.views", "of_solution", "solution_dataset", "of_solution")

    def to_json(self, *, with_stability: bool = False) -> dict[str, object]:
        """Return the answer as one JSON object; on request with what `solver.stability` says, which costs."""
        if with_stability:
            from solver.response.floquet import stability

            return {**self.to_json(), "stability": stability(self).to_json() if self.converged else None}
        return {
            "scene": self.scene.name,
            "frequency_hz": self.frequency_hz,
            "converged": self.converged,
            "status": self.status.value,
            "max_abs": _number(self.max_abs),
            "half_peak_to_peak": _number(self.half_peak_to_peak),
            "mean": _number(self.mean),
            "harmonics": self.harmonics.tolist() if self.converged else None,
            "flags": list(self.flags),
            "contacts": {contact.name: contact.state.value for contact in self.contacts},
            "residual": _number(self.residual),
            "error_estimate": _number(self.error_estimate),
            "n_harmonics": self.n_harmonics,
            "newton_iterations": self.newton_iterations,
            "seconds": self.seconds,
            **({"mean_range": [*map(_number, self.mean_range)]} if MEAN_UNDETERMINED in self.flags else {}),
        }


def solve(
    scene: Scene,
    *,
    frequency_hz: float,
    harmonics: int = 11,
    accuracy: float | None = None,
    effects: Effects | None = None,
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

    Raises
    ------
    SettingError
        A bad frequency, number of harmonics or accuracy.
    """
    begun = time.perf_counter()
    check_frequency("frequency_hz", frequency_hz)
    omega = 2.0 * math.pi * frequency_hz
    good_enough = True
    if accuracy is None:
        workspace = Workspace.of(build(scene, harmonics=harmonics, effects=effects))
        found = workspace.solve(omega)
    else:
        workspace, found, good_enough = solve_to(
            lambda h: build(scene, harmonics=h, effects=effects), omega, accuracy
        )
    if not found.converged:
        return _failure(workspace.balance, frequency_hz, found, time.perf_counter() - begun)
    found, flags = seen(workspace, found, omega)
    solution = describe(workspace, found, frequency_hz, begun)
    solution = replace(solution, flags=(*solution.flags, *assumed_flags(workspace.balance), *flags))
    return solution if good_enough else replace(solution, status=SolutionStatus.ACCURACY_NOT_REACHED)


def describe(
    workspace: Workspace, found: PointSolution, frequency_hz: float, begun: float, *, estimated: bool = True
) -> Solution:
    """Turn a converged point of a frequency balance into a `Solution`, with its error estimate or without."""
    from solver.response.history_dependence import has_another_solution, history_of

    balance = workspace.balance
    omega = 2.0 * math.pi * frequency_hz
    error = truncation_error(workspace, found.u, omega) if estimated else UNKNOWN
    measures = workspace.measure(found.u, omega)
    if measures is None:
        return _failure(balance, frequency_hz, found, time.perf_counter() - begun)
    contacts = contact_responses(workspace, found.u, omega)
    observed = fourier.to_full(measures.observed, balance.system.ks, balance.highest_harmonic)
    solution = Solution(
        scene=balance.scene,
        frequency_hz=frequency_hz,
        n_harmonics=balance.n_harmonics,
        status=SolutionStatus.CONVERGED,
        max_abs=float(measures.values[MAX_ABS]),
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
    another = has_another_solution(workspace, found.u, omega)
    mean_open = nothing_holds or history.mean_open or another
    return replace(
        solution,
        flags=_flags(contacts, mean_open=mean_open, half_range_open=history.half_range_open or another),
        error_estimate=error.half_peak_to_peak if mean_open else error.max_abs,
        mean_range=(math.nan, math.nan) if nothing_holds else history.mean_range,
        seconds=time.perf_counter() - begun,
    )


def _nothing_holds_a_part(workspace: Workspace) -> bool:
    """Return whether a part that contacts alone hold is free to stand anywhere, where last evaluated."""
    balance, point = workspace.balance, evaluation_by_value(workspace.point)
    if balance.system.ks[0] == 0:
        return bool(point.counts[UNHELD] > 0 or np.any(point.elastic > 0.0))
    loose, kt = loose_ports(balance.scene)
    if not len(loose):
        return False
    friction = np.array([isinstance(contact, FrictionContact) for contact in balance.scene.contacts])
    holds = (~friction | (point.states == STUCK))[balance.system.owner]
    held = (loose * (kt * holds)) @ loose.T
    return bool(np.linalg.eigvalsh(held)[0] < FREE)


def _flags(
    contacts: tuple[ContactResponse, ...], *, mean_open: bool, half_range_open: bool
) -> tuple[str, ...]:
    stuck = [contact for contact in contacts if contact.state is ContactState.STUCK]
    flags = []
    if mean_open:
        flags.append(MEAN_UNDETERMINED)
    if half_range_open:
        flags.append(HISTORY_DEPENDENT)
    if stuck and len(stuck) == len(contacts):
        flags.append("all_stuck")
    if any(contact.state in OPENS for contact in contacts):
        flags.append("separation")
    return tuple(flags)


def _failure(balance: Balance, frequency_hz: float, found: PointSolution, seconds: float) -> Solution:
    nothing = np.full(2 * balance.highest_harmonic + 1, np.nan)
    return Solution(
        scene=balance.scene, frequency_hz=frequency_hz, n_harmonics=balance.n_harmonics,
        status=SolutionStatus.RATCHETS if found.ratchets else SolutionStatus.NOT_CONVERGED,
        max_abs=math.nan, half_peak_to_peak=math.nan, mean=math.nan,
        harmonics=np.full(balance.highest_harmonic + 1, np.nan), observed=nothing, contacts=(), flags=(),
        residual=found.residual, error_estimate=math.nan, newton_iterations=found.iterations, seconds=seconds,
    )  # fmt: skip


def _number(value: float) -> float | None:
    """Return a float that JSON can carry."""
    return float(value) if math.isfinite(value) else None
