"""The extended periodic motion as equations: contacts, one carried mode, ω and ζ at a given amplitude.

Krack, Comput. Struct. 154 (2015) 59, doi:10.1016/j.compstruc.2015.03.008: [−k²ω²M + ikω(C − 2ζωM) + K] x_k +
Lᴴ F_k = 0 with the contact forces of the whole period, condensed on the contacts as the balance is. The
unknowns are y = [w, Re q, Im q, ω, ζ]: w the motions of the leading ports, (r, n) coefficients, and q the
part of a mode in harmonic 1 (`solver.modes.mode_structure`). The equations are

  w − L x = 0,   q − (M b)ᴴ x_1 = 0,   Re gᴴ x_1 = 0,   ½ ln(Σ_k≥1 x_kᴴ M x_k / a²) = 0,

with x_k = Z_k⁻¹ (φ_k − Lᴴ F_k). `g` fixes the phase: harmonic 1 lags a force g by a quarter of a period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.output import extremes
from solver.balance.kernels.residual import evaluate
from solver.balance.kernels.slopes import take_slopes
from solver.contacts.kernels.system import (
    UNHELD,
    by_reference,
    evaluation_by_value,
    new_evaluation,
    new_receptance,
)
from solver.jit.fourier import Complex, Integer, Real
from solver.modes.kernels.mode_assembly import (
    fill_functionals,
    fill_motions,
    fill_pushes,
    fill_slopes,
    scaled_step,
)
from solver.modes.mode_structure import Dynamics, ModeStructure, structure_of
from solver.modes.sparse import Factors, Layout, SparseJacobian
from solver.scene.scene_harmonics import Amplitudes

BESIDES = 4  # unknowns beside the motions: Re q, Im q, ω, ζ


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluated:
    """The equations at one point."""

    residual: Annotated[Real, "(m,) in the order of the unknowns; [m, √kg m, …, 1]."]
    slopes: Annotated[
        Real | SparseJacobian,
        "(m, m) the Jacobian, or what solves with it; `by_log_amplitude` (m,) is that by ln a.",
    ]
    by_log_amplitude: Real
    x: Annotated[Complex, "(nk, N) motion of all coordinates."]
    forces: Annotated[Real, "(r, n) forces at the leading ports less the shift."]
    rough: Annotated[Real, "(r n,) size that a residual of each motion is rounding of."]
    lag: Annotated[float, "Size that the residual of the phase is relative to."]
    loose: Annotated[
        Real,
        "stiffnesses along them: a step takes these for the slope that is missing, and leaves such means "
        "alone (`solver.balance.kernels.gauge`).",
    ]
    dynamics: Dynamics

    @property
    def jacobian(self) -> Real:
        """The Jacobian, (m, m)."""
        return self.slopes.whole() if isinstance(self.slopes, SparseJacobian) else self.slopes

    def step(self, rhs: Real, columns: Real, border: Real | None = None) -> Real | None:
        """Solve J δ = rhs in units `columns` (m,) of the unknowns; None if J is singular.

        Parameters
        ----------
        rhs : (m,), or (m + 1,) with a border: that of a further row.
        border : (m + 1,) this row, over the unknowns and ln a; δ is (m + 1,) then.
        """
        motions, pulls = self.loose
        if isinstance(self.slopes, SparseJacobian):
            return self.slopes.step(rhs, pulls, border)
        J = self.slopes + motions.T @ pulls if len(motions) else self.slopes
        if border is not None:
            m = columns.size
            bordered = np.empty((m + 1, m + 1))
            bordered[:m, :m], bordered[:m, m], bordered[m] = J, self.by_log_amplitude, border
            J, columns = bordered, np.append(columns, 1.0)
        return step(J, rhs, columns)


def step(J: Real, rhs: Real, columns: Real) -> Real | None:
    """Solve J δ = rhs in units `columns` of the unknowns, rows brought to one size; None if singular."""
    found = np.array(rhs)
    good = scaled_step(J, found, columns, np.empty_like(J), np.empty(rhs.size, np.int32))
    return found if good else None


class Equations:
    """The extended periodic motion of a balance, whose λ is the frequency.

    Parameters
    ----------
    alone : (N,) a mode that −2ζω acts on alone; all masses if left out.
    """

    KEEPS_J: ClassVar[bool] = True  # the rows of J are those of the module, whatever form it has

    def __init__(self, balance: Balance, alone: Complex | None = None) -> None:
        self.balance, self.alone = balance, alone
        self.structure: ModeStructure = structure_of(balance, alone)
        self.amplitudes = Amplitudes(balance.system.ks)
        system = balance.system
        self._system = by_reference(system)
        self._linear = new_receptance(self._system)
        self._point = new_evaluation(self._system)
        self.point = evaluation_by_value(self._point)
        self.n = balance.n_coefficients
        self.r = balance.n_leading
        self.size = self.r * self.n
        self.span = system.span if system.span.shape[1] else None
        self._blocks = _block_places(balance)
        s = self.structure
        nk, coordinates = s.ks.size, s.force.size
        self._layout = (
            Layout(s.pattern, self.amplitudes, s.contact, self._blocks, self.span, self.n)
            if s.pattern is not None and self.KEEPS_J
            else None
        )
        self._slopes = np.empty((nk, self.r, self.size if self._layout is None else 0), np.complex128)
        # Changes of x by Re q, ω and the last unknown; c of q, of the equation before the last, of a.
        self._pushed, self._rows = np.zeros((2, 3, nk, coordinates), np.complex128)
        self._turned = np.zeros((nk, coordinates), np.complex128)
        self._held = np.zeros((2, 0, self.size + BESIDES))
        self._by_log_amplitude = np.zeros(self.size + BESIDES)
        self._by_log_amplitude[-1] = -1.0

    def over(self, balance: Balance) -> Equations:
        """Return the same question to another balance of the scene."""
        return Equations(balance, self.alone)

    def follows(self, _before: Real, _y: Real) -> bool:
        """Return whether unknowns may follow others on one curve, beside being near to them."""
        return True

    def top(self, x: Complex) -> tuple[float, Complex]:
        """Return max|x| of the observed DOF [m], and c (nk, N) of its change Re Σ c_kᴴ dx_k."""
        observe = self.structure.observe
        observed = self.amplitudes.coefficients(np.einsum("kn,kn->k", observe, x))
        high, at_high, low, at_low = extremes(self._system, observed)
        sign, tau = (1.0, at_high) if high >= -low else (-1.0, at_low)
        # The extreme of a smooth motion changes as the motion does at its instant.
        return max(high, -low), sign * (observe * self.amplitudes.turn(tau)[:, None]).conj()

    def motions(self, w: Real) -> Real:
        """Return the motions of all ports, (nc, n), of those of the leading ones (r, n)."""
        return w if self.span is None else np.asarray(self.span @ w)

    def contacts(self, w: Real, omega: float) -> bool:
        """Evaluate the contact forces at w (r, n) into `point`; False where a law failed."""
        u = np.ascontiguousarray(self.motions(w).reshape(-1))
        norm = evaluate(self._system, self._linear, u, omega, 0.0, self._point)
        if not math.isfinite(norm):
            return False
        take_slopes(self._system, self._point)
        return True

    def lead(self, forces: Real) -> Real:
        """Return forces (nc, n) as those along the leading motions, (r, n)."""
        return forces if self.span is None else np.asarray(self.span.T @ forces)

    def port_slopes(self) -> Real:
        """Return dF/dU of all ports less the shift where last evaluated, (nc, nc, n, n)."""
        nc, n = self.balance.n_ports, self.n
        rows, columns, blocks = self._blocks.T
        G = np.zeros((nc, nc, n, n))
        G[rows, columns] = self.point.G[blocks]
        return G

    def slopes(self) -> Real:
        """Return dF/dw less the shift where last evaluated, (r, n, r, n)."""
        G = self.port_slopes()
        if self.span is not None:
            G = np.einsum("cr,cdij,ds->rsij", self.span, G, self.span, optimize=True)
        return np.asarray(G.transpose(0, 2, 1, 3))

    def loose(self) -> Real:
        """Return `Evaluated.loose` where last evaluated."""
        system, count = self.balance.system, int(self.point.counts[UNHELD])
        if not count:
            return self._held
        found = np.zeros((2, count, self.size + BESIDES))
        for k, along in enumerate(self.point.gauge[:count]):
            found[0, k, : self.size : self.n] = along[system.leading]
            found[1, k, : self.size : self.n] = self.lead((system.shift * along)[:, None])[:, 0]
        return found

    def shifted_forces(self, w: Real) -> Real:
        """Return the forces along the leading motions less the shift, (r, n)."""
        return self.lead(self.point.F - self.balance.system.shift[:, None] * self.motions(w))

    def evaluate(self, y: Real, log_amplitude: float, phase: Complex, mode: int) -> Evaluated | None:
        """Return the equations at y; None where a contact law failed or Z is singular."""
        w, q = y[: self.size].reshape(self.r, self.n), complex(y[self.size], y[self.size + 1])
        omega, last = float(y[-2]), float(y[-1])
        if not omega > 0.0 or not self.contacts(w, omega):
            return None
        try:
            dynamics = self.structure.at(omega, self.damping(last), mode)
        except np.linalg.LinAlgError:
            return None
        forces = self.shifted_forces(w)
        phi, by_omega = self._pushes(forces, omega, q, dynamics)
        x = dynamics.solve(phi + self.driven(last, log_amplitude))
        return self._assemble(w, q, forces, x, by_omega, dynamics, log_amplitude, phase)

    def damping(self, last: float) -> float:
        """Return ζ from the last unknown."""
        return last

    def driven(self, _last: float, _log_amplitude: float) -> Complex | float:
        """Return the force on the coordinates that the last unknown stands for, (nk, N) or 0."""
        return 0.0

    def by_last(self, x: Complex, dynamics: Dynamics, _log_amplitude: float) -> Complex:
        """Return the derivative of the forces on the coordinates by the last unknown, (nk, N)."""
        return -self.structure.times(dynamics.by_zeta, x)

    def _pushes(self, forces: Real, omega: float, q: complex, dynamics: Dynamics) -> tuple[Complex, Complex]:
        """Return φ − Lᴴ F + ρ M b q, (nk, N), and its derivative by ω."""
        s = self.structure
        # Along an engine-order line loads and constant forces follow ω.
        moved = self.lead(self.point.dF_dp)
        phi, by_omega = np.empty((2, s.ks.size, s.force.size), np.complex128)
        fill_pushes(s.ks, s.back, forces, moved, phi, by_omega)
        if s.ks[0] == 0:
            phi[0] += s.constant * (s.level @ omega ** np.arange(3))
            by_omega[0] += s.constant * (s.level[1] + 2.0 * omega * s.level[2])
        phi[s.first] += dynamics.rho * dynamics.b * q
        return phi, by_omega

    def pushes_by_omega(self, forces: Real, omega: float, q: complex, dynamics: Dynamics) -> Complex:
        """Return the derivative by ω of what pushes the coordinates, (nk, N), where last evaluated."""
        return self._pushes(forces, omega, q, dynamics)[1]

    def _assemble(
        self, w: Real, q: complex, forces: Real, x: Complex, by_omega: Complex, dynamics: Dynamics,
        log_amplitude: float, phase: Complex,
    ) -> Evaluated:  # fmt: skip
        """Put residual and Jacobian together."""
        s, size = self.structure, self.size
        first = s.first
        mass, moved = s.times(s.mass, x), x[first]
        squared = max(float(np.vdot(x, mass).real), 1e-300)
        residual = np.empty(size + BESIDES)
        off = q - np.vdot(dynamics.b, moved)
        residual[size], residual[size + 1] = off.real, off.imag
        residual[size + 2] = np.vdot(phase, moved).real
        residual[size + 3] = 0.5 * math.log(squared) - log_amplitude

        pushes, rows, turned = self._pushed, self._rows, self._turned
        pushes[0, first] = dynamics.rho * dynamics.b
        np.subtract(by_omega, s.times(dynamics.by_omega, x), out=pushes[1])
        pushes[2] = self.by_last(x, dynamics, log_amplitude)
        turned[first] = phase
        rows[0, first], rows[1], rows[2] = dynamics.b, self._second_last(x, turned), mass / squared
        slopes, rough = self._linearised(w, forces, x, dynamics, residual)
        return Evaluated(
            residual=residual, slopes=slopes, by_log_amplitude=self._by_log_amplitude, x=x, forces=forces,
            rough=rough, lag=math.sqrt(np.vdot(phase, phase).real * np.vdot(moved, moved).real),
            loose=self.loose(), dynamics=dynamics,
        )  # fmt: skip

    def _linearised(
        self, w: Real, forces: Real, x: Complex, dynamics: Dynamics, residual: Real
    ) -> tuple[Real | SparseJacobian, Real]:
        """Return the Jacobian and what residuals of motions are rounding of; fill these in `residual`."""
        s, layout, factors = self.structure, self._layout, dynamics.inverse
        pushes, rows, m = self._pushed, self._rows, residual.size
        if layout is not None and isinstance(factors, Factors):
            residual[: self.size] = w.reshape(-1) - layout.L @ layout.coefficients(x)
            rough = layout.reach(factors) * np.abs(forces).max(initial=0.0)
            return SparseJacobian(layout, factors, self.point.G, pushes, rows), rough
        J, rough = np.empty((m, m)), np.empty(self.size)
        changes = dynamics.solve(pushes)
        fill_slopes(s.ks, self._blocks, self.point.G, self.balance.system.span, self._slopes)
        A = np.ascontiguousarray(dynamics.receptance())
        fill_motions(s.ks, s.contact, A, self._slopes, x, w, changes, forces, residual, J, rough)
        fill_functionals(s.back, self._slopes, rows, dynamics.solve_adjoint(rows), changes, J)
        return J, rough

    def _second_last(self, _x: Complex, turned: Complex) -> Complex:
        """Return c (nk, N) of the equation before the last, Re Σ c_kᴴ x_k: `turned` is that of the phase."""
        return turned


class Forced(Equations):
    """The responses to the excitation times a factor, which is the last unknown, in place of ζ."""

    KEEPS_J = False

    def __init__(self, balance: Balance) -> None:
        super().__init__(balance)
        self.unit = 1.0  # what the factor counts in

    def damping(self, _last: float) -> float:
        """Return ζ: none but the structure's own."""
        return 0.0

    def driven(self, last: float, log_amplitude: float) -> Complex | float:
        """Return the force of a factor."""
        return last * self.by_force(log_amplitude)

    def by_last(self, _x: Complex, _dynamics: Dynamics, log_amplitude: float) -> Complex:
        """Return that of 1."""
        return self.by_force(log_amplitude)

    def by_force(self, _log_amplitude: float = 0.0) -> Complex:
        """Return the excitation in this unit on the coordinates, (nk, N)."""
        s = self.structure
        force = np.zeros((s.ks.size, s.force.size), np.complex128)
        force[s.first] = self.unit * s.force
        return force


class Held(Forced):
    """The responses with a given harmonic 1, or max|x|, of the observed DOF; the last unknown is z.

    They are those of the balance under the force z c f with ln (|o x_1| / A) = 0 and ln ω − λ = 0, o the row
    of the DOF, in place of phase and modal amplitude; the curve is followed over λ = ln ω.

    Attributes
    ----------
    target : A [m].
    unit : c, the factor on the excitation that z counts in.
    whole : max|x| is held, not harmonic 1 alone.
    """

    def __init__(self, balance: Balance) -> None:
        super().__init__(balance)
        self.target, self.whole = 1.0, False

    def over(self, balance: Balance) -> Held:
        """Return the same question to another balance of the scene."""
        other = Held(balance)
        other.target, other.unit, other.whole = self.target, self.unit, self.whole
        return other

    def follows(self, before: Real, y: Real) -> bool:
        """Return whether z keeps its sign: it can not pass 0, where the force would feed nothing.

        Over a sharp resonance a long step would: the force that turns by half a period within it is the same
        with the other sign.
        """
        return bool(before[-1] * y[-1] > 0.0)

    def _seen(self, x: Complex) -> tuple[float, Complex]:
        """Return what is held [m], and c (nk, N) of its change Re Σ c_kᴴ dx_k."""
        s = self.structure
        if not self.whole:
            seen = complex(np.sum(s.observe[s.first] * x[s.first]))
            row = np.zeros_like(x)
            row[s.first] = s.observe[s.first].conj() * seen / max(abs(seen), 1e-300)
            return abs(seen), row
        return self.top(x)

    def _second_last(self, x: Complex, _turned: Complex) -> Complex:
        """Return c of the change of the logarithm of what is held."""
        size, row = self._seen(x)
        return row / max(size, 1e-300)

    def _assemble(
        self, w: Real, q: complex, forces: Real, x: Complex, by_omega: Complex, dynamics: Dynamics,
        log_amplitude: float, phase: Complex,
    ) -> Evaluated:  # fmt: skip
        """Put residual and Jacobian together; `log_amplitude` is λ."""
        s, size, omega = self.structure, self.size, math.exp(log_amplitude)
        at = super()._assemble(w, q, forces, x, by_omega, dynamics, log_amplitude, phase)
        residual, J = at.residual, at.jacobian
        residual[size + 2] = math.log(max(self._seen(x)[0], 1e-300) / self.target)
        # q is counted in what moves; `relative_residual` counts it in e^λ.
        unit = omega / max(math.sqrt(s.squared_amplitude(x)), 1e-300)
        residual[size : size + 2] *= unit
        J[size : size + 2] *= unit
        J[size + 3] = 0.0
        return replace(at, lag=1.0)

    def at_frequency(self, at: Evaluated, omega: float, log_omega: float) -> Evaluated:
        """Return the equations with ln ω − λ in their last row."""
        at.residual[-1] = math.log(omega) - log_omega
        at.jacobian[-1, -2] = 1.0 / omega
        return at

    def evaluate(self, y: Real, log_amplitude: float, phase: Complex, mode: int) -> Evaluated | None:
        """Return the equations at y, at λ = `log_amplitude`; None where a law failed or Z is singular."""
        at = super().evaluate(y, log_amplitude, phase, mode)
        return None if at is None else self.at_frequency(at, float(y[-2]), log_amplitude)


def _block_places(balance: Balance) -> Integer:
    """Return row port, column port and number of every block of dF_dU, (nb, 3)."""
    system = balance.system
    places = [
        (first + a, first + b, block + a * m + b)
        for first, m, block in zip(
            system.first_port[:-1], np.diff(system.first_port), system.first_block[:-1], strict=True
        )
        for a in range(m)
        for b in range(m)
    ]
    return np.array(places, dtype=np.int64).reshape(-1, 3)
