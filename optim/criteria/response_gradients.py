"""Derivatives of amplitudes and band edges of a response by design parameters, through the whole solve.

Peak: at a maximum over the frequency ∂a/∂ω = 0, so its derivative by a parameter is the partial one there
(envelope theorem). At an end of the band the frequency does not move either, so the same holds; where a
contact changes its state at the top, the two smooth pieces that meet there give it
(`solver.sensitivity.nonsmooth`). Band edge: a(ω_e, p) = limit, so dω_e/dp = (dlimit/dp − ∂a/∂p)/(∂a/∂ω). An
interval that ends in a fold, where the branch turns back, moves with it, whatever the limit does: with y the
left null vector of dr/du there, dλ/dp = −(yᵀ ∂r/∂p) / (yᵀ ∂r/∂λ) (W. Govaerts, Numerical Methods for
Bifurcations of Dynamical Equilibria, 2000, chapter 3, doi:10.1137/1.9780898719543). The adjoint of any
quantity that is not stationary at the fold points along y, the more so the closer to it, so that dλ/dp is
minus the ratio of its derivatives by p and by λ. The second derivatives are those of
`solver.sensitivity.gradient`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from optim.problem.variables import Real
from solver.balance.balance import Balance
from solver.continuation.branch import Edge, Peak
from solver.continuation.extrema.extrema import HALF_POWER
from solver.errors import SettingError
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient


class Sensitivity:
    """Derivatives of the amplitude at points of a response by parameter paths, through the whole solve.

    Attributes
    ----------
    amplitudes : Sensitivities
        Those of the amplitude at one frequency.
    """

    def __init__(self, balance: Balance, paths: Sequence[str]) -> None:
        self.amplitudes = Sensitivities(balance, paths)
        self._n = len(tuple(paths))
        self._of = balance, tuple(paths)

    def __reduce__(self) -> tuple[type[Sensitivity], tuple[Balance, tuple[str, ...]]]:
        """Be made anew in another process: what is compiled here is not sent."""
        return Sensitivity, self._of

    @cached_property
    def has_second(self) -> bool:
        """Whether the contacts' laws and the paths have second derivatives here."""
        try:
            self.amplitudes.check_second()
        except SettingError:
            return False
        return True

    def peak(self, peak: Peak) -> Real:
        """Return d peak / dp, (n_paths,)."""
        return peak_gradient(self.amplitudes, peak).gradient

    def band(self, edges: Sequence[Edge], dlimit: Real) -> Real:
        """Return d width / dp [Hz per unit], (n_paths,), for a limit that changes by `dlimit`."""
        total = np.zeros(dlimit.shape)
        for edge in edges:
            slopes = self.amplitudes.gradient(edge.solution, edge.at)
            if not math.isfinite(slopes.by_frequency) or slopes.by_frequency == 0.0:
                return np.full(dlimit.shape, np.nan)
            if edge.corner:
                return np.full(dlimit.shape, np.nan)
            given = np.zeros(dlimit.shape) if edge.fold else dlimit
            moves = (given - slopes.by_parameters) / slopes.by_frequency
            total += -moves if edge.opens else moves
        return total

    def peak_second(self, peak: Peak) -> Real:
        """Return d² peak / dp², (n_paths, n_paths); NaN where it does not exist."""
        found = self.amplitudes.hessian(peak.solution, peak.at)
        return found.of_peak().hessian if peak.interior else found.hessian

    def band_second(self, edges: Sequence[Edge], highest: Peak | None) -> Real:
        """Return d² width / dp², (n_paths, n_paths); the limit is half power of `highest` if given.

        NaN where an interval ends in a fold.
        """
        n = self._n
        if any(edge.fold for edge in edges):
            return np.full((n, n), np.nan)
        dlimit, ddlimit = np.zeros(n), np.zeros((n, n))
        if highest is not None:
            dlimit, ddlimit = HALF_POWER * self.peak(highest), HALF_POWER * self.peak_second(highest)
        total = np.zeros((n, n))
        for edge in edges:
            move = self.amplitudes.hessian(edge.solution, edge.at).of_edge(dlimit, ddlimit).hessian
            total += -move if edge.opens else move
        return total
