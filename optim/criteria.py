"""The two criteria of a damper, peak amplitude and resonance band, with analytic gradients.

Peak: at a maximum over the frequency ∂a/∂ω = 0, so its derivative by a parameter is the partial one there
(envelope theorem). At an end of the band the frequency does not move either, so the same holds. Band edge:
a(ω_e, p) = limit, so dω_e/dp = (dlimit/dp − ∂a/∂p)/(∂a/∂ω).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from optim.scaling import Real
from solver.balance import Balance, for_parameter
from solver.branch import Branch, Edge, Peak
from solver.continuation import sweep
from solver.kernels.observe import SLOPE
from solver.peaks import HALF_POWER
from solver.savings import Effects, even_harmonics_reason
from solver.scene import Scene
from solver.workspace import Workspace

# Peaks below this share of the highest are not handed to the optimiser: within one step they cannot lead.
COMPETES = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakCriterion:
    """One peak over the band.

    Attributes
    ----------
    value : float
        max|x| of the observed DOF [m].
    at : float
        Its frequency [Hz].
    gradient : (n_variables,) array
        By each parameter [m per unit of it]; NaN where the balance is singular.
    """

    value: float
    at: float
    gradient: Real


@dataclass(frozen=True, slots=True, kw_only=True)
class BandCriterion:
    """The measure of the frequencies where the amplitude exceeds a limit.

    Attributes
    ----------
    width : float
        Hz.
    limit : float
        Amplitude [m]; half power of the highest peak unless the user gave one.
    gradient : (n_variables,) array
        Hz per unit of each parameter.
    """

    width: float
    limit: float
    gradient: Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Criteria:
    """Both criteria of one design.

    Attributes
    ----------
    values : mapping
        The design: parameter path to value.
    branch : Branch
        The frequency response behind the numbers.
    peaks : tuple of PeakCriterion
        All that compete, highest first; empty unless the response covered the whole band.
    band : BandCriterion or None
        None without a peak.
    """

    values: Mapping[str, float]
    branch: Branch
    peaks: tuple[PeakCriterion, ...]
    band: BandCriterion | None

    @property
    def good(self) -> bool:
        """Whether the whole band was covered, so that the numbers mean something."""
        return self.branch.completed and bool(self.peaks) and math.isfinite(self.peaks[0].value)


def evaluate(
    scene: Scene,
    values: Mapping[str, float],
    *,
    harmonics: int,
    limit: float | None,
    gradients: bool = True,
    should_stop: Callable[[], bool] | None = None,
) -> Criteria:
    """Evaluate both criteria of one design.

    Parameters
    ----------
    scene : the scene; its `observe.band` is searched.
    values : the design.
    harmonics : highest harmonic kept.
    limit : amplitude [m] of the band; half power of the highest peak if None.
    gradients : compute them (otherwise they are NaN).
    should_stop : asked while the response is computed.
    """
    here = scene.with_values(dict(values))
    # A slope by the variation of a load needs the harmonics that variation brings in.
    effects = Effects(even_harmonics=even_harmonics_reason(here, values) is not None)
    branch = sweep(here, harmonics=harmonics, limit=limit, effects=effects, should_stop=should_stop)
    if not branch.completed:
        return Criteria(values=dict(values), branch=branch, peaks=(), band=None)
    competing = [peak for peak in branch.peaks if peak.value >= COMPETES * branch.peaks[0].value]
    paths = tuple(values)
    sensitivity = Sensitivity(branch.balance, paths) if gradients else None
    nothing = np.full(len(paths), np.nan)
    peaks = tuple(
        PeakCriterion(
            value=peak.value, at=peak.at, gradient=nothing if sensitivity is None else sensitivity.peak(peak)
        )
        for peak in competing
    )
    band = None
    if branch.band is not None:
        slope = nothing
        if sensitivity is not None:
            dlimit = np.zeros(len(paths)) if limit is not None else peaks[0].gradient * HALF_POWER
            slope = sensitivity.band(branch.band.edges, dlimit)
        band = BandCriterion(width=branch.band.width, limit=branch.band.limit, gradient=slope)
    return Criteria(values=dict(values), branch=branch, peaks=peaks, band=band)


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
