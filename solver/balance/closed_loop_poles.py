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
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.balance.balance import Kind
from solver.contacts.kernels.system import DENSE, MODES, POLES, System
from solver.jit.fourier import Complex, Flags, Integer, Real

if TYPE_CHECKING:
    from solver.balance.balance import Balance

# Modes that are kept of a large structure: those nearest to the frequencies looked at.
MOST_MODES = 160
_FEW_MODES = 2  # whose eigenvalues cost no more than to tell where there are none
_MOST_ENTRIES = 2_000_000  # of the matrices that are looked at together
_Spring = tuple[int, float, bytes]  # structure, kω, and the stiffness of its contacts
_FASTEST = 1e150  # rad/s; what is faster does not resonate


@dataclass(frozen=True, slots=True, kw_only=True)
class Poles:
    """Resonances of one harmonic; the last axis counts them."""

    at: Annotated[Real, "ω at which the harmonic meets the resonance [rad/s], (..., nm)."]
    half_width: Annotated[Real, "Half of the width at half power, in ω [rad/s], (..., nm)."]


class ClosedLoop:
    """Resonances of a balance over the frequency, for any stiffness of its contacts.

    Parameters
    ----------
    balance : whose parameter is the frequency.
    like : of the same scene with other harmonics; what is known there of the same structures is taken over.
    """

    def __init__(self, balance: Balance, like: ClosedLoop | None = None) -> None:
        self.system: System = balance.system
        self._balance = balance
        same = like is not None and like.system.eigenvalues is self.system.eigenvalues
        self._like = like if same and self.system.form != DENSE else None
        self._poles: dict[_Spring, tuple[Real, Real]] = {}
        self._nearness: dict[_Spring, float] = {}

    @staticmethod
    def serves(balance: Balance) -> bool:
        """Whether the resonances of this balance can be found: over the frequency alone."""
        return balance.parameter.kind is Kind.FREQUENCY

    @cached_property
    def held(self) -> Complex:
        """Stiffness of the contacts while they stick, (nc, nc) [N/m]."""
        if self._like is not None:
            return self._like.held
        return np.diag(self._balance.model.port_stiffnesses).astype(np.complex128)

    @cached_property
    def free(self) -> Poles:
        """Resonances without contacts, in units of kω: (ns, nm) ascending poles of every structure."""
        if self._like is not None:
            return self._like.free
        system = self.system
        if system.form == MODES and not np.any(system.shift):
            squares = system.eigenvalues.real
            # As many as are kept with springs.
            order = np.arange(len(squares))[:, None], np.argsort(squares, axis=1)[:, :MOST_MODES]
            at = np.sqrt(np.maximum(squares[order], 0.0))
            return Poles(at=at, half_width=0.5 * system.dampings[order])
        return self._ascending(np.zeros_like(self.held))

    @cached_property
    def stuck(self) -> Poles:
        """The same with every contact stuck; the m-th of one lies above the m-th of the other (Weyl)."""
        if self._like is not None:
            return self._like.stuck
        return self._ascending(self.held)

    @cached_property
    def range(self) -> tuple[Real, Real, Real]:
        """Where resonances may stand, from and to, in units of kω, and the least half width; (ns, nm) each.

        Contacts that are springs between nothing and full stick move the m-th resonance at most from its
        place with all contacts free to that with all stuck (Weyl's inequalities), and do not narrow it.
        """
        free, stuck = self.free, self.stuck
        half_width = np.minimum(free.half_width, stuck.half_width)
        if not np.all(self.system.jenkins == 1) or self._balance.model.extra is not None:
            return np.zeros_like(free.at), np.full_like(free.at, np.inf), half_width
        return free.at, np.maximum(stuck.at, free.at), half_width

    def _ascending(self, stiffness: Complex) -> Poles:
        structures = np.arange(len(self.system.K if self.system.form == DENSE else self.system.eigenvalues))
        found = self._of(np.broadcast_to(stiffness, (structures.size, *stiffness.shape)), structures, None)
        order = structures[:, None], np.argsort(found.at, axis=1)
        return Poles(at=found.at[order], half_width=found.half_width[order])

    def of_harmonics(self, stiffness: Complex, numbers: Integer, omega: Real) -> Poles:
        """Return the resonances that harmonics meet.

        Parameters
        ----------
        stiffness : (P, nc, nc) of the contacts against small changes of the harmonic [N/m].
        numbers : (P,) of the harmonics in `System.ks`, not the mean.
        omega : (P,) the frequency [rad/s] near which they are wanted.

        Returns
        -------
        (P, nm) poles.
        """
        k, which = self.system.ks[numbers].astype(np.float64), self.system.which[numbers]
        keys = _springs(stiffness, which, k * omega)
        new = _first_of_new(keys, self._poles)
        if new:
            found = self._of(stiffness[new], which[new], k[new] * omega[new])
            self._poles |= {keys[row]: (found.at[j], found.half_width[j]) for j, row in enumerate(new)}
        at, half_width = (np.array([self._poles[key][side] for key in keys]) for side in (0, 1))
        return Poles(at=at / k[:, None], half_width=half_width / k[:, None])

    def _of(self, stiffness: Complex, structures: Integer, speeds: Real | None) -> Poles:
        """Return the resonances of structures (P,) in units of kω.

        `speeds` (P,) is the kω that damping is taken at; None for contacts that are springs alone, whose
        resonances have the damping of their modes to first order.
        """
        moved = stiffness - np.diag(self.system.shift)
        if self.system.form == DENSE:
            return self._dense(moved, structures)
        groups = self._together(structures)
        if len(groups) == 1:
            return self._modal(moved, structures, speeds)
        shape = len(structures), min(self.system.eigenvalues.shape[1], MOST_MODES)
        at, half_width = np.empty(shape), np.empty(shape)
        for some in groups:
            speed = None if speeds is None else speeds[some]
            found = self._modal(moved[some], structures[some], speed)
            at[some], half_width[some] = found.at, found.half_width
        return Poles(at=at, half_width=half_width)

    def _together(self, structures: Integer) -> list[Integer]:
        """Return the rows of structures in groups that are looked at together: what the memory holds.

        Where modes are left out a group is of one structure.
        """
        size = self.system.eigenvalues.shape[1]
        rows = np.arange(len(structures))
        groups = [rows]
        if size > MOST_MODES:
            groups = [rows[structures == s] for s in np.unique(structures)]
        most = max(1, _MOST_ENTRIES // min(size, MOST_MODES) ** 2)
        return [group[begin : begin + most] for group in groups for begin in range(0, group.size, most)]

    def _modal(self, moved: Complex, structures: Integer, speeds: Real | None) -> Poles:
        modes = self.system.form == MODES
        values, dampings, X, Y, moved = self._kept(structures, moved)
        if modes and speeds is None:
            squares, shapes = np.linalg.eigh(coupled(values, None, X, Y, moved))
            half_width = 0.5 * np.einsum("...pnm,...pn->...pm", np.abs(shapes) ** 2, dampings)
            return Poles(at=np.sqrt(np.maximum(squares, 0.0)), half_width=half_width)
        if not modes:
            found = np.linalg.eigvals(coupled(values, None, X, -Y, moved))
            # Of each conjugate pair the one above; what does not oscillate has no resonance.
            return Poles(at=np.where(found.imag > 0.0, found.imag, _FASTEST), half_width=np.abs(found.real))
        turning: Complex | None = None
        if speeds is not None:
            turning = np.asarray(1j * speeds[:, None] * dampings, np.complex128)
        roots = np.sqrt(np.linalg.eigvals(coupled(values, turning, X, Y, moved)))
        return Poles(at=np.abs(roots.real), half_width=np.abs(roots.imag))

    def may_meet(self, stiffness: Complex, numbers: Integer, omega: Real, reach: Real) -> Flags:
        """Return whether harmonics may meet a resonance within `reach` (P,) of ω; else as above.

        No eigenvalue of H is nearer to z than 1 / ‖(z − H)⁻¹‖, and an inverse costs far less than they do.
        A resonance is meant whose half width is at most half of `reach`.
        """
        system, k, may = self.system, self.system.ks[numbers], np.ones(len(omega), bool)
        if system.form == DENSE or system.eigenvalues.shape[1] <= _FEW_MODES:
            return may
        structures, speeds = system.which[numbers], k * omega
        keys = _springs(stiffness, structures, speeds)
        new = _first_of_new(keys, self._nearness)
        if new:
            sizes = self._inverse_sizes(stiffness[new], structures[new], speeds[new])
            self._nearness |= {keys[row]: float(size) for row, size in zip(new, sizes, strict=True)}
        near = math.hypot(1.0, 0.5) * k * reach
        if system.form != POLES:
            near = near * (2.0 * speeds + near)
        may &= ~(near * np.array([self._nearness[key] for key in keys]) < 1.0)
        return may

    def _inverse_sizes(self, stiffness: Complex, structures: Integer, speeds: Real) -> Real:
        """Return ‖(z − H)⁻¹‖ of structures (P,) at kω (P,), z = ikω, or (kω)² of ω²; infinite at a pole."""
        system, moved = self.system, stiffness - np.diag(self.system.shift)
        sizes = np.full(len(speeds), np.inf)
        for some in self._together(structures):
            values, dampings, X, Y, springs = self._kept(structures[some], moved[some])
            if system.form == POLES:
                left, place = coupled(values, None, X, -Y, springs), 1j * speeds[some]
            else:
                turning = np.asarray(1j * speeds[some, None] * dampings, np.complex128)
                left, place = coupled(values, turning, X, Y, springs), speeds[some] ** 2 + 0j
            diagonal = np.arange(values.shape[-1])
            left[:, diagonal, diagonal] -= place[:, None]
            try:
                sizes[some] = np.linalg.norm(np.linalg.inv(left), axis=(1, 2))
            except np.linalg.LinAlgError:
                continue  # exactly at a resonance
        return sizes

    def _kept(self, structures: Integer, moved: Complex) -> tuple[Complex, Real, Complex, Complex, Complex]:
        """Return eigenvalues, dampings, contact modes and duals of the modes kept, and their stiffness.

        Of very many modes the slowest are kept, of one structure in all rows; the others give way like
        springs in series with the contacts.
        """
        system = self.system
        one = system.eigenvalues.shape[0] == 1 or system.eigenvalues.shape[1] > MOST_MODES
        s = structures[:1] if one else structures
        values, dampings = system.eigenvalues[s], system.dampings[s]
        X, Y = system.contact_modes[s], system.contact_duals[s]
        if values.shape[1] <= MOST_MODES:
            return values, dampings, X, Y, moved
        values, dampings, X, Y = values[0], dampings[0], X[0], Y[0]
        modes = system.form == MODES
        order = np.argsort(np.abs(values), kind="stable")
        kept, rest = np.sort(order[:MOST_MODES]), order[MOST_MODES:]
        flexibility = (X[:, rest] / (values[rest] if modes else -values[rest])) @ Y[:, rest].T
        series = moved @ np.linalg.inv(np.eye(len(flexibility)) + flexibility @ moved)
        dampings = dampings[None, kept] if modes else dampings[None]
        return values[None, kept], dampings, X[None, :, kept], Y[None, :, kept], series

    def _dense(self, moved: Complex, structures: Integer) -> Poles:
        """Return the resonances of full matrices: eigenvalues of the first-order form."""
        system = self.system
        # What has no inertia is a base that moves as prescribed, and does not resonate; nor does the mean.
        free = np.any(system.M[-1], axis=1)
        mean = system.which[0] if system.ks[0] == 0 else -1
        at, half_width = [], []
        for one, s in zip(moved, structures, strict=True):
            if s == mean:
                at.append(np.full(2 * int(free.sum()), _FASTEST))
                half_width.append(np.zeros(at[-1].size))
                continue
            L = system.L[s][:, free]
            K = system.K[s][free][:, free] + L.conj().T @ one @ L
            values = rates(K, system.C[s][free][:, free], system.M[s][free][:, free])
            at.append(np.where(values.imag > 0.0, values.imag, _FASTEST))
            half_width.append(np.abs(values.real))
        return Poles(at=np.array(at), half_width=np.array(half_width))


def _springs(stiffness: Complex, structures: Integer, speeds: Real) -> list[_Spring]:
    """Return what names each of several contact stiffnesses of a structure at its kω: equal is the same."""
    rows = np.ascontiguousarray(stiffness)
    return [
        (int(s), float(speed), blake2b(row.data, digest_size=16).digest())
        for s, speed, row in zip(structures, speeds, rows, strict=True)
    ]


def _first_of_new(keys: list[_Spring], known: Mapping[_Spring, object]) -> list[int]:
    """Return the rows of the keys that are not known, each once."""
    new: dict[_Spring, int] = {}
    for row, key in enumerate(keys):
        if key not in known:
            new.setdefault(key, row)
    return list(new.values())


def rates(K: Complex, C: Complex, M: Complex) -> Complex:
    """Return the s of (s² M + s C + K) x = 0, (2 n,); a real, negative one in place of an infinite one."""
    nothing, one = np.zeros(K.shape), np.eye(len(K))
    try:
        inverse = np.linalg.inv(M)
    except np.linalg.LinAlgError:  # an inertia that gyroscopic terms take away
        flexibility = np.linalg.inv(K)
        found = np.linalg.eigvals(np.block([[-flexibility @ C, -flexibility @ M], [one, nothing]]))
        slow = np.abs(found) > np.abs(found).max(initial=0.0) / _FASTEST
        return np.asarray(np.where(slow, 1.0 / np.where(slow, found, 1.0), -_FASTEST), np.complex128)
    found = np.linalg.eigvals(np.block([[nothing, one], [-inverse @ K, -inverse @ C]]))
    return np.asarray(found, np.complex128)


def coupled(values: Complex, more: Complex | None, X: Complex, Y: Complex, moved: Complex) -> Complex:
    """Return diag(values + more) + Yᵀ · moved · X, (P, nm, nm); what is the same for all may have one row."""
    matrices = np.swapaxes(Y, -1, -2) @ moved @ X
    diagonal = np.arange(values.shape[-1])
    matrices[:, diagonal, diagonal] += values if more is None else values + more
    return np.asarray(matrices, np.complex128)
