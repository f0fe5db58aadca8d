"""A design over the uncertainty: nominal peak, worst peak with its scenario, mean and quantiles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from optim.criteria.band import BAND
from optim.criteria.criterion import Row
from optim.criteria.peak import PEAK
from optim.methods.kkt import KEPT
from optim.problem.uncertainty_set import Scenario
from optim.problem.words import Aim
from optim.robust.result import Side, Spread
from optim.robust.risk_measure import rank_of
from optim.robust.scenarios import Outcome
from optim.robust.search import RobustSearch
from optim.robust.worst_case import MOST_BESIDES, Aspect, UnknownScenarioError, pessimise
from solver.results.known import worst_of


def side_of(
    search: RobustSearch,
    values: Mapping[str, float],
    drawn: Sequence[Scenario],
    scenarios: Sequence[Scenario],
) -> Side:
    """Return a design over the uncertainty.

    Parameters
    ----------
    search : what is judged, and over what.
    values : the design.
    drawn : the samples.
    scenarios : that may be the worst.
    """
    nominal = search.outcome(values, Scenario(), gradients=False)
    slopes = not search.uncertain.finite  # the search for the worst begins from them
    samples = [search.outcome(values, scenario, gradients=slopes) for scenario in drawn]
    peaks = [found.highest(PEAK) if found.good else None for found in samples]
    worst, unknown = _worst(search, values, samples, scenarios)
    peak, band = nominal.highest(PEAK), nominal.highest(BAND)
    places = [Scenario()] if worst is None else [Scenario(), worst.scenario]
    known = worst_of(search.known(values, scenario) for scenario in dict.fromkeys(places))
    return Side(
        values=dict(values), peak=math.nan if peak is None else peak.value,
        at_hz=math.nan if peak is None else peak.at_hz, band_hz=math.nan if band is None else band.value,
        worst=worst, spread=Spread(peaks=tuple(math.nan if row is None else row.value for row in peaks)),
        feasible=unknown is None and _feasible(search, values, samples, scenarios), unknown=unknown,
        known=known,
    )  # fmt: skip


def _worst(
    search: RobustSearch, values: Mapping[str, float], samples: Sequence[Outcome], known: Sequence[Scenario]
) -> tuple[Outcome | None, Scenario | None]:
    """Return the design in the scenario of the highest peak; or None and the scenario that is not known."""
    aspect = Aspect(quantity=PEAK, limited=False, plain=True)
    ranked = sorted((o for o in samples if o.good), key=lambda found: -aspect.worst(found.rows))
    besides = [found.scenario for found in ranked[:MOST_BESIDES]]
    try:
        finding = pessimise(
            lambda scenario: search.outcome(values, scenario),
            search.uncertain,
            aspect,
            known,
            besides=besides,
            thorough=True,
        )
    except UnknownScenarioError as error:
        return None, error.scenario
    return finding.worst, None


def _feasible(
    search: RobustSearch, values: Mapping[str, float], samples: Sequence[Outcome], known: Sequence[Scenario]
) -> bool:
    """Return whether the limits are kept in every scenario tried, with a quantile in its share of samples."""
    excess = [_excess(search, found.rows) for found in samples]
    if search.aim is Aim.QUANTILE:
        return sorted(excess)[rank_of(search.quantile, len(excess)) - 1] <= KEPT
    excess += [_excess(search, search.outcome(values, scenario).rows) for scenario in known]
    return max(excess, default=-math.inf) <= KEPT


def _excess(search: RobustSearch, rows: Sequence[Row]) -> float:
    return max((row.excess(search.scales[row.quantity]) for row in rows), default=math.inf)
