"""The points of a nonlinear mode as arrays, each begun where harmonic 1 lags the excitation by 90 degrees.

What more harmonics would change of a point is told by one Newton step with twice as many.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.balance.balance import build
from solver.balance.kernels.output import extremes
from solver.balance.simplifications import Effects
from solver.contacts.kernels.system import DENSE, System, by_reference
from solver.jit.fourier import Complex, Integer, Real, to_full
from solver.jit.timer import clock
from solver.modes.corrector import Corrected, ModeState, scales
from solver.modes.mode_curve import FollowedCurve
from solver.modes.mode_equations import BESIDES, Equations
from solver.modes.mode_results import NonlinearMode, NonlinearModeStatus
from solver.modes.mode_start import phase_of
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import MOST_HARMONICS, spread


class Wider:
    """The same equations with about twice the harmonics."""

    def __init__(self, equations: Equations) -> None:
        balance = equations.balance
        harmonics = min(2 * balance.n_harmonics + 1, MOST_HARMONICS)
        effects = Effects(
            whole_matrices=balance.system.form == DENSE, even_harmonics=int(balance.system.ks[0]) == 0
        )
        self._given = equations
        self.equations = equations.over(build(balance.scene, harmonics=harmonics, effects=effects))
        self.has_more = harmonics > balance.n_harmonics

    def spread(self, state: ModeState) -> ModeState:
        """Return the same motion, the harmonics it lacks at 0."""
        given = self._given
        w = state.y[: given.size].reshape(given.r, given.n)
        wide = spread(w, given.structure.ks, self.equations.structure.ks).reshape(-1)
        return replace(state, y=np.concatenate([wide, state.y[-BESIDES:]]))

    def estimate(self, found: Corrected) -> tuple[float, float]:
        """Return the changes of frequency [Hz] and of the last unknown by a Newton step; NaN if none.

        The step begins at the point with the harmonics it lacks at 0.
        """
        wide, state = self.equations, found.state
        y = self.spread(state).y
        at = wide.evaluate(y, state.log_amplitude, state.phase, state.mode)
        if at is None:
            return math.nan, math.nan
        move: Real | None = at.step(-at.residual, scales(y, wide.size))
        if move is None:
            return math.nan, math.nan
        return abs(float(move[-2])) / (2.0 * math.pi), abs(float(move[-1]))


_FAINT = 1e-9  # share of the excitation along a mode below which it gives no phase


@dataclass(frozen=True, slots=True, kw_only=True)
class PointRecord:
    """What a point of a curve gives; see `solver.modes.mode_results.NonlinearMode`."""

    motions: Real
    forces: Real
    dofs: Real
    max_abs: float
    states: Integer
    forcing: float
    observed: Real


class Recorder:
    """Makes records of the points of a curve.

    Parameters
    ----------
    turns : the motion may begin at any instant: it is made to begin in the phase of the excitation.
    """

    def __init__(self, equations: Equations, *, turns: bool) -> None:
        self._equations, self._turns = equations, turns
        self._force = phase_of(equations)
        self._system: System = by_reference(equations.balance.system)
        model = equations.balance.model
        self._shapes = np.asarray(model.shapes @ equations.structure.shapes, dtype=np.complex128)

    def of(self, point: Corrected) -> PointRecord:
        """Return the record of a converged point."""
        equations, s, hat = self._equations, self._equations.structure, self._equations.amplitudes
        if point.at is None:
            raise ValueError("a point without a value is none of a curve")
        w = point.state.y[: equations.size].reshape(equations.r, equations.n)
        equations.contacts(w, float(point.state.y[-2]))
        turns = self._angles(point.at.x)
        x = np.asarray(point.at.x * turns[:, None])
        top = equations.balance.highest_harmonic

        def turned(coefficients: Real) -> Real:
            return to_full(hat.coefficients(hat.of(coefficients) * turns), s.ks, top)

        moved = (self._shapes @ x[:, :, None])[:, :, 0]
        observed = hat.coefficients(np.einsum("kn,kn->k", s.observe, x))
        high, _, low, _ = extremes(self._system, observed)
        forcing = abs(complex(np.vdot(s.force, x[s.first]))) / math.exp(point.state.log_amplitude)
        return PointRecord(
            motions=turned(equations.motions(w)), forces=turned(equations.point.F),
            dofs=to_full(hat.coefficients(moved.T), s.ks, top), max_abs=max(high, -low),
            states=equations.point.states.copy(), forcing=forcing,
            observed=to_full(observed, s.ks, top),
        )  # fmt: skip

    def _angles(self, x: Complex) -> Complex:
        """Return e^{ikα} of each harmonic that brings the motion into the phase of the excitation."""
        s = self._equations.structure
        seen = complex(np.vdot(self._force, x[s.first]))
        size = float(np.linalg.norm(self._force) * np.linalg.norm(x[s.first]))
        if not self._turns or abs(seen) <= _FAINT * size:
            return np.ones(s.ks.size, np.complex128)
        turn = -1j * abs(seen) / seen
        return np.asarray(turn ** s.ks.astype(np.float64))


def told_of(
    equations: Equations, points: Sequence[Corrected], rows: Sequence[PointRecord], begun: float
) -> dict[str, Any]:
    """Return the fields of every `ModalCurve`."""
    scene, n = equations.balance.scene, len(points)
    return {
        "scene": scene,
        "max_abs": np.array([row.max_abs for row in rows], dtype=np.float64),
        "states": np.array([row.states for row in rows], dtype=np.int64).reshape(n, len(scene.contacts)),
        "residual": np.array([point.residual for point in points], dtype=np.float64),
        "seconds": clock() - begun,
    }


def last_unknowns(points: Sequence[Corrected]) -> tuple[Real, Real]:
    """Return the frequencies [Hz] and the last unknown of points, (n,) each."""
    y = np.array([point.state.y[-2:] for point in points], dtype=np.float64).reshape(len(points), 2)
    return y[:, 0] / (2.0 * math.pi), y[:, 1]


def collect(
    equations: Equations, curve: FollowedCurve, *, mode: int, turns: bool, errors: bool, begun: float
) -> NonlinearMode:
    """Return the result of a curve; arguments as `solver.modes.nonlinear_mode` has them."""
    balance, points = equations.balance, curve.points
    scene, n, size = balance.scene, len(points), 2 * balance.highest_harmonic + 1
    recorder = Recorder(equations, turns=turns)
    rows = [recorder.of(point) for point in points]
    frequency, zeta = last_unknowns(points)
    error = np.full((n, 2), math.nan)
    if errors and points:
        wider = Wider(equations)
        error = np.array([wider.estimate(point) for point in points])
    logs = np.array([point.state.log_amplitude for point in points], dtype=np.float64)
    return NonlinearMode(
        **told_of(equations, points, rows, begun), mode=mode, nodal_diameter=diameter_of(scene),
        n_harmonics=balance.n_harmonics, status=NonlinearModeStatus[curve.end.name], amplitude=np.exp(logs),
        frequency_hz=frequency, damping_ratio=zeta, frequency_error=error[:, 0], damping_error=error[:, 1],
        contact_motions=np.array([row.motions for row in rows]).reshape(n, balance.n_ports, size),
        contact_forces=np.array([row.forces for row in rows]).reshape(n, balance.n_ports, size),
        dof_motions=np.array([row.dofs for row in rows]).reshape(n, len(scene.dofs), size),
        forcing=np.array([row.forcing for row in rows], dtype=np.float64),
        points=tuple(point.state for point in points),
        whole_matrices=balance.system.form == DENSE, rejected_steps=curve.rejected,
        newton_iterations=sum(point.iterations for point in points),
    )  # fmt: skip


def diameter_of(scene: Scene) -> int | None:
    """Return the nodal diameter of harmonic 1, negative for a wave that travels backward."""
    if not scene.structure.has_sectors:
        return None
    n = scene.structure.sector_count
    folded = scene.engine_order % n
    return folded if folded <= n // 2 else folded - n
