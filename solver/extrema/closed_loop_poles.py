"""Resonances of the structure with its contacts as springs: where they are, and how narrow.

Seen from the contacts, the structure is A_k(ω) = Σ_m x_m y_mᴴ / d_m; a contact whose force answers a small
change of its motion by ĝ is a spring ĝ between the parts, complex where it dissipates. The motion resonates
where I + A_k ĝ is nearly singular. With A in modes or poles these frequencies are the eigenvalues of a
matrix of the size of the modes,

    modes:  (kω)² = eig(diag(ω_m²) + ikω diag(c_m) + Yᴴ ĝ X),     poles:  ikω = eig(diag(s_m) − Yᴴ ĝ X),

so that no resonance is missed however narrow it is. (Woodbury's identity: a change of low rank of the
structure is the same change of its modal matrix.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from solver.balance.balance import Balance
from solver.balance.parameter import Kind
from solver.contacts.kernels.system import DENSE, MODES, POLES, System
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.contact_table import port_stiffnesses

# Modes that are kept of a large structure: those nearest to the frequencies looked at.
MOST_MODES = 160
_FEW_MODES = 8  # whose eigenvalues cost no more than to tell where there are none
_MOST_ENTRIES = 2_000_000  # of the matrices that are looked at together
_FASTEST = 1e150  # rad/s; what is faster does not resonate


@dataclass(frozen=True, slots=True, kw_only=True)
class Poles:
    """Resonances of one harmonic; the last axis counts them.

    Attributes
    ----------
    at : (..., nm) array
        ω at which the harmonic meets the resonance [rad/s].
    half_width : (..., nm) array
        Half of the width at half power, in ω [rad/s].
    """

    at: Real
    half_width: Real


class ClosedLoop:
    """Resonances of a balance over the frequency, for any stiffness of its contacts.

    Parameters
    ----------
    balance : whose parameter is the frequency.
    """

    def __init__(self, balance: Balance) -> None:
        self.system: System = balance.system
        self._balance = balance

    @staticmethod
    def serves(balance: Balance) -> bool:
        """Whether the resonances of this balance can be found: over the frequency alone."""
        return balance.parameter.kind is Kind.FREQUENCY

    @cached_property
    def held(self) -> Complex:
        """Stiffness of the contacts while they stick, (nc, nc) [N/m]."""
        kt = port_stiffnesses(self._balance.scene, linear_model(self._balance.scene))
        return np.diag(kt).astype(np.complex128)

    @cached_property
    def free(self) -> dict[int, Poles]:
        """Resonances without contacts, in units of kω: number of the structure to ascending poles."""
        nothing = np.zeros_like(self.held)
        return {s: self._ascending(nothing, s) for s in range(self._structures)}

    @cached_property
    def stuck(self) -> dict[int, Poles]:
        """The same with every contact stuck; the m-th of one lies above the m-th of the other (Weyl)."""
        return {s: self._ascending(self.held, s) for s in range(self._structures)}

    @property
    def _structures(self) -> int:
        return int(self.system.which.max(initial=0)) + 1

    def _ascending(self, stiffness: Complex, s: int) -> Poles:
        system = self.system
        if system.form == MODES and not np.any(stiffness) and not np.any(system.shift):
            order = np.argsort(system.eigenvalues[s].real)
            squares = np.maximum(system.eigenvalues[s].real[order], 0.0)
            return Poles(at=np.sqrt(squares), half_width=0.5 * system.dampings[s][order])
        found = self._of(stiffness[None], s, None)
        order = np.argsort(found.at[0])
        return Poles(at=found.at[0][order], half_width=found.half_width[0][order])

    def of_harmonic(self, stiffness: Complex, i: int, omega: Real) -> Poles:
        """Return the resonances that harmonic number i meets.

        Parameters
        ----------
        stiffness : (P, nc, nc) of the contacts against small changes of harmonic number i [N/m].
        i : of `System.ks`, not the mean.
        omega : (P,) the frequency [rad/s] near which they are wanted.

        Returns
        -------
        (P, nm) poles.
        """
        k = float(self.system.ks[i])
        found = self._of(stiffness, int(self.system.which[i]), k * omega)
        return Poles(at=found.at / k, half_width=found.half_width / k)

    def _of(self, stiffness: Complex, s: int, speeds: Real | None) -> Poles:
        """Return the resonances in units of kω.

        `speeds` (P,) is the kω that damping is taken at; None for contacts that are springs alone, whose
        resonances have the damping of their modes to first order.
        """
        system = self.system
        moved = stiffness - np.diag(system.shift)
        if system.form == DENSE:
            return self._dense(moved, s)
        values, dampings, X, Y, moved = self._kept(s, moved)
        if system.form == MODES and speeds is None:
            squares, shapes = np.linalg.eigh(_coupled(values, None, X, Y, moved))
            half_width = 0.5 * np.einsum("pnm,n->pm", np.abs(shapes) ** 2, dampings)
            return Poles(at=np.sqrt(np.maximum(squares, 0.0)), half_width=half_width)
        if system.form == POLES:
            found = np.linalg.eigvals(_coupled(values, None, X, -Y, moved))
            # Of each conjugate pair the one above; what does not oscillate has no resonance.
            return Poles(at=np.where(found.imag > 0.0, found.imag, _FASTEST), half_width=np.abs(found.real))
        turning: Complex | None = None
        if speeds is not None:
            turning = np.asarray(1j * speeds[:, None] * dampings, np.complex128)
        roots = np.sqrt(np.linalg.eigvals(_coupled(values, turning, X, Y, moved)))
        return Poles(at=np.abs(roots.real), half_width=np.abs(roots.imag))

    def may_meet(self, stiffness: Complex, i: int, omega: Real, reach: Real) -> NDArray[np.bool_]:
        """Return whether harmonic number i may meet a resonance within `reach` (P,) of ω; else as above.

        No eigenvalue of H is nearer to z than 1 / ‖(z − H)⁻¹‖, and an inverse costs far less than they do.
        A resonance is meant whose half width is at most half of `reach`.
        """
        system, s, k = self.system, int(self.system.which[i]), float(self.system.ks[i])
        may = np.ones(len(omega), bool)
        if system.form == DENSE or system.eigenvalues[s].size <= _FEW_MODES:
            return may
        values, dampings, X, Y, moved = self._kept(s, stiffness - np.diag(system.shift))
        parts = 1 + len(omega) * values.size**2 // _MOST_ENTRIES
        for some in np.array_split(np.arange(len(omega)), parts):
            speeds, near = k * omega[some], math.hypot(1.0, 0.5) * k * reach[some]
            if system.form == POLES:
                left, place = _coupled(values, None, X, -Y, moved[some]), 1j * speeds
            else:
                turning = np.asarray(1j * speeds[:, None] * dampings, np.complex128)
                left = _coupled(values, turning, X, Y, moved[some])
                place, near = speeds**2 + 0j, near * (2.0 * speeds + near)
            diagonal = np.arange(values.size)
            left[:, diagonal, diagonal] -= place[:, None]
            try:
                size = np.linalg.norm(np.linalg.inv(left), axis=(1, 2))
            except np.linalg.LinAlgError:
                continue  # exactly at a resonance
            may[some] = ~(near * size < 1.0)
        return may

    def _kept(self, s: int, moved: Complex) -> tuple[Complex, Real, Complex, Complex, Complex]:
        """Return eigenvalues, dampings, contact modes and duals of the modes kept, and their stiffness.

        Of very many modes the slowest are kept; the others give way like springs in series with the contacts.
        """
        system = self.system
        values, dampings = system.eigenvalues[s], system.dampings[s]
        X, Y = system.contact_modes[s], system.contact_duals[s]
        if values.size <= MOST_MODES:
            return values, dampings, X, Y, moved
        modes = system.form == MODES
        order = np.argsort(np.abs(values), kind="stable")
        kept, rest = np.sort(order[:MOST_MODES]), order[MOST_MODES:]
        flexibility = (X[:, rest] / (values[rest] if modes else -values[rest])) @ Y[:, rest].T
        series = moved @ np.linalg.inv(np.eye(len(flexibility)) + flexibility @ moved)
        return values[kept], dampings[kept], X[:, kept], Y[:, kept], series

    def _dense(self, moved: Complex, s: int) -> Poles:
        """Return the resonances of full matrices: eigenvalues of the first-order form."""
        system = self.system
        n = system.observe.size
        L = system.L[s]
        inverse = np.linalg.inv(system.M[s])
        at, half_width = [], []
        for one in moved:
            K = system.K[s] + L.conj().T @ one @ L
            state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ system.C[s]]])
            values = linalg.eigvals(state)
            at.append(np.where(values.imag > 0.0, values.imag, _FASTEST))
            half_width.append(np.abs(values.real))
        return Poles(at=np.array(at), half_width=np.array(half_width))


def _coupled(values: Complex, more: Complex | None, X: Complex, Y: Complex, moved: Complex) -> Complex:
    """Return diag(values + more) + Yᵀ · moved · X, (P, nm, nm)."""
    coupled = Y.T @ moved @ X
    diagonal = np.arange(values.size)
    coupled[:, diagonal, diagonal] += values if more is None else values + more
    return np.asarray(coupled, np.complex128)
