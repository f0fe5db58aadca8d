"""The linear part of a nonlinear mode: Z_k(ω, ζ) = K + ikωC − (k²ω² + 2ikζω²) M of every kept harmonic.

Z_1 is singular at a mode of the structure without contacts, where a large amplitude leads: friction then
weighs little beside inertia. One mode b of the free structure is therefore carried as an unknown of its own,
q = (M b)ᴴ x_1, and stiffened by ρ: with Z' = Z_1 + ρ (M b)(M b)ᴴ the same motion is x_1 = Z'⁻¹ (φ + ρ M b q),
and Z' is regular there. ρ = −iω_b² has the sign of the term in ζ, so the two do not cancel while ζ is larger
than that of the structure alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.balance.balance import Balance
from solver.contacts.kernels.system import DENSE
from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.linear.assembly import linear_model
from solver.linear.condensation import reduce_model
from solver.linear.model import dynamic_stiffness
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.modes.kernels.mode_assembly import fill_stiffness, invert_modes
from solver.modes.sparse import Factors, Pattern


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeStructure:
    """What Z_k is made of; N coordinates.

    It is in modes (diagonals, (nk, N)), as matrices ((nk, N, N)), or as the entries of a pattern ((nk, L)).
    """

    ks: Annotated[
        Integer,
        "(nk,) harmonics kept; `first` is the place of harmonic 1, `moving` says which are not the mean.",
    ]
    first: int
    moving: Flags
    turns: Annotated[Real, "(nk,) k, but 1 of the mean, whose C and M are its own."]
    K: Annotated[Complex, "Stiffness of each harmonic, as the balance has it."]
    C: Annotated[Complex, "Damping, likewise."]
    M: Annotated[Complex, "Inertia, likewise."]
    mass: Annotated[Complex, "The mass of each harmonic, 0 of the mean; in modes 1."]
    fed: Annotated[
        Complex, "What −2ζω is multiplied by: the mass, or (M φ)(M φ)ᴴ where one mode φ alone is damped."
    ]
    contact: Annotated[Complex, "(nk, r, N) motions of the leading ports."]
    back: Annotated[Complex, "(nk, N, r) what their forces push."]
    constant: Annotated[Complex, "(N,) constant force on the mean."]
    level: Annotated[Real, "(3,) its factor by 1, ω, ω²."]
    force: Annotated[Complex, "(N,) the excitation of harmonic 1."]
    observe: Annotated[Complex, "(nk, N)."]
    shapes: Annotated[Complex, "(nk, n, N) the coordinates in those of the matrices."]
    modes: Annotated[
        Complex, "(N, m) modes of the structure alone that may be carried, M b of them in `carried`."
    ]
    carried: Complex
    squares: Annotated[Real, "(m,) their ω² [rad²/s²]."]
    own: Annotated[
        Complex, "(4, m) ψᴴ K ψ, ψᴴ C ψ, ψᴴ M ψ and that of `fed` of harmonic 1, of these modes ψ."
    ]
    pattern: Annotated[
        Pattern | None,
        "Where matrices have entries that are kept alone; None where whole ones or diagonals are.",
    ]

    @property
    def is_diagonal(self) -> bool:
        """Whether the coordinates are modes that damping leaves apart."""
        return self.pattern is None and self.K.ndim == 2

    def times(self, matrix: Complex, x: Complex) -> Complex:
        """Return matrix @ x of each harmonic, x (…, nk, N)."""
        if self.pattern is not None:
            return self.pattern.times(matrix, x)
        if matrix.ndim == 2:
            return matrix * x
        return np.asarray((matrix @ x[..., None])[..., 0])

    def momentum(self, x: Complex) -> Complex:
        """Return M x (N,) of harmonic 1."""
        here = slice(self.first, self.first + 1)
        return np.asarray(self.times(self.mass[here], x[None])[0])

    def at(self, omega: float, zeta: float, mode: int) -> Dynamics:
        """Return Z of all harmonics with mode number `mode` stiffened; raises LinAlgError if singular."""
        Z, by_omega, by_zeta = np.empty((3, *self.K.shape), np.complex128)
        flat = (self.ks.size, -1)
        fill_stiffness(
            self.turns, self.K.reshape(flat), self.C.reshape(flat), self.M.reshape(flat),
            self.fed.reshape(flat), omega, zeta, Z.reshape(flat), by_omega.reshape(flat),
            by_zeta.reshape(flat),
        )  # fmt: skip
        b = self.carried[:, mode]
        rho = -1j * self.squares[mode]
        inverse: Complex | Factors = Z
        if self.pattern is not None:
            inverse = Factors(self.pattern, Z, self.first, rho, b)
        elif not self.is_diagonal:
            Z[self.first] += rho * np.outer(b, b.conj())
            inverse = np.asarray(np.linalg.inv(Z), np.complex128)
        elif not invert_modes(Z, self.first, rho, b):
            raise np.linalg.LinAlgError("Z is singular")
        return Dynamics(of=self, inverse=inverse, by_omega=by_omega, by_zeta=by_zeta, b=b, rho=rho)

    def nearest(self, omega: float, zeta: float) -> int:
        """Return the mode of the structure alone that is nearest to singular at (ω, ζ)."""
        K, C, M, fed = self.own
        return int(np.argmin(np.abs(dynamic_stiffness(K, C - 2.0 * zeta * omega * fed, M, 1.0, omega)[0])))

    def stiffness(self, omega: float) -> Complex:
        """Return K + iωC − ω²M of harmonic 1, (N, N)."""
        i = self.first
        Z = dynamic_stiffness(self.K[i], self.C[i], self.M[i], 1.0, omega)[0]
        if self.pattern is not None:
            return np.asarray(self.pattern.matrix(Z).toarray())
        return np.diag(Z) if self.is_diagonal else Z

    def squared_amplitude(self, x: Complex) -> float:
        """Return Σ x_kᴴ M x_k over the harmonics that move [kg m²]."""
        return float(np.vdot(x, self.times(self.mass, x)).real)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dynamics:
    """Z of all harmonics at (ω, ζ), with one mode stiffened; see the module."""

    of: ModeStructure
    inverse: Complex | Factors
    by_omega: Complex
    by_zeta: Complex
    b: Complex
    rho: complex

    def solve(self, phi: Complex) -> Complex:
        """Return Z⁻¹ φ, (…, nk, N)."""
        if isinstance(self.inverse, Factors):
            return self.inverse.solve(phi)
        return self.of.times(self.inverse, phi)

    def solve_adjoint(self, eta: Complex) -> Complex:
        """Return Z⁻ᴴ η, (…, nk, N)."""
        if isinstance(self.inverse, Factors):
            return self.inverse.solve(eta, "H")
        if self.inverse.ndim == 2:
            return self.inverse.conj() * eta
        return np.asarray((np.swapaxes(self.inverse, 1, 2).conj() @ eta[..., None])[..., 0])

    def receptance(self) -> Complex:
        """Return L Z⁻¹ Lᴴ of the leading ports, (nk, r, r)."""
        if isinstance(self.inverse, Factors):
            return self.of.contact @ self.inverse.solve(self.of.back.transpose(2, 0, 1)).transpose(1, 2, 0)
        if self.inverse.ndim == 2:
            return np.asarray((self.of.contact * self.inverse[:, None, :]) @ self.of.back)
        return np.asarray(self.of.contact @ (self.inverse @ self.of.back))


def structure_of(balance: Balance, alone: Complex | None = None) -> ModeStructure:
    """Return the linear part of a balance in modes or as matrices (`Effects.whole_matrices`).

    Parameters
    ----------
    alone : (N,) the mass-normalised mode that −2ζω acts on alone, of a balance with whole matrices.

    Poles do not carry the term in ζ: a balance of that form has to be built with whole matrices.
    """
    system, scene = balance.system, balance.scene
    scene.observe.check_whole("a nonlinear mode")
    ks, which = system.ks, system.which
    moving, first = ks > 0, int(np.flatnonzero(ks == 1)[0])
    led = system.leading
    dense = system.form == DENSE
    if dense:
        model = linear_model(scene)
        K, C, M = system.K[which], system.C[which], system.M[which]
        mass = model.plain(model.diameters(ks))[2] * moving[:, None, None] + 0j
        fed = mass if alone is None else _on_one_mode(balance, mass, first, alone)
        contact, back = system.L[which][:, led], system.L[which][:, led].conj()
        forces, observe = system.forces, np.broadcast_to(system.observe, (ks.size, system.observe.size))
        n = observe.shape[1]
        shapes = np.broadcast_to(np.eye(n, dtype=np.complex128), (ks.size, n, n))
        squares: Real
        modes, carried, squares = _carried(K[first], mass[first], model.free)
        own = np.array([(modes.conj() * (each[first] @ modes)).sum(axis=0) for each in (K, C, M, fed)])
        pattern = Pattern.of(K, C, M, fed)
        if pattern is not None:
            K, C, M, mass, fed = (pattern.entries(each) for each in (K, C, M, mass, fed))
    else:
        values = np.asarray(system.eigenvalues[which].real, np.complex128)
        moves = np.asarray(moving[:, None], np.complex128)
        # Of the mean only the stiffness counts: in modes it is written with k = 0.
        K, C = values, np.asarray(system.dampings[which] * moves, np.complex128)
        M = mass = fed = np.broadcast_to(moves, values.shape)
        own, pattern = np.array([K[first], C[first], M[first], fed[first]]), None
        contact, back = system.contact_modes[which][:, led], system.contact_duals[which][:, led]
        forces, observe = system.modal_forces, system.observe_modes[which]
        model = linear_model(scene)
        shapes = reduce_model(model, ks).shapes[which]
        modes = carried = np.eye(values.shape[1], dtype=np.complex128)
        sizes = np.abs(values[first].real)
        squares = np.maximum(sizes, 1e-12 * sizes.max(initial=1.0))
    constant = forces[0] if ks[0] == 0 else np.zeros(forces.shape[1], np.complex128)
    row = system.level[1 if system.constant_mean else 0]
    return ModeStructure(
        ks=ks, first=first, moving=moving, turns=np.maximum(ks, 1).astype(np.float64),
        K=np.array(K, np.complex128), C=np.array(C, np.complex128), M=np.array(M, np.complex128),
        mass=np.array(mass, np.complex128), contact=np.ascontiguousarray(contact),
        back=np.ascontiguousarray(np.swapaxes(back, 1, 2)), constant=constant, level=row,
        force=forces[first], observe=observe, shapes=shapes, modes=modes, carried=carried, squares=squares,
        fed=fed, own=own, pattern=pattern,
    )  # fmt: skip


def _on_one_mode(balance: Balance, mass: Complex, first: int, alone: Complex) -> Complex:
    """Return (M φ)(M φ)ᴴ of every harmonic, (nk, N, N): in a disk of those that are waves of φ's diameter."""
    model, ks = balance.model, balance.system.ks
    diameters = np.asarray(model.diameters(ks)) % model.sectors
    pushed = mass[first] @ alone
    matrix, fed = np.outer(pushed, pushed.conj()), np.zeros_like(mass)
    forward = diameters == diameters[first]
    backward = ~forward & (diameters == -diameters[first] % model.sectors)
    fed[forward & (ks > 0)] = matrix
    fed[backward & (ks > 0)] = matrix.conj()
    return fed


def plain(matrix: Complex) -> NDArray[Any]:
    """Return a matrix in real numbers where it is one of these: decompositions cost a quarter."""
    return matrix if np.any(matrix.imag) else np.ascontiguousarray(matrix.real)


def _carried(K: Complex, M: Complex, free: Flags) -> tuple[Complex, Complex, Real]:
    """Return modes b of Hermitian parts, M b, and ω²; coordinates without inertia stay at rest."""
    rows = np.ix_(free, free)
    found = undamped_modes(plain(hermitian(K[rows])), plain(hermitian(M[rows])))
    modes = np.zeros((K.shape[0], found.flexibility.size), np.complex128)
    modes[free] = found.phi
    squares = np.maximum(np.abs(found.omega2), 1e-12 * np.abs(found.omega2).max(initial=1.0))
    return modes, M @ modes, squares
