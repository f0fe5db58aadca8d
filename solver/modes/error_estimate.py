"""What more harmonics would change of a nonlinear mode: one Newton step with twice as many."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.contacts.kernels.system import DENSE
from solver.jit.fourier import Real
from solver.modes.corrector import Corrected, ModeState, scales
from solver.modes.equations import BESIDES, Equations
from solver.scene.harmonics import MOST_HARMONICS, spread


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
