"""Exact derivatives of the amplitude at a point of a frequency response by any parameters, first and second.

One factorisation and one adjoint (`solver.sensitivity.kernels.adjoint`) give the derivatives by frequency and
excitation and by the numbers of every contact, and each parameter path is a row of weights of those. A
structural path needs the whole motion x = Z⁻¹ (f − Lᴴ F) and the adjoint motion y of every harmonic: −Re yᵀ
(∂Z/∂q) x.

With the Lagrangian L = ξ x(τ) + λᵀ r of `solver.sensitivity.kernels.adjoint`, stationary in u and τ, the
amplitude has the second derivatives of L along the directions v_i = (du/dP_i, e_i, dτ/dP_i), P = (ω, p_1, …):

    H_ij = −Re yᵀ (Z_i x_j + Z_j x_i + Z_ij x − f_ij) + w·F_ij − q_i q_j / (ξ x''(τ)),

with the whole motion x = Z⁻¹ φ of every harmonic, its derivatives x_i along v_i, the adjoint motion y, the
weights w of the forces, w·F_ij their second derivative along v_i and v_j, and q_i = ξ dx'(τ)/dP_i. A function
g of several extremes e has such a last term of each, times its ∂g/∂e, and Σ ∂²g/∂e∂e' e_i e'_j. Where the
amplitude is stationary in ω the peak A(p) has the Hessian H_pp − H_pω H_ωp/H_ωω, and ω* drifts by −H_pω/H_ωω.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, Kind
from solver.balance.contact_hessian import (
    ContactForces,
    check_laws,
    check_loads,
    check_no_line,
    contact_forces,
    second_forces,
    second_numbers,
)
from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.jacobian import factorise, step_back, step_back_transposed
from solver.balance.parameter_derivatives import (
    check_smooth_structure,
    contact_slopes,
    excitation_slopes,
    force_along,
    matrices_of_paths,
    modal_dampings,
    resolved,
)
from solver.balance.whole_motion import WholeMotion, times, times_transposed, whole_motion
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.system import FROM_REST, UTILISED, evaluation_by_value
from solver.contacts.laws.load_harmonics import second_loads
from solver.errors import SettingError
from solver.jit.fourier import Complex, Integer, Real
from solver.results.told import Piece
from solver.scene.scene_harmonics import Amplitudes
from solver.sensitivity.kernels.adjoint import (
    AMPLITUDE,
    BESIDES,
    BY_KT,
    BY_LEVEL,
    BY_LOAD,
    BY_MU,
    BY_OMEGA,
    BY_PHASE,
    EXTREME_COLUMNS,
    SIGN,
    TAU,
    amplitude_slopes,
)

STATIONARY = 1e-10  # largest share of a peak's height that a solution may lie below it

TWO_PI = 2.0 * math.pi
_KINK = 1e-8  # relative difference of the slopes of max x and −min x beyond which a parameter parts them


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakHessian(Piece):
    """A peak that moves with its parameters, to second order.

    Drift and Hessian are NaN where the peak is not a smooth maximum over the frequency: at a kink (a contact
    changes state there), at an end of the band, or where the solution is not at the peak.
    """

    value: Annotated[float, "max|x| at the peak [m]."]
    gradient: Annotated[Real, "d peak / dp [m per unit], (n,)."]
    drift: Annotated[Real, "d frequency / dp [Hz per unit], (n,)."]
    hessian: Annotated[Real, "d² peak / dp² [m per both units], (n, n)."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class EdgeHessian(Piece):
    """A band edge, where the amplitude equals a limit, to second order."""

    gradient: Annotated[Real, "d frequency / dp [Hz per unit], (n,)."]
    hessian: Annotated[Real, "d² frequency / dp² [Hz per both units], (n, n)."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AmplitudeHessian(Piece):
    """The amplitude at a solution to second order in frequency and parameters; NaN where it has no such."""

    value: Annotated[float, "max|x| of the observed DOF [m]."]
    by_frequency: Annotated[float, "[m/Hz]."]
    gradient: Annotated[Real, "At a fixed frequency [m per unit], (n,)."]
    by_frequency_twice: Annotated[float, "[m/Hz²]."]
    mixed: Annotated[Real, "By the frequency and each parameter [m/Hz per unit], (n,)."]
    hessian: Annotated[
        Real, "At a fixed frequency, that of a peak at an end of the band [m per both units], (n, n)."
    ]

    def of_peak(self) -> PeakHessian:
        """Return the same of the peak, where the amplitude is stationary in the frequency."""
        bend, drift = self.by_frequency_twice, np.full(self.mixed.shape, math.nan)
        # What a step to the stationary point would still gain; at a kink the slope does not vanish.
        if bend < 0.0 and self.by_frequency**2 <= -2.0 * bend * STATIONARY * self.value:
            drift = -self.mixed / bend
        return PeakHessian(
            value=self.value, gradient=self.gradient, drift=drift,
            hessian=self.hessian + np.outer(self.mixed, drift),
        )  # fmt: skip

    def times_frequency(self, at_hz: float) -> AmplitudeHessian:
        """Return the same of the number times the frequency, such as of power for work in a period."""
        return AmplitudeHessian(
            value=at_hz * self.value, by_frequency=at_hz * self.by_frequency + self.value,
            gradient=at_hz * self.gradient,
            by_frequency_twice=at_hz * self.by_frequency_twice + 2.0 * self.by_frequency,
            mixed=at_hz * self.mixed + self.gradient, hessian=at_hz * self.hessian,
        )  # fmt: skip

    def of_edge(self, dlimit: Real | None = None, ddlimit: Real | None = None) -> EdgeHessian:
        """Return the same of the frequency where the amplitude equals a limit, from a(ω(p), p) = limit(p).

        Parameters
        ----------
        dlimit, ddlimit : (n,), (n, n) derivatives of the limit by the parameters; it is fixed if left out.
        """
        if self.by_frequency == 0.0:
            return EdgeHessian(gradient=self.gradient * math.nan, hessian=self.hessian * math.nan)
        first = (0.0 if dlimit is None else dlimit) - self.gradient
        gradient = first / self.by_frequency
        both = np.outer(self.mixed, gradient)
        moved = both + both.T + self.by_frequency_twice * np.outer(gradient, gradient)
        second = (0.0 if ddlimit is None else ddlimit) - self.hessian - moved
        return EdgeHessian(gradient=gradient, hessian=second / self.by_frequency)


def hessian_of(value: float, by_omega: float, gradient: Real, twice: Real) -> AmplitudeHessian:
    """Return a number with its derivatives by ω and the paths, `twice` (1 + n, 1 + n) by both."""
    return AmplitudeHessian(
        value=value, by_frequency=by_omega * TWO_PI, gradient=gradient, mixed=twice[0, 1:] * TWO_PI,
        by_frequency_twice=float(twice[0, 0]) * TWO_PI**2, hessian=twice[1:, 1:],
    )  # fmt: skip


def no_hessian(n: int) -> AmplitudeHessian:
    """Return NaN for `n` parameters, where the balance is singular."""
    return hessian_of(math.nan, math.nan, np.full(n, math.nan), np.full((n + 1, n + 1), math.nan))


@dataclass(frozen=True, slots=True, kw_only=True)
class Directions:
    """What each of P parameters changes; the first is ω, the others are paths."""

    slopes: Annotated[Real, "Derivatives of the contact table, (P, nc, COLUMNS)."]
    loads: Annotated[Real, "Derivatives of the loads, (P, nc, 3)."]
    level: Annotated[Real, "Relative change of all forces, (P,)."]
    phase: Annotated[Real, "Turn of all that are not static [rad], (P,)."]


@dataclass(frozen=True, slots=True, kw_only=True)
class Responses:
    """The solution and its derivatives along each of P parameters."""

    x: Annotated[Complex, "The whole motion of each harmonic, (nk, N)."]
    dx: Annotated[Complex, "Its derivatives, (P, nk, N)."]
    dU: Annotated[Real, "Those of the slip motions [m], (P, nc, n)."]


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjoint:
    """What the amplitude weighs: weights of the contact forces, the adjoint motion of each harmonic."""

    w: Annotated[Real, "(nc, n)."]
    y: Annotated[Complex, "(nk, N)."]
    turns: Annotated[Complex, "ξ e^{ikτ} at each extremum that counts, (ne, nk)."]
    by: Annotated[Real, "Derivatives of the measure by these extremes, (ne,)."]
    by_twice: Annotated[Real, "Its second ones, (ne, ne)."]


def lagrangian_hessian(
    ks: Integer,
    motion: WholeMotion,
    contacts: ContactForces,
    along: Directions,
    found: Responses,
    adjoint: Adjoint,
) -> Real:
    """Return the second derivatives of the amplitude by ω and the paths, (P, P), inside units."""
    y, x = adjoint.y, found.x
    pulled = np.zeros(found.dx.shape, np.complex128)
    pulled[0] = times_transposed(motion.by_omega, y)
    for i, (by_q, _) in motion.by_structure.items():
        pulled[i + 1] = times_transposed(by_q, y)
    hessian = -np.einsum("ikn,jkn->ij", pulled, found.dx).real
    hessian += hessian.T
    hessian[0, 0] -= _dot(y, times(motion.by_omega_twice, x))
    for i, (_, by_both) in motion.by_structure.items():
        both = _dot(y, times(by_both, x))
        hessian[0, i + 1] -= both
        hessian[i + 1, 0] -= both
    twice = second_forces(ks, motion.forces, along.level, along.phase)
    hessian += np.einsum("kn,ijkn->ij", y, twice).real
    hessian += contacts_along(contacts, along, found.dU, adjoint.w)
    moved = np.einsum("ek,kn,ikn->eik", adjoint.turns, motion.observe, found.dx)
    bends = -(ks**2 * adjoint.turns * np.einsum("kn,kn->k", motion.observe, x)).sum(axis=1).real
    for by, q, bend in zip(adjoint.by, (1j * ks * moved).sum(axis=2).real, bends, strict=True):
        hessian -= by * np.outer(q, q) / bend if bend != 0.0 else 0.0
    firsts = moved.sum(axis=2).real
    hessian += firsts.T @ adjoint.by_twice @ firsts
    return np.asarray(0.5 * (hessian + hessian.T))


def _dot(y: Complex, x: Complex) -> float:
    """Return Re yᵀ x over all harmonics."""
    return float(np.einsum("kn,kn->", y, x).real)


def contacts_along(contacts: ContactForces, along: Directions, dU: Real, w: Real) -> Real:
    """Return w·F_ij of all contacts along the directions."""
    pulls = np.einsum("cn,cnm->cm", w, contacts.dF_dN)
    twice = second_loads(contacts.system.contacts, along.slopes)
    total = np.einsum("cm,ijcm->ij", pulls, twice[:, :, contacts.system.owner])
    for e in range(along.slopes.shape[1]):
        ports, slopes, loads = contacts.ports(e), along.slopes[:, e], along.loads[:, e]
        acting = np.flatnonzero(np.any(slopes != 0.0, axis=0))
        for i in range(dU.shape[0]):
            by_U, by_row, by_load = contacts.second(e, w[ports], dU[i, ports], slopes[i], loads[i])
            total[i] += np.einsum("pan,an->p", dU[:, ports], by_U) + loads @ by_load
            for column in acting:
                acts = slopes[:, column] != 0.0
                total[i, acts] += by_row[column] * slopes[acts, column]
    return np.asarray(total)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Gradient(Piece):
    """The amplitude at a solution with its derivatives, all others held fixed; NaN where it is singular."""

    value: Annotated[float, "max|x| of the observed DOF [m]."]
    by_frequency: Annotated[float, "[m/Hz]."]
    by_parameters: Annotated[Real, "At a fixed frequency [m per unit of each], (n_paths,)."]


class Sensitivities:
    """Derivatives of what is measured at points of one frequency response, by parameter paths.

    Parameters
    ----------
    balance : of a frequency response.
    paths : parameter paths of its scene; groups too.

    Raises
    ------
    SettingError
        The balance continues something else, or its contact forces come from samples; an unknown path, or one
        that calls for even harmonics the balance left out.
    """

    def __init__(self, balance: Balance, paths: Sequence[str]) -> None:
        if balance.parameter.kind is not Kind.FREQUENCY:
            raise SettingError("balance", balance.parameter.path, "must continue in the frequency")
        if balance.system.samples > 0:
            raise SettingError("balance", balance.system.samples, "must have contact forces in closed form")
        self.balance, self.paths = balance, tuple(paths)
        self._parameters = resolved(balance, paths)
        self._slopes, self._loads = contact_slopes(balance, self._parameters)
        self._each = BY_LOAD + self._loads.shape[2]
        self._rows = self._rows_of_paths()
        self._matrices = matrices_of_paths(balance, self._parameters)
        self._dampings = modal_dampings(balance, self._parameters)
        self._amplitudes = Amplitudes(balance.system.ks)
        self._workspace = Workspace.of(balance)
        self._point = evaluation_by_value(self._workspace.point)
        ne, nc, n = balance.system.laws.size, balance.n_ports, balance.n_coefficients
        acts = np.any(self._slopes != 0.0, axis=(0, 2))
        self._wanted = (acts & (balance.system.jenkins == 1)).astype(np.int64)
        self._others = np.flatnonzero(acts & (balance.system.jenkins == 0))
        self._x, self._tops = np.zeros(n), np.zeros((2, EXTREME_COLUMNS))
        self._turns = np.zeros((2, balance.system.ks.size), np.complex128)
        self._weights, self._pulls = np.zeros((2, nc, n)), np.zeros((2, nc * n))
        self._by = np.zeros((2, ne * self._each + BESIDES))
        self._seconds: Integer | None = None

    def gradient(self, solution: Real, at_hz: float) -> Gradient:
        """Return the amplitude and its derivatives at a solution.

        Parameters
        ----------
        solution : (n_unknowns,) slip motions [m], converged.
        at_hz : their frequency [Hz].

        Where max x and −min x are the same, the derivatives are those of the one that leads onward.
        """
        found = self._slopes_of(np.ascontiguousarray(solution, dtype=np.float64), TWO_PI * at_hz)
        if not found:
            nothing = np.full(len(self.paths), math.nan)
            return Gradient(value=math.nan, by_frequency=math.nan, by_parameters=nothing)
        by_frequency, by_parameters = found[0]
        for other_frequency, other_parameters in found[1:]:
            by_frequency = max(by_frequency, other_frequency)
            by_parameters = np.maximum(by_parameters, other_parameters)
        return Gradient(
            value=float(self._tops[0, AMPLITUDE]), by_frequency=by_frequency * TWO_PI,
            by_parameters=by_parameters,
        )  # fmt: skip

    def hessian(self, solution: Real, at_hz: float) -> AmplitudeHessian:
        """Return the amplitude to second order in the frequency and all parameters.

        Parameters
        ----------
        solution : (n_unknowns,) slip motions [m], converged.
        at_hz : their frequency [Hz].

        Rows and columns of a parameter are NaN where the amplitude has a kink by it (it breaks a symmetry in
        which max x = −min x), and of a load or friction coefficient where that coefficient is 0.

        Raises
        ------
        SettingError
            A contact whose law has no second derivatives, paths of one load that contradict each other, or
            paths on which loads or places of contacts do not depend linearly.
        """
        everything = self._moved(solution, at_hz)
        found = self._slopes_of(np.ascontiguousarray(solution, dtype=np.float64), TWO_PI * at_hz)
        if everything is None or not found:
            return no_hessian(len(self.paths))
        y, (turns, by, by_twice) = self._adjoint_motion(everything[0], 0), self._extremes()
        adjoint = Adjoint(w=self._weights[0].copy(), y=y, turns=turns, by=by, by_twice=by_twice)
        try:
            twice = lagrangian_hessian(self._amplitudes.ks, *everything, adjoint)
        except FloatingPointError:
            return no_hessian(len(self.paths))
        by_frequency, gradient = found[0]
        for _, other in found[1:]:
            kinks = np.flatnonzero(np.abs(other - gradient) > _KINK * np.abs(gradient).clip(np.abs(other)))
            twice[kinks + 1], twice[:, kinks + 1] = math.nan, math.nan
        return hessian_of(float(self._tops[0, AMPLITUDE]), by_frequency, gradient, twice)

    def of_contacts(self, solution: Real, at_hz: float, pairing: Real) -> AmplitudeHessian:
        """Return Σ F_c·(P_c U_c) over the ports to second order in the frequency and all parameters.

        With the adjoint λ of this number, (∂r/∂U)ᵀ λ = −(Pᵀ F + ∂F/∂Uᵀ P U), its Lagrangian has second
        derivatives as that of an amplitude (`solver.sensitivity.gradient`), and those of the pairs besides:
        F_i·P U_j + F_j·P U_i.

        Parameters
        ----------
        solution : (n_unknowns,) slip motions [m], converged.
        at_hz : their frequency [Hz].
        pairing : P, (nc, n, n), such as that of friction work.

        Raises
        ------
        SettingError
            As `hessian`.
        """
        everything = self._moved(solution, at_hz)
        if everything is None:
            return no_hessian(len(self.paths))
        motion, contacts, along, found = everything
        system, workspace = self.balance.system, self._workspace
        U, F = contacts.U, contacts.F
        by_F, by_U = np.einsum("cij,cj->ci", pairing, U), np.einsum("cij,ci->cj", pairing, F)
        pull = -(by_U + contacts.times_transposed(by_F)).reshape(-1)
        step_back_transposed(workspace.system, workspace.point, pull)
        pulls = self._amplitudes.of(pull.reshape(U.shape)).conj()
        y = motion.solve_transposed(-np.einsum("kcn,ck->kn", motion.contact, pulls))
        through = self._amplitudes.coefficients(-np.einsum("kcn,kn->ck", motion.back, y).conj())
        none = np.zeros(0)
        adjoint = Adjoint(
            w=by_F + through, y=y, turns=np.zeros((0, system.ks.size), np.complex128), by=none,
            by_twice=np.zeros((0, 0)),
        )  # fmt: skip
        dU, dF = found.dU, contacts.times(found.dU) + contacts.along(along.slopes, along.loads)
        pairs = np.einsum("pci,cij,qcj->pq", dF, pairing, dU)
        twice = lagrangian_hessian(self._amplitudes.ks, motion, contacts, along, found, adjoint)
        twice = twice + pairs + pairs.T
        slopes = np.einsum("ci,pci->p", by_F, dF) + np.einsum("ci,pci->p", by_U, dU)
        return hessian_of(float(np.sum(F * by_F)), float(slopes[0]), slopes[1:], twice)

    def motions(self, solution: Real, at_hz: float) -> Real | None:
        """Return the derivatives of all slip motions by ω [m s/rad] and by the paths, (1 + n_paths, nc, n).

        None where the balance is singular; raises SettingError as `hessian`.
        """
        everything = self._moved(solution, at_hz)
        return None if everything is None else everything[3].dU

    def forces(self, solution: Real, at_hz: float) -> Real | None:
        """Return the derivatives of the forces of all contacts, as `motions`."""
        everything = self._moved(solution, at_hz)
        if everything is None:
            return None
        _, contacts, along, found = everything
        return np.asarray(contacts.times(found.dU) + contacts.along(along.slopes, along.loads))

    def _moved(
        self, solution: Real, at_hz: float
    ) -> tuple[WholeMotion, ContactForces, Directions, Responses] | None:
        """Return linear part, contacts and what ω and every path move; None where that is singular."""
        if self._seconds is None:
            self.check_second()
            check_loads(self.balance.system, self._parameters, self._slopes)
            self._seconds = second_numbers(self.balance.scene)
        u, omega = np.ascontiguousarray(solution, dtype=np.float64), TWO_PI * at_hz
        try:
            motion = whole_motion(self.balance.system, self._matrices, self._dampings, omega)
            level, phase = excitation_slopes(self.balance, self._parameters)
            along = Directions(
                slopes=np.concatenate([np.zeros((1, *self._slopes.shape[1:])), self._slopes]),
                loads=np.concatenate([np.zeros((1, *self._loads.shape[1:])), self._loads]),
                level=np.append(0.0, level), phase=np.append(0.0, phase),
            )  # fmt: skip
            contacts = contact_forces(self.balance.system, self._seconds, u)
            found = self._responses(u, omega, motion, contacts, along)
        except (np.linalg.LinAlgError, FloatingPointError):
            return None
        return None if found is None else (motion, contacts, along, found)

    def check_second(self) -> None:
        """Raise SettingError where laws or paths have no exact second derivatives here."""
        check_laws(self.balance.scene)
        check_no_line(self.balance.scene)
        check_smooth_structure(self.balance.scene, self._parameters)

    def peak_hessian(self, solution: Real, at_hz: float) -> PeakHessian:
        """Return a peak, where the amplitude is stationary in the frequency, to second order; as `hessian`.

        Of a peak at an end of the band, which does not move, `hessian` is the answer.
        """
        return self.hessian(solution, at_hz).of_peak()

    def _slopes_of(self, u: Real, omega: float) -> list[tuple[float, Real]]:
        """Return the derivatives by ω and by the paths of each extreme that is max|x|; none if singular."""
        count = amplitude_slopes(
            self._workspace.system, self._workspace.linear, u, omega, self._workspace.point, self._wanted,
            self._x, self._tops, self._turns, self._weights, self._pulls, self._by,
        )  # fmt: skip
        return [self._one(u, omega, top) for top in range(count)]

    def _extremes(self) -> tuple[Complex, Real, Real]:
        """Return the turns of max x and −min x, or of one, and derivatives of what is measured by them."""
        system = self.balance.system
        if system.centred == FROM_REST:
            return self._turns[:1].copy(), np.ones(1), np.zeros((1, 1))
        turns = self._tops[:, SIGN, None] * np.exp(1j * np.outer(self._tops[:, TAU], system.ks))
        by_half, by_mean, seconds = 1.0, 0.0, [0.0, 0.0, 0.0]
        if system.centred == UTILISED:
            high, low = (turns @ self._amplitudes.of(self._x)).real
            _, by_half, by_mean, *seconds = utilisation(system.haigh, high, -low)
        both = 0.5 * np.array([[1.0, 1.0], [1.0, -1.0]])  # half the range, and the mean, of max x and −min x
        by = np.array([by_half, by_mean]) @ both
        return turns, by, both.T @ np.array(seconds)[[[0, 1], [1, 2]]] @ both

    def _responses(
        self, u: Real, omega: float, motion: WholeMotion, contacts: ContactForces, along: Directions
    ) -> Responses | None:
        """Return the derivatives of the solution along ω and every path; None where dr/du is singular.

        With v_i = Z⁻¹ (f_i − Lᴴ ∂F/∂p_i − Z_i x) the slip motions obey dr/du U_i = L v_i.
        """
        workspace, amplitudes, shift = self._workspace, self._amplitudes, self.balance.system.shift[:, None]
        if not math.isfinite(workspace.forces(u, omega)[0]):
            return None
        if factorise(workspace.system, workspace.linear, workspace.point, u, 0.0, 0.0) == 0.0:
            return None
        forces = amplitudes.of(contacts.F - shift * contacts.U)
        x = motion.solve(motion.forces - motion.pushed(forces))
        moving = amplitudes.ks > 0
        scaled = moving if self.balance.system.constant_mean else np.ones(moving.shape)
        rates = along.level[:, None] * scaled + 1j * along.phase[:, None] * moving
        pushes = rates[:, :, None] * motion.forces
        pushes -= motion.pushed(amplitudes.of(contacts.along(along.slopes, along.loads)))
        pushes[0] -= times(motion.by_omega, x)
        for i in motion.by_structure:
            pushes[i + 1] += motion.push(i, x, forces)
        v = motion.solve(pushes)
        dU = amplitudes.coefficients(motion.relative(v))
        for row in dU.reshape(len(dU), u.size):
            step_back(workspace.system, workspace.point, row)
        dF = contacts.times(dU) - shift * dU
        return Responses(x=x, dx=v - motion.solve(motion.pushed(amplitudes.of(dF))), dU=dU)

    def _one(self, u: Real, omega: float, top: int) -> tuple[float, Real]:
        """Return the derivatives of one extreme by ω and by the paths."""
        by = self._by[top]
        slopes = self._rows @ by
        by_omega = float(by[self.balance.system.laws.size * self._each + BY_OMEGA])
        for e in self._others:
            self._add_other_law(int(e), u, omega, self._weights[top], slopes)
        if self._matrices is not None or self._dampings:
            self._add_structure(u, omega, top, slopes)
        return by_omega, slopes

    def _rows_of_paths(self) -> Real:
        """Return what each path takes of the derivatives the kernel gives, (n_paths, ·)."""
        system, ne = self.balance.system, self.balance.system.laws.size
        rows = np.zeros((len(self._parameters), ne * self._each + BESIDES))
        parts = rows[:, : ne * self._each].reshape(len(rows), ne, self._each)
        plain = system.jenkins == 1
        parts[:, plain, BY_KT] = self._slopes[:, plain, KT]
        parts[:, plain, BY_MU] = self._slopes[:, plain, MU]
        parts[:, plain, BY_LOAD:] = self._loads[:, plain]
        level, phase = excitation_slopes(self.balance, self._parameters)
        rows[:, ne * self._each + BY_LEVEL], rows[:, ne * self._each + BY_PHASE] = level, phase
        return rows

    def _add_other_law(self, e: int, u: Real, omega: float, weights: Real, slopes: Real) -> None:
        """Add w·∂F/∂p of an element that follows another law: its force once for each path that acts."""
        ports, n = slice(*self.balance.system.first_port[e : e + 2].tolist()), self.balance.n_coefficients
        motions = u[ports.start * n : ports.stop * n].reshape(-1, n)
        for i in np.flatnonzero(np.any(self._slopes[:, e] != 0.0, axis=1)):
            along = self._slopes[i, e], self._loads[i, e]
            _, dF_dp, _ = force_along(self.balance, self._point, e, motions, omega, *along)
            slopes[i] += float(np.sum(weights[ports] * dF_dp))

    def _add_structure(self, u: Real, omega: float, top: int, slopes: Real) -> None:
        """Add Re yᵀ (∂f/∂q − (∂L/∂q)ᴴ F − (∂Z/∂q) x) − Re λᵀ (∂L/∂q) x of every harmonic."""
        try:
            motion = whole_motion(self.balance.system, self._matrices, self._dampings, omega)
        except np.linalg.LinAlgError:
            slopes[[p.kind is Kind.STRUCTURE for p in self._parameters]] = math.nan
            return
        shifted = self._point.F - self.balance.system.shift[:, None] * u.reshape(self._weights[top].shape)
        forces = self._amplitudes.of(shifted)
        x = motion.solve(motion.forces - motion.pushed(forces))
        y = self._adjoint_motion(motion, top)
        for i in motion.by_structure:
            slopes[i] += np.vdot(y.conj(), motion.push(i, x, forces)).real
            moved = motion.moved(i, x)
            if moved is not None:
                pulls = self._amplitudes.of(self._pulls[top].reshape(self._weights[top].shape))
                slopes[i] -= np.vdot(pulls, moved).real

    def _adjoint_motion(self, motion: WholeMotion, top: int) -> Complex:
        """Return y = Z⁻ᵀ η, η the weights of the motion in the amplitude and the balance."""
        pulls = self._amplitudes.of(self._pulls[top].reshape(self._weights[top].shape)).conj()
        return motion.solve_transposed(motion.seen(self._turns[top], pulls))
