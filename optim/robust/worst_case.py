"""The worst scenario of a design: maximising what it is judged by over the uncertainty, with exact gradients.

A search from several starts. Over intervals and ellipsoids the gradient of every competing peak points to
the place where that peak's linear model is largest (a corner of the box, a point of the ellipsoid); from the
best places seen, a sequential quadratic programme (SLSQP: Kraft, DFVLR-FB 88-28 (1988)) climbs on, for a
worst case inside the set. A finite set is simply tried.

A thorough search looks at the whole set as well: corners, middles of faces and a Sobol sequence, then
wherever the slopes of what was seen leave room for something worse (`optim.methods.linearised`), until
nothing does or a few rounds have found nothing; and it climbs from every place that stands out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import minimize

from optim.criteria.criterion import Criterion, CriterionRow
from optim.methods.linearised import Taylor, candidates, places, promising
from optim.problem.uncertainty_set import Disk, Scenario, UncertainSet, UncertaintyShape
from optim.problem.variables import Real
from optim.robust.scenarios import Outcome

MOST_CORNERS = 16  # corners that are all tried
MOST_JUMPS = 12  # to the places that gradients point to
CLIMBS = 2  # places climbed from
CLIMB_STEPS = 30
THOROUGH_CLIMBS = 4  # the same of a thorough search
BATCH = 3  # scenarios a round and uncertain parameter
IDLE = 2  # rounds in a row that find nothing worse
MOST_ROUNDS = 10
APART = 0.02  # distance of two scenarios, as a share of the width of the set
WORSE = 1e-6  # relative, from which a scenario is worse
NEAR_TOP = 0.85  # of the worst seen, from which a place is climbed from
OUTWARD = 1e-9  # relative slope at a corner above which it is a local maximum
MOST_BESIDES = 64  # drawn scenarios, the worst of them, that a look begins with
SAME = 1e-9  # distance within which two places are one


class UnknownScenarioError(Exception):
    """A scenario whose response could not be computed: the worst case is not known."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        super().__init__(scenario.words())


@dataclass(frozen=True, slots=True, kw_only=True)
class Aspect:
    """One of the numbers whose worst case counts."""

    quantity: Annotated[Criterion, "Of which rows."]
    limited: Annotated[bool, "Their excess over the bounds; otherwise their weighted value."]
    unit: Annotated[float, "What an excess over a bound of 0 is relative to."] = 1.0
    plain: Annotated[bool, "The value itself, without weight."] = False

    def of(self, row: CriterionRow) -> float:
        """Return the number of a row; −inf if it does not count."""
        if row.quantity is not self.quantity:
            return -math.inf
        if self.plain:
            return row.value
        if self.limited:
            return row.excess(self.unit)
        return row.weight * row.value if row.weight > 0.0 else -math.inf

    def factor(self, row: CriterionRow) -> float:
        """Return d number / d value of a row."""
        if self.plain:
            return 1.0
        return 1.0 / row.unit_of(self.unit) if self.limited else row.weight

    def worst(self, rows: Iterable[CriterionRow]) -> float:
        """Return the largest number; −inf without any."""
        return max((self.of(row) for row in rows), default=-math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """The worst scenarios of a design in one aspect."""

    worst: Annotated[Outcome, "The design in the worst of them."]
    value: Annotated[float, "The number there."]
    outcomes: Annotated[tuple[Outcome, ...], "Everything tried, worst first."]
    finished: Annotated[
        bool, "Whether every scenario was tried, or a look over the whole set came to its end."
    ]


Ask = Callable[[Scenario], Outcome]
Ahead = Callable[[Sequence[Scenario]], None]


def pessimise(
    ask: Ask, uncertain: UncertainSet, aspect: Aspect, known: Sequence[Scenario], *,
    ahead: Ahead = lambda _scenarios: None, besides: Sequence[Scenario] = (), thorough: bool = False,
) -> Finding:  # fmt: skip
    """Return the worst scenario of a design in one aspect.

    Parameters
    ----------
    ask : the design in a scenario, with gradients.
    uncertain : all scenarios.
    aspect : what is maximised.
    known : scenarios to start from.
    ahead : told of scenarios that will be asked for.
    besides : more scenarios to try, drawn at random.
    thorough : look at the whole set.

    Raises
    ------
    UnknownScenarioError
        A response could not be computed.
    """
    finished = uncertain.finite or thorough
    if uncertain.finite:
        ahead(list(uncertain.all()))
        tried = [_asked(ask, scenario) for scenario in uncertain.all()]
    else:
        tried = []
        for disk in uncertain.disks or (None,):
            mine = [s for s in (*known, *besides) if s.given_disk == disk and uncertain.inside_of(s)]
            ascent = _Ascent(ask, ahead, uncertain, aspect, disk)
            tried += ascent.run(mine)
            if thorough:
                inside = sum(max(map(abs, s.xi)) < 1.0 for s in besides if s in mine)
                finished = ascent.look(inside) and finished
                tried = [*tried, *ascent.outcomes]
    ranked = sorted(tried, key=lambda found: -aspect.worst(found.rows))
    return Finding(
        worst=ranked[0], value=aspect.worst(ranked[0].rows), outcomes=tuple(ranked), finished=finished
    )


def _asked(ask: Ask, scenario: Scenario) -> Outcome:
    found = ask(scenario)
    if not found.good:
        raise UnknownScenarioError(scenario)
    return found


class _Ascent:
    """The search of one disk over the unit box or ball."""

    def __init__(
        self, ask: Ask, ahead: Ahead, uncertain: UncertainSet, aspect: Aspect, disk: Disk | None
    ) -> None:
        self._ask, self._ahead = ask, ahead
        self._set, self._aspect, self._disk = uncertain, aspect, disk
        self._tried: list[tuple[Real, Outcome]] = []
        self._climbed: list[Real] = []

    def run(self, starts: Sequence[Scenario]) -> list[Outcome]:
        """Try the starts, what their gradients point to, the corners if they are few, and climb."""
        n = len(self._set.centre)
        corners = self._set.corners(MOST_CORNERS)
        begins = ((0.0,) * n, *(scenario.xi for scenario in starts), *corners)
        self._all_at([np.array(start) for start in begins])
        for _ in range(MOST_JUMPS):
            jump = self._promising()
            if jump is None:
                break
            self._at(jump)
        for place, found in sorted(self._tried, key=lambda pair: -self._value(pair[1]))[:CLIMBS]:
            if not self._is_top(place, found):
                self._climb(place)
        return self.outcomes

    @property
    def outcomes(self) -> list[Outcome]:
        """Everything tried."""
        return [found for _, found in self._tried]

    def look(self, known: int) -> bool:
        """Look at the whole set, and climb from what stands out; return whether that came to its end.

        So many places between the bounds are `known`: random ones, that were tried already.
        """
        n = len(self._set.centre)
        self._all_at([2.0 * z - 1.0 for z in places(n, known if n > 1 else 0)])
        idle = 0
        for turn in range(MOST_ROUNDS):
            worst = self._worst()
            self._climbs()
            idle = 0 if turn == 0 or self._worst() > worst + WORSE * abs(worst) else idle + 1
            worst = self._worst()
            more = self._room(turn)
            if not more or idle >= IDLE:
                return True
            self._all_at([2.0 * z - 1.0 for z in more])
            if self._worst() > worst + WORSE * abs(worst):
                idle = 0
        return False

    def _worst(self) -> float:
        return max(self._value(found) for _, found in self._tried)

    def _climbs(self) -> None:
        """Climb from the places that are worse than their neighbours and may lead above the worst."""
        known = np.array([place for place, _ in self._tried])
        values = np.array([self._value(found) for _, found in self._tried])
        count = min(2 * known.shape[1] + 1, len(known))
        distance = np.abs(known[:, None, :] - known).max(axis=2)
        near = np.argpartition(distance, count - 1, axis=1)[:, :count]
        reach = np.sort(distance, axis=1)[:, min(2, len(known) - 1)]
        tops = np.flatnonzero(values >= values[near].max(axis=1))
        enough = values.max() - (1.0 - NEAR_TOP) * abs(values.max())
        chosen = [i for i in tops[np.argsort(-values[tops])] if values[i] >= enough]
        for i in chosen[:THOROUGH_CLIMBS]:
            place, found = self._tried[i]
            fresh = all(np.abs(place - other).max() > SAME for other in self._climbed)
            model = self._model(place, found)
            if fresh and model is not None and not self._is_top(place, found):
                around = place + reach[i] * (2.0 * candidates(place.size, 0) - 1.0)
                there = self._unit(list(around))
                worst = self._worst()
                if model.at(there).max() > worst + WORSE * abs(worst):
                    self._climb(place)

    def _unit(self, places: Sequence[Real]) -> Real:
        """Return places of the set in the unit box, (k, n)."""
        return 0.5 * (np.array([self._set.inside(place) for place in places]) + 1.0)

    def _model(self, place: Real, found: Outcome) -> Taylor | None:
        """Return what a place tells of others in the unit box; None without slopes."""
        slopes = self._slopes(found)
        if not slopes:
            return None
        by_z = 2.0 * np.array([slope for _, slope in slopes])
        return Taylor(place=0.5 * (place + 1.0), groups=((np.array([value for value, _ in slopes]), by_z),))

    def _room(self, turn: int) -> list[Real]:
        """Return places, of the unit box, whose neighbours leave room for something worse than all seen."""
        models = [model for one in self._tried if (model := self._model(*one)) is not None]
        if not models:
            return []
        n = len(self._set.centre)
        there = self._unit(list(2.0 * candidates(n, turn) - 1.0))
        worst = self._worst()
        return promising(models, there, worst + WORSE * abs(worst), APART, BATCH * n, above=True)

    def _value(self, found: Outcome) -> float:
        return self._aspect.worst(found.rows)

    def _all_at(self, there: Sequence[Real]) -> None:
        """Ask for several places that do not depend on what is found at the others."""
        new = [inside for place in there if not self._tried_at(inside := self._set.inside(place))]
        self._ahead([self._set.scenario(place, self._disk) for place in new])
        for place in there:
            self._at(place)

    def _tried_at(self, place: Real) -> Outcome | None:
        for other, found in self._tried:
            if np.abs(other - place).max(initial=0.0) <= SAME:
                return found
        return None

    def _at(self, place: Real) -> Outcome:
        place = self._set.inside(place)
        if (known := self._tried_at(place)) is not None:
            return known
        found = _asked(self._ask, self._set.scenario(place, self._disk))
        self._tried.append((place, found))
        return found

    def _slopes(self, found: Outcome) -> list[tuple[float, Real]]:
        """Return the numbers of the rows that count with their derivatives by ξ."""
        rows = [(row, by) for row, by in zip(found.rows, found.by_delta, strict=True)]
        return [
            (self._aspect.of(row), self._set.by_xi(self._aspect.factor(row) * by))
            for row, by in rows
            if math.isfinite(self._aspect.of(row)) and np.all(np.isfinite(by))
        ]

    def _promising(self) -> Real | None:
        """Return the place not tried yet whose linear model rises above everything seen; None without one."""
        best, found = max(self._value(one) for _, one in self._tried), None
        for place, outcome in self._tried:
            for value, slope in self._slopes(outcome):
                there = self._set.extreme(slope)
                rise = value + float(slope @ (there - place))
                if rise > best and all(np.abs(other - there).max() > 1e-3 for other, _ in self._tried):
                    best, found = rise, there
        return found

    def _is_top(self, place: Real, found: Outcome) -> bool:
        """Return whether the highest row falls in every direction into the box from one of its corners."""
        top = max(self._slopes(found), key=lambda pair: pair[0], default=None)
        if top is None or self._set.shape is not UncertaintyShape.BOX or np.any(np.abs(place) < 1.0):
            return False
        return bool(np.all(top[1] * place > OUTWARD * abs(top[0])))

    def _climb(self, begin: Real) -> None:
        """Climb from a place; every place on the way is kept."""
        self._climbed.append(begin)
        scale = abs(self._value(self._at(begin))) or 1.0

        def fall(place: Real) -> tuple[float, Real]:
            value, slope = max(self._slopes(self._at(place)), key=lambda pair: pair[0])
            return -value / scale, -slope / scale

        inside = {"type": "ineq", "fun": lambda x: 1.0 - float(x @ x), "jac": lambda x: -2.0 * x}
        box = self._set.shape is UncertaintyShape.BOX
        minimize(
            fall, begin, jac=True, method="SLSQP", bounds=[(-1.0, 1.0)] * begin.size,
            constraints=[] if box else [inside], options={"maxiter": CLIMB_STEPS, "ftol": 1e-12},
        )  # fmt: skip
