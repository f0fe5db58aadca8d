"""Derivatives of ω(a) and ζ(a) by parameter paths, at a given amplitude: one adjoint for each of the two.

Of the equations r(y, p) = 0 of `mode_equations`, dy/dp = −(∂r/∂y)⁻¹ ∂r/∂p: with Jᵀ λ the unit row of
ω or ζ, dω/dp = −λ·∂r/∂p. A parameter changes the contact forces, the matrices, the places of the contacts or
the constant forces, and through x = Z⁻¹ (φ − Lᴴ F) every equation.

For second derivatives, with the equations of `mode_equations` written with the motion x beside, R = Z x − φ +
Lᴴ F = 0, and the multipliers λ of theirs (Jᵀ λ the unit row of ω or ζ) and Y of R (Zᴴ Y = Lᴴ λ_w + λ_q M b −
λ_φ g − λ_a M x / xᴴ M x), the Lagrangian has the second derivatives along the motions (x_i, ω_i, ζ_i) of the
paths

    H_ij = −Re Yᴴ (Z_i x_j + Z_j x_i + Z_ij x) − w·F_ij − λ_φ φ_ij
           − λ_a Re(x_iᴴ M x_j + x_iᴴ M_j x + x_jᴴ M_i x) / xᴴ M x,

Z_i the change of Z along path i, w = L Y the weights of the forces and F_ij their second derivatives
(`solver.balance.contact_hessian`). The mode that is carried apart is in none of it: it only moves what Z is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np

from solver.balance.balance import Kind
from solver.balance.contact_hessian import (
    check_laws,
    check_loads,
    check_no_line,
    contact_forces,
    second_numbers,
)
from solver.balance.parameter_derivatives import (
    HarmonicMatrices,
    check_smooth_structure,
    contact_slopes,
    excitation_slopes,
    force_along,
    matrices_of_paths,
    resolved,
)
from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from solver.linear.model import dynamic_stiffness
from solver.modes.mode_curve import ModeState, scales
from solver.modes.mode_equations import Equations, Evaluated
from solver.modes.mode_results import NonlinearMode
from solver.modes.nonlinear_mode import pose
from solver.results.told import Piece
from solver.sensitivity.gradient import Directions, contacts_along


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ModeGradient(Piece):
    """How frequency and damping ratio change with parameters, the amplitude held."""

    paths: Annotated[tuple[str, ...], "Parameter paths."]
    frequency_hz: Annotated[
        Real,
        "Derivatives at n points of a nonlinear mode [Hz per unit] of each parameter; NaN where the "
        "equations are singular, at a turning point, (n, n_paths).",
    ]
    damping_ratio: Annotated[Real, "The same of the damping ratio [1 per unit], (n, n_paths)."]


def mode_gradient(
    found: NonlinearMode, paths: Sequence[str], *, points: Sequence[int] | None = None
) -> ModeGradient:
    """Return the derivatives of frequency and damping ratio by parameter paths at points of a mode.

    Parameters
    ----------
    found : of `solver.nonlinear_mode`.
    paths : parameter paths of its scene; groups too.
    points : numbers of points; all if left out.

    Raises
    ------
    SettingError
        An unknown path, or one that calls for even harmonics the mode left out; a point it has not.
    """
    chosen = range(len(found.points)) if points is None else points
    for i in chosen:
        if not 0 <= i < len(found.points):
            raise SettingError("points", i, f"must be from 0 to {len(found.points) - 1}")
    problem = pose(found.scene, found.mode, None, found.n_harmonics, whole=found.whole_matrices)
    sensitivities = ModeSensitivities(problem.equations, paths, turns=problem.turns)
    rows = [sensitivities.at(found.points[i]) for i in chosen]
    both = np.array(rows, dtype=np.float64).reshape(len(rows), 2, len(paths) + 1)[:, :, :-1]
    return ModeGradient(
        paths=tuple(paths), frequency_hz=both[:, 0] / (2.0 * math.pi), damping_ratio=both[:, 1]
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Change:
    """What a parameter changes: the forces on the coordinates, the motions and the squared amplitude."""

    pushes: Complex
    moved: Complex | None = None
    amplitude: float = 0.0
    phase: complex = 0.0


class ModeSensitivities:
    """Derivatives of ω and ζ at points of one mode.

    Parameters
    ----------
    equations : of the mode.
    paths : parameter paths.
    turns : the motion may begin at any instant.
    """

    def __init__(self, equations: Equations, paths: Sequence[str], *, turns: bool) -> None:
        self.equations, self.turns = equations, turns
        balance = equations.balance
        check_no_line(balance.scene)
        self.parameters = resolved(balance, paths)
        self.slopes, self.loads = contact_slopes(balance, self.parameters)
        self.matrices = matrices_of_paths(balance, self.parameters, whole=True)

    def at(self, state: ModeState) -> tuple[Real, Real]:
        """Return the derivatives of ω [rad/s] and ζ at a point by the paths, then by ln a; (n_paths + 1,)."""
        equations, count = self.equations, len(self.parameters)
        at = equations.evaluate(state.y, state.log_amplitude, state.phase, state.mode)
        nothing = np.full(count + 1, math.nan)
        if at is None:
            return nothing, nothing
        inverse = self.inverse(state, at)
        if inverse is None:
            return nothing, nothing
        changes = np.zeros((count + 1, state.y.size))
        for i in range(count):
            changes[i] = self._residual(i, state, at)
        changes[count, equations.size + 3] = -1.0  # ln √(xᴴ M x) = ln a
        return -changes @ inverse[-2], -changes @ inverse[-1]

    def inverse(self, state: ModeState, at: Evaluated) -> Real | None:
        """Return J⁻¹ in the units of the unknowns and equations, (m, m); None where it is not found."""
        columns = scales(state.y, self.equations.size)
        scaled = at.jacobian * columns
        rows = np.abs(scaled).max(axis=1)
        try:
            return np.asarray(np.linalg.pinv(scaled / rows[:, None], rcond=1e-13) * columns[:, None] / rows)
        except np.linalg.LinAlgError:
            return None

    def changes(self, state: ModeState, at: Evaluated) -> tuple[Real, list[Complex]]:
        """Return ∂r/∂p of every path, (n_paths, m), and what it pushes on the coordinates, (nk, N) each."""
        count = len(self.parameters)
        rows = [self._residual(i, state, at) for i in range(count)]
        pushes = [self._change(i, state, at).pushes for i in range(count)]
        return np.array(rows).reshape(count, state.y.size), pushes

    def _residual(self, i: int, state: ModeState, at: Evaluated) -> Real:
        """Return ∂r/∂p of path i."""
        equations, s = self.equations, self.equations.structure
        hat, size = equations.amplitudes, equations.size
        change = self._change(i, state, at)
        dx = at.dynamics.solve(change.pushes)
        moved = (s.contact @ dx[:, :, None])[:, :, 0]
        if change.moved is not None:
            moved = moved + change.moved
        mass = s.times(s.mass, at.x)
        squared = float(np.vdot(at.x, mass).real)
        residual = np.empty(state.y.size)
        residual[:size] = -hat.coefficients(moved.T).reshape(-1)
        off = -np.vdot(at.dynamics.b, dx[s.first])
        residual[size], residual[size + 1] = off.real, off.imag
        residual[size + 2] = (np.vdot(state.phase, dx[s.first]) + change.phase).real
        residual[size + 3] = float(np.vdot(mass, dx).real) / squared + 0.5 * change.amplitude / squared
        return residual

    def _change(self, i: int, state: ModeState, at: Evaluated) -> _Change:
        """Return what path i changes."""
        parameter, s = self.parameters[i], self.equations.structure
        if parameter.kind is Kind.STRUCTURE:
            return self._of_structure(i, state, at)
        pushes = np.zeros(at.x.shape, np.complex128)
        system = self.equations.balance.system
        if parameter.kind is Kind.LEVEL:
            if s.ks[0] == 0 and not system.constant_mean:
                (level,), _ = excitation_slopes(self.equations.balance, [parameter])
                pushes[0] = level * s.constant
            return _Change(pushes=pushes)
        if parameter.kind is Kind.FORCE_PHASE:
            turned = 0.0 if self.turns else np.vdot(1j * state.phase, at.x[s.first])
            return _Change(pushes=pushes, phase=complex(turned))
        hat, equations = self.equations.amplitudes, self.equations
        dF = equations.lead(self._force_slopes(i, state))
        return _Change(pushes=-(s.back @ hat.of(dF).T[:, :, None])[:, :, 0])

    def _force_slopes(self, i: int, state: ModeState) -> Real:
        """Return ∂F/∂p of every port, (nc, n), by path i."""
        equations, omega = self.equations, float(state.y[-2])
        motions = equations.motions(state.y[: equations.size].reshape(equations.r, equations.n))
        found = np.zeros((equations.balance.n_ports, equations.n))
        for e in np.flatnonzero(np.any(self.slopes[i] != 0.0, axis=1)).tolist():
            ports = slice(*equations.balance.system.first_port[e : e + 2].tolist())
            along = self.slopes[i, e], self.loads[i, e]
            _, found[ports], _ = force_along(
                equations.balance, equations.point, e, motions[ports], omega, *along
            )
        return found

    def _of_structure(self, i: int, state: ModeState, at: Evaluated) -> _Change:
        """Return what a parameter of the structure, of bodies or of places changes."""
        s, given = self.equations.structure, cast(HarmonicMatrices, self.matrices)
        omega, zeta = float(state.y[-2]), float(state.y[-1])
        dK, dC, dM = given.by[i]
        x = (s.shapes @ at.x[:, :, None])[:, :, 0]
        dZ, *_ = dynamic_stiffness(dK, dC - 2.0 * zeta * omega * dM, dM, s.ks[:, None, None], omega)
        pushes, moved = -(dZ @ x[:, :, None])[:, :, 0], None
        if i in given.forces_by:
            pushes += given.forces_by[i]
        if i in given.motions_by:
            pushes, moved = self._of_places(given, given.motions_by[i], pushes, x)
        back = np.swapaxes(s.shapes, 1, 2).conj()
        amplitude = float(np.vdot(x, (dM @ x[:, :, None])[:, :, 0]).real)
        return _Change(pushes=(back @ pushes[:, :, None])[:, :, 0], moved=moved, amplitude=amplitude)

    def _of_places(
        self, given: HarmonicMatrices, dL: Complex, pushes: Complex, x: Complex
    ) -> tuple[Complex, Complex]:
        """Return the pushes with those of moved contacts, and the motions ∂L x of the leading ports."""
        equations, system = self.equations, self.equations.balance.system
        hat, moved = equations.amplitudes, np.einsum("kcn,kn->ck", dL, x)
        # The stiffness moved into the structure is in ∂Z, where it follows the contacts.
        forces = hat.of(equations.point.F) - system.shift[:, None] * np.einsum("kcn,kn->ck", given.L, x)
        pushes = pushes - np.einsum("kcn,ck->kn", dL.conj(), forces)
        led = moved[system.leading]
        if equations.span is not None:
            # The other ports no longer follow from the leading ones as they did.
            off = hat.coefficients(moved - equations.span @ led)
            turned = hat.of(np.einsum("cdij,dj->ci", equations.port_slopes(), off))
            pushes = pushes - np.einsum("kcn,ck->kn", given.L.conj(), turned)
        return pushes, led.T


@dataclass(frozen=True, slots=True, kw_only=True)
class _Moves:
    """What P paths move, the amplitude held."""

    omega: Annotated[Real, "(P,) [rad/s per unit]."]
    zeta: Annotated[Real, "(P,)."]
    x: Annotated[Complex, "(P, nk, N)."]
    ports: Annotated[Real, "Motions of all ports, (P, nc, n)."]


def check_second(sensitivities: ModeSensitivities) -> None:
    """Raise SettingError where laws or paths have no exact second derivatives here."""
    balance = sensitivities.equations.balance
    check_laws(balance.scene)
    check_smooth_structure(balance.scene, sensitivities.parameters)
    check_loads(balance.system, sensitivities.parameters, sensitivities.slopes)


def mode_hessian(sensitivities: ModeSensitivities, state: ModeState) -> tuple[Real, Real]:
    """Return the second derivatives of ω [rad/s] and ζ by the paths at a point, (P, P) each.

    NaN where the equations are singular, at a turning point.

    Raises
    ------
    SettingError
        A law without second derivatives, or paths on which the structure does not depend linearly.
    """
    check_second(sensitivities)
    equations, P = sensitivities.equations, len(sensitivities.parameters)
    nothing = np.full((P, P), np.nan)
    at = equations.evaluate(state.y, state.log_amplitude, state.phase, state.mode)
    inverse = None if at is None else sensitivities.inverse(state, at)
    if at is None or inverse is None:
        return nothing, nothing
    moves = _moves(sensitivities, state, at, inverse)
    parts = _SecondParts(sensitivities, state, at, moves)
    return parts.hessian(inverse[-2]), parts.hessian(inverse[-1])


def _moves(sensitivities: ModeSensitivities, state: ModeState, at: Evaluated, inverse: Real) -> _Moves:
    """Return what each path moves: dy = −J⁻¹ ∂r, and the motion x that follows."""
    equations = sensitivities.equations
    changes, pushes = sensitivities.changes(state, at)
    dy = -changes @ inverse.T
    dw = dy[:, : equations.size].reshape(-1, equations.r, equations.n)
    ports = np.array([equations.motions(one) for one in dw]).reshape(len(dy), -1, equations.n)
    x = changed_motion(equations, state, at, dy, np.array(pushes).reshape(len(dy), *at.x.shape))
    return _Moves(omega=dy[:, -2], zeta=dy[:, -1], x=x, ports=ports)


def changed_motion(
    equations: Equations, state: ModeState, at: Evaluated, dy: Real, pushes: Complex
) -> Complex:
    """Return dx = Z⁻¹ (dφ − Lᴴ dF − dZ x), (P, nk, N), of P changes of the unknowns and of a parameter.

    Parameters
    ----------
    dy : (P, m) of the unknowns; pushes : (P, nk, N) by the parameter on the coordinates.
    """
    s, size, dynamics = equations.structure, equations.size, at.dynamics
    w = state.y[:size].reshape(equations.r, equations.n)
    omega, q = float(state.y[-2]), complex(state.y[size], state.y[size + 1])
    equations.contacts(w, omega)
    by_omega = equations.pushes_by_omega(equations.shifted_forces(w), omega, q, dynamics)
    by_omega = by_omega - s.times(dynamics.by_omega, at.x)
    dF = np.einsum("risj,psj->pri", equations.slopes(), dy[:, :size].reshape(-1, equations.r, equations.n))
    phi = pushes - (s.back @ np.moveaxis(equations.amplitudes.of(dF), 1, 2)[..., None])[..., 0]
    phi[:, s.first] += (dy[:, size] + 1j * dy[:, size + 1])[:, None] * dynamics.rho * dynamics.b
    phi += dy[:, -2, None, None] * by_omega - dy[:, -1, None, None] * s.times(dynamics.by_zeta, at.x)
    return dynamics.solve(phi)


class _SecondParts:
    """What the Hessians of ω and ζ at one point are made of."""

    def __init__(
        self, sensitivities: ModeSensitivities, state: ModeState, at: Evaluated, moves: _Moves
    ) -> None:
        self._of, self._state, self._at, self._moves = sensitivities, state, at, moves
        equations = sensitivities.equations
        balance, P = equations.balance, len(sensitivities.parameters)
        motions = equations.motions(state.y[: equations.size].reshape(equations.r, equations.n))
        seconds = second_numbers(balance.scene)
        self._contacts = contact_forces(balance.system, seconds, np.ascontiguousarray(motions).reshape(-1))
        none = np.zeros(P)
        self._along = Directions(
            slopes=sensitivities.slopes, loads=sensitivities.loads, level=none, phase=none
        )
        # Re(x_iᴴ M x_j + x_iᴴ M_j x + x_jᴴ M_i x), (P, P).
        s, dx = self._of.equations.structure, self._moves.x
        found: Real = np.einsum("ikn,jkn->ij", dx.conj(), s.times(s.mass, dx)).real
        for j, parameter in enumerate(self._of.parameters):
            if parameter.kind is Kind.STRUCTURE:
                dM = cast(HarmonicMatrices, self._of.matrices).by[j][2]
                pushed = dM @ (s.shapes @ self._at.x[..., None])
                pushed = (np.swapaxes(s.shapes, 1, 2).conj() @ pushed)[..., 0]
                along = np.einsum("ikn,kn->i", dx.conj(), pushed).real
                found[:, j] += along
                found[j] += along
        self._stiffness, self._amplitude = self._of_stiffness(), found

    def hessian(self, adjoint: Real) -> Real:
        """Return the second derivatives of the unknown whose multipliers these are, (m,)."""
        equations, at = self._of.equations, self._at
        s, size = equations.structure, equations.size
        weights = equations.amplitudes.of(adjoint[:size].reshape(equations.r, equations.n)).T
        eta = (np.swapaxes(s.contact, 1, 2).conj() @ weights[..., None])[..., 0]
        eta[s.first] += (adjoint[size] + 1j * adjoint[size + 1]) * at.dynamics.b
        eta[s.first] -= adjoint[size + 2] * self._state.phase
        mass = s.times(s.mass, at.x)
        squared = float(np.vdot(at.x, mass).real)
        eta -= adjoint[size + 3] * mass / squared
        Y = at.dynamics.solve_adjoint(eta)
        led = (np.swapaxes(s.back, 1, 2).conj() @ Y[..., None])[..., 0]
        w = equations.motions(equations.amplitudes.coefficients(led.T))
        twice = np.einsum("kn,ijkn->ij", Y.conj(), self._stiffness).real
        twice += contacts_along(self._contacts, self._along, self._moves.ports, w)
        # The second derivatives of the phase condition Re gᴴ x_1, (P, P).
        phase = np.zeros((len(self._of.parameters),) * 2)
        if not self._of.turns:
            first = self._moves.x[:, self._of.equations.structure.first]
            turned = (first @ (1j * self._state.phase).conj()).real
            for i, parameter in enumerate(self._of.parameters):
                if parameter.kind is Kind.FORCE_PHASE:
                    phase[i] += turned
                    phase[:, i] += turned
        twice += adjoint[size + 3] * self._amplitude / squared + adjoint[size + 2] * phase
        return np.asarray(-0.5 * (twice + twice.T))

    def _of_stiffness(self) -> Complex:
        """Return Z_i x_j + Z_j x_i + Z_ij x, (P, P, nk, N)."""
        s, moves, dynamics = self._of.equations.structure, self._moves, self._at.dynamics
        x, omega, zeta = self._at.x, float(self._state.y[-2]), float(self._state.y[-1])
        k = s.turns.reshape(-1, *(1,) * (s.M.ndim - 1))
        bend = s.times(-2.0 * k**2 * s.M - 4j * k * zeta * s.fed, x)
        cross = s.times(-4j * k * omega * s.fed, x)
        P = moves.omega.size
        one = np.zeros((P, P, *x.shape), np.complex128)
        by = s.times(dynamics.by_omega, moves.x), s.times(dynamics.by_zeta, moves.x)
        for i in range(P):
            one[i] += moves.omega[i] * by[0] + moves.zeta[i] * by[1]
            one[i] += (0.5 * moves.omega[i] * moves.omega)[:, None, None] * bend
            one[i] += (moves.omega[i] * moves.zeta)[:, None, None] * cross
            for j in range(P):
                one[i, j] += self._structural(i, moves.x[j], moves.omega[j], moves.zeta[j])
        return np.asarray(one + np.swapaxes(one, 0, 1))

    def _structural(self, i: int, moved: Complex, by_omega: float, by_zeta: float) -> Complex | float:
        """Return (∂Z/∂p) x_j + (∂²Z/∂p∂ω ω_j + ∂²Z/∂p∂ζ ζ_j) x, (nk, N); 0 but for the structure's paths."""
        if self._of.parameters[i].kind is not Kind.STRUCTURE:
            return 0.0
        s, omega, zeta = self._of.equations.structure, float(self._state.y[-2]), float(self._state.y[-1])
        dK, dC, dM = cast(HarmonicMatrices, self._of.matrices).by[i]
        k = s.ks[:, None, None]
        dZ, slope, _ = dynamic_stiffness(dK, dC - 2.0 * zeta * omega * dM, dM, k, omega)
        slope = slope - 2j * k * omega * zeta * dM
        pushed = dZ @ (s.shapes @ moved[..., None])
        pushed += (by_omega * slope - 2j * by_zeta * k * omega**2 * dM) @ (s.shapes @ self._at.x[..., None])
        return np.asarray((np.swapaxes(s.shapes, 1, 2).conj() @ pushed)[..., 0])
