"""One periodic response: `solve`, and what can be read off it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from solver import fourier
from solver.accuracy import truncation_error
from solver.adaptive import solve_to
from solver.balance import Balance, build, check_frequency
from solver.fourier import Real
from solver.kernels.events import LIFTING, SEPARATED, SLIPPING, STUCK
from solver.kernels.jacobian import fill_jacobian
from solver.kernels.laws_columns import CLOSED, DEFORMING, TOUCHING
from solver.kernels.observe import HALF_RANGE, MAX_ABS, MEAN
from solver.kernels.system import evaluation_by_value
from solver.savings import Effects
from solver.scene import AnyContact, ElasticNormalContact, FrictionContact, PlanarContact, Scene
from solver.shown import Shown, Summary
from solver.workspace import PointSolution, Workspace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.dataset import Dataset
    from solver.plots.style import Into


# A stuck contact below this share of its friction limit cannot have slipped while the vibration built up from
# rest: a suddenly started linear vibration overshoots its steady amplitude at most twofold.
SAFELY_STUCK = 0.5
# Smallest singular value of dr/du, relative to the largest, that counts as a part nothing holds.
FREE = 1e-7
MEAN_UNDETERMINED = "mean_undetermined"


class ContactState(Enum):
    """What a contact does over a period; the value is what a user reads."""

    SEPARATED = "separated"
    STUCK = "stuck"
    SLIPPING = "stick and slip"
    LIFTING = "stick, slip and separation"
    CLOSED = "closed"
    TOUCHING = "opens and closes"
    DEFORMING = "deforms"


_STATES = {
    SEPARATED: ContactState.SEPARATED,
    STUCK: ContactState.STUCK,
    SLIPPING: ContactState.SLIPPING,
    LIFTING: ContactState.LIFTING,
    CLOSED: ContactState.CLOSED,
    TOUCHING: ContactState.TOUCHING,
    DEFORMING: ContactState.DEFORMING,
}


def state_of(code: int) -> ContactState:
    """The state a compiled loop says by a number, as in `Branch.states`."""
    return _STATES[code]


_OPENS = (ContactState.SEPARATED, ContactState.LIFTING, ContactState.TOUCHING)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactResponse:
    """The motion and force of one contact.

    Attributes
    ----------
    name : str
        Name of the contact.
    state : ContactState
        What it does over the period.
    slip : (2H + 1,) array
        Coefficients of the slip motion u [m].
    force : (2H + 1,) array
        Coefficients of the friction force [N].
    load : (3,) or (2H + 1,) array
        Coefficients of the normal load N [N] before it is cut at 0; 0 of a contact without friction.
    second_motion, second_force : (2H + 1,) array or None
        The other relative motion of the contact [m] and the force along it [N]: the normal one of a rubbing
        contact, or the second direction it slides in.
    utilisation : float
        max|f| / (μ N) of a stuck contact, 1 for one that slips, NaN for one that is separated throughout.
    """

    name: str
    state: ContactState
    slip: Real
    force: Real
    load: Real
    utilisation: float
    second_motion: Real | None = None
    second_force: Real | None = None

    @property
    def motions(self) -> tuple[Real, ...]:
        """Coefficients of all its relative motions [m]."""
        return (self.slip,) if self.second_motion is None else (self.slip, self.second_motion)

    @property
    def forces(self) -> tuple[Real, ...]:
        """Coefficients of the forces along them [N]."""
        return (self.force,) if self.second_force is None else (self.force, self.second_force)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Solution(Shown):
    """A periodic response at one frequency.

    Attributes
    ----------
    status : SolutionStatus
        Whether and why; every number below is NaN if it is NOT_CONVERGED.
    max_abs, half_peak_to_peak, mean : float
        Of the observed DOF over the period [m]. Not unique when `flags` has ``mean_undetermined``: the first
        and the last then depend on the history.
    harmonics : (H + 1,) array
        |mean| and the amplitude of each harmonic of the observed DOF [m].
    observed : (2H + 1,) array
        Its coefficients [m].
    contacts : tuple of ContactResponse
        One for each contact of the scene.
    flags : tuple of str
        ``mean_undetermined``, ``all_stuck``, ``separation`` where they apply.
    residual : float
        Relative residual of the balance.
    error_estimate : float
        Estimated error of `max_abs` by the harmonics left out and the residual [m]; of `half_peak_to_peak`
        where the mean is not determined. See `solver.accuracy`.
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

    @property
    def converged(self) -> bool:
        """Whether the numbers are a solution."""
        return self.status is not SolutionStatus.NOT_CONVERGED

    @property
    def reached(self) -> bool:
        """Whether they are, with the accuracy asked for."""
        return self.status is SolutionStatus.CONVERGED

    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""
        from solver.summaries import of_solution

        return of_solution(self)

    def to_dataset(self) -> Dataset:
        """One period in time, and the harmonics; SI units."""
        from solver.datasets import solution_dataset

        return solution_dataset(self)

    def plot(self, ax: Into = None) -> Figure:
        """Draw a period, its hysteresis loops and harmonics; `ax`: axes to draw into, else a new figure."""
        from solver.plots.motion import Motion, motion_figure

        return motion_figure(Motion.of_solution(self), ax=ax)

    def to_json(self, *, with_stability: bool = False) -> dict[str, object]:
        """Return the answer as one JSON object; on request with what `solver.stability` says, which costs."""
        if with_stability:
            from solver.floquet import stability

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
    effects : what is paid for though the scene does not call for it; see `solver.savings.Effects`.

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
    solution = describe(workspace, found, frequency_hz, begun)
    return solution if good_enough else replace(solution, status=SolutionStatus.ACCURACY_NOT_REACHED)


def describe(workspace: Workspace, found: PointSolution, frequency_hz: float, begun: float) -> Solution:
    """Turn a converged point of a frequency balance into a `Solution`."""
    balance = workspace.balance
    omega = 2.0 * math.pi * frequency_hz
    error = truncation_error(workspace, found.u, omega)
    measures = workspace.measure(found.u, omega)
    if measures is None:
        return _failure(balance, frequency_hz, found, time.perf_counter() - begun)
    contacts = contact_responses(workspace, found.u, omega)
    observed = fourier.to_full(measures.observed, balance.system.ks, balance.n_harmonics)
    flags = _flags(contacts, nothing_holds=_nothing_holds_a_part(workspace))
    return Solution(
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
        flags=flags,
        residual=found.residual,
        error_estimate=error.half_peak_to_peak if MEAN_UNDETERMINED in flags else error.max_abs,
        newton_iterations=found.iterations,
        seconds=time.perf_counter() - begun,
    )


def contact_responses(workspace: Workspace, u: Real, p: float) -> tuple[ContactResponse, ...]:
    """Return motion, force and state of every contact at a solution (u, λ = p)."""
    balance = workspace.balance
    _, point = workspace.evaluate(u, p)
    ks, top = balance.system.ks, balance.n_harmonics
    slips = fourier.to_full(u.reshape(balance.n_ports, balance.n_coefficients), ks, top)
    forces = fourier.to_full(point.F, ks, top)
    ports = [slice(first, end) for first, end in pairwise(balance.system.first_port)]
    return tuple(
        _contact(contact, int(state), slips[port], forces[port])
        for contact, state, port in zip(balance.scene.contacts, point.states, ports, strict=True)
    )


def _load(contact: AnyContact, motions: Real) -> Real:
    """Return the coefficients of N0 + N1 cos(τ + phase), and of kn v where the load moves with the parts."""
    if not isinstance(contact, FrictionContact):
        return np.zeros(3)
    N1, phase = contact.N1_value, contact.N1_phase
    load = np.array([contact.N0, N1 * math.cos(phase), -N1 * math.sin(phase)])
    if isinstance(contact, ElasticNormalContact):
        moving = contact.kn * motions[1]
        load = np.pad(load, (0, max(moving.size - load.size, 0)))
        load[: moving.size] += moving
    return load


def _contact(contact: AnyContact, state: int, motions: Real, forces: Real) -> ContactResponse:
    load, utilisation = _load(contact, motions), 1.0
    if state == STUCK and isinstance(contact, FrictionContact):
        tau = np.linspace(0.0, 2.0 * np.pi, max(360, 8 * motions.shape[1]), endpoint=False)
        limit = contact.mu * (fourier.basis(tau, (load.size - 1) // 2) @ load)
        parts = np.abs(forces @ fourier.basis(tau, (motions.shape[1] - 1) // 2).T)
        carried = parts[0]
        if isinstance(contact, PlanarContact):
            carried = parts.max(axis=0) if contact.limit == "box" else np.hypot(*parts)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(carried > 0.0, carried / limit, 0.0)
        utilisation = float(min(shares.max(), 1.0))
    elif state == SEPARATED:
        utilisation = math.nan
    return ContactResponse(
        name=contact.name, state=_STATES[state], slip=motions[0], force=forces[0], load=load,
        utilisation=utilisation,
        second_motion=motions[1] if len(motions) > 1 else None,
        second_force=forces[1] if len(forces) > 1 else None,
    )  # fmt: skip


def _nothing_holds_a_part(workspace: Workspace) -> bool:
    """Return whether a part that contacts alone hold is free to stand anywhere, where last evaluated."""
    system = workspace.balance.system
    if not np.any(system.shift > 0.0):
        return False
    fill_jacobian(workspace.system, workspace.linear, workspace.point)
    values = np.linalg.svd(evaluation_by_value(workspace.point).jacobian, compute_uv=False)
    return bool(values[-1] < FREE * values[0])


def _flags(contacts: tuple[ContactResponse, ...], *, nothing_holds: bool) -> tuple[str, ...]:
    stuck = [contact for contact in contacts if contact.state is ContactState.STUCK]
    flags = []
    if nothing_holds or any(contact.utilisation > SAFELY_STUCK for contact in stuck):
        flags.append(MEAN_UNDETERMINED)
    if stuck and len(stuck) == len(contacts):
        flags.append("all_stuck")
    if any(contact.state in _OPENS for contact in contacts):
        flags.append("separation")
    return tuple(flags)


def _failure(balance: Balance, frequency_hz: float, found: PointSolution, seconds: float) -> Solution:
    nothing = np.full(2 * balance.n_harmonics + 1, np.nan)
    return Solution(
        scene=balance.scene, frequency_hz=frequency_hz, n_harmonics=balance.n_harmonics,
        status=SolutionStatus.NOT_CONVERGED, max_abs=math.nan, half_peak_to_peak=math.nan, mean=math.nan,
        harmonics=np.full(balance.n_harmonics + 1, np.nan), observed=nothing, contacts=(), flags=(),
        residual=found.residual, error_estimate=math.nan, newton_iterations=found.iterations, seconds=seconds,
    )  # fmt: skip


def _number(value: float) -> float | None:
    """Return a float that JSON can carry (null for NaN and infinity)."""
    return float(value) if math.isfinite(value) else None
