"""Second derivatives of ω(a) and ζ(a) by parameter paths, at a given amplitude.

With the equations of `mode_equations` written with the motion x beside, R = Z x − φ + Lᴴ F = 0, and
the multipliers λ of theirs (Jᵀ λ the unit row of ω or ζ) and Y of R (Zᴴ Y = Lᴴ λ_w + λ_q M b − λ_φ g − λ_a M
x / xᴴ M x), the Lagrangian has the second derivatives along the motions (x_i, ω_i, ζ_i) of the paths

    H_ij = −Re Yᴴ (Z_i x_j + Z_j x_i + Z_ij x) − w·F_ij − λ_φ φ_ij
           − λ_a Re(x_iᴴ M x_j + x_iᴴ M_j x + x_jᴴ M_i x) / xᴴ M x,

Z_i the change of Z along path i, w = L Y the weights of the forces and F_ij their second derivatives
(`solver.balance.contact_hessian`). The mode that is carried apart is in none of it: it only moves what Z is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np

from solver.balance.contact_hessian import check_laws, check_loads, contact_forces
from solver.balance.parameter import Kind
from solver.balance.parameter_derivatives import HarmonicMatrices, check_smooth_structure
from solver.jit.fourier import Complex, Real
from solver.linear.contact_table import second_numbers
from solver.linear.model import dynamic_stiffness
from solver.modes.corrector import ModeState
from solver.modes.mode_equations import Evaluated
from solver.modes.mode_gradient import ModeSensitivities
from solver.sensitivity.hessian import Directions, contacts_along


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
    s, hat, size = equations.structure, equations.amplitudes, equations.size
    changes, pushes = sensitivities.changes(state, at)
    dy = -changes @ inverse.T
    dw = dy[:, :size].reshape(-1, equations.r, equations.n)
    forces = np.einsum("risj,psj->pri", equations.slopes(), dw)
    total = np.array(pushes).reshape(len(dy), *at.x.shape)
    total = total - (s.back @ np.moveaxis(hat.of(forces), 1, 2)[..., None])[..., 0]
    total[:, s.first] += (dy[:, size] + 1j * dy[:, size + 1])[:, None] * at.dynamics.rho * at.dynamics.b
    total -= dy[:, -2, None, None] * s.times(at.dynamics.by_omega, at.x)
    total -= dy[:, -1, None, None] * s.times(at.dynamics.by_zeta, at.x)
    ports = np.array([equations.motions(one) for one in dw]).reshape(len(dy), -1, equations.n)
    return _Moves(omega=dy[:, -2], zeta=dy[:, -1], x=at.dynamics.solve(total), ports=ports)


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
        self._stiffness, self._amplitude = self._of_stiffness(), self._of_amplitude()

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
        twice += adjoint[size + 3] * self._amplitude / squared + adjoint[size + 2] * self._of_phase()
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

    def _of_amplitude(self) -> Real:
        """Return Re(x_iᴴ M x_j + x_iᴴ M_j x + x_jᴴ M_i x), (P, P)."""
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
        return found

    def _of_phase(self) -> Real:
        """Return the second derivatives of the phase condition Re gᴴ x_1, (P, P)."""
        found = np.zeros((len(self._of.parameters),) * 2)
        if not self._of.turns:
            first = self._moves.x[:, self._of.equations.structure.first]
            turned = (first @ (1j * self._state.phase).conj()).real
            for i, parameter in enumerate(self._of.parameters):
                if parameter.kind is Kind.FORCE_PHASE:
                    found[i] += turned
                    found[:, i] += turned
        return found
