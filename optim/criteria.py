"""Derivatives of amplitudes and band edges of a response by design parameters, through the whole solve.

Peak: at a maximum over the frequency ∂a/∂ω = 0, so its derivative by a parameter is the partial one there
(envelope theorem). At an end of the band the frequency does not move either, so the same holds. Band edge:
a(ω_e, p) = limit, so dω_e/dp = (dlimit/dp − ∂a/∂p)/(∂a/∂ω).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from optim.variables import Real
from solver.balance import Balance, for_parameter
from solver.branch import Edge, Peak
from solver.kernels.observe import SLOPE
from solver.workspace import Workspace


class Sensitivity:
    """Derivatives of the amplitude at points of a response by parameter paths, through the whole solve."""

    def __init__(self, balance: Balance, paths: Sequence[str]) -> None:
        self._paths = tuple(paths)
        self._balance = balance
        self._by_frequency = Workspace.of(self._balance)

    def _by_parameters(self, at_hz: float, solution: Real) -> Real:
        """Return ∂a/∂p at a fixed frequency for every path."""
        slopes = np.full(len(self._paths), np.nan)
        for i, path in enumerate(self._paths):
            balance = for_parameter(self._balance, path, at_hz)
            value = balance.parameter.inside(self._balance.scene.value(path))
            measures = Workspace.of(balance).measure(solution, value)
            if measures is not None:
                slopes[i] = measures.values[SLOPE]
        return slopes

    def peak(self, peak: Peak) -> Real:
        """Return d peak / dp, (n_paths,)."""
        return self._by_parameters(peak.at, peak.solution)

    def band(self, edges: Sequence[Edge], dlimit: Real) -> Real:
        """Return d width / dp [Hz per unit], (n_paths,), for a limit that changes by `dlimit`."""
        total = np.zeros(len(self._paths))
        for edge in edges:
            measures = self._by_frequency.measure(edge.solution, 2.0 * math.pi * edge.at)
            if measures is None or measures.values[SLOPE] == 0.0:
                return np.full(len(self._paths), np.nan)
            by_hz = measures.values[SLOPE] * 2.0 * math.pi
            moves = (dlimit - self._by_parameters(edge.at, edge.solution)) / by_hz
            total += -moves if edge.opens else moves
        return total
