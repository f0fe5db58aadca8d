"""The exact Hessian of the amplitude at a point of a frequency response, and of a peak.

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
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.contact_hessian import ContactForces, second_forces
from solver.balance.whole_motion import WholeMotion, times, times_transposed
from solver.contacts.laws.load_harmonics import second_loads
from solver.jit.fourier import Complex, Integer, Real
from solver.results.told import Piece

TWO_PI = 2.0 * math.pi
STATIONARY = 1e-10  # largest share of a peak's height that a solution may lie below it


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
