"""Derivatives of ω(a) and ζ(a) by parameter paths, at a given amplitude: one adjoint for each of the two.

Of the equations r(y, p) = 0 of `mode_equations`, dy/dp = −(∂r/∂y)⁻¹ ∂r/∂p: with Jᵀ λ the unit row of
ω or ζ, dω/dp = −λ·∂r/∂p. A parameter changes the contact forces, the matrices, the places of the contacts or
the constant forces, and through x = Z⁻¹ (φ − Lᴴ F) every equation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np

from solver.balance.parameter import Kind
from solver.balance.parameter_derivatives import (
    HarmonicMatrices,
    contact_slopes,
    excitation_slopes,
    force_along,
    matrices_of_paths,
    resolved,
)
from solver.balance.speed_line import check_no_line
from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from solver.linear.model import dynamic_stiffness
from solver.modes.corrector import ModeState, scales
from solver.modes.mode_equations import Equations, Evaluated
from solver.modes.mode_results import NonlinearMode
from solver.modes.nonlinear_mode import pose
from solver.results.told import Piece


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
