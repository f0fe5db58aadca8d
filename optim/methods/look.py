"""The designs looked at over the whole range, what they tell of others, and which others are worth a look.

With several variables half the harmonics serve: they only rank designs, by as much as both differ where both
were computed, and none of their numbers is kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.methods.evaluator import DesignSearch
from optim.methods.kkt import KEPT, Local, is_flat
from optim.methods.surrogate import (
    Taylor,
    between,
    candidates,
    places,
    promising,
    quasi_random,
    taylor_of,
)
from optim.problem.variables import Real, unscaled

FEWEST = 3  # harmonics of a look with several variables, at least
# Designs of a look for each variable, and so many more, before what was seen says which others are worth one:
# the middles and the two corners where all variables have one bound, and some between.
SURE = 3
LOOSE = 2.0  # spreads by which a prediction may be too high there, or where limits may be kept
WORTH = 1.3  # how much higher than the best end the potential of a design to start from may be
BETTER = 1e-6  # relative difference from which a design is better than another
BATCH = 4  # designs a round and variable
APART = {1: 1.0 / 256.0, 2: 0.02}  # scaled distance from which two designs of a look are two
APART_MANY = 0.05
# Before it is said that no design keeps the limits: places for each variable that are compared, so many of
# them looked at in a round, and halvings of the range of one variable everywhere and where the limits may be
# kept, which are rounds too.
MORE_EACH, MORE_AT_ONCE, SEED = 256, 8, 7
COARSE, FINEST = 5, 10


class Look:
    """Designs looked at; `seen`: those of an earlier look with fewer harmonics; `found`: ends of searches."""

    def __init__(
        self, search: DesignSearch, found: Sequence[Local], seen: Sequence[DesignEvaluation] = ()
    ) -> None:
        self.search = search
        n = self.n = len(search.variables)
        few = max(FEWEST, (search.problem.harmonics + 1) // 2)
        few = few if n > 1 else search.problem.harmonics
        few = min((one.harmonics for one in seen), default=few)
        self.scout = search if few >= search.problem.harmonics else search.scout(few)
        self.seen = [one for one in seen if one.harmonics == few]
        self.apart = APART.get(n, APART_MANY)
        self.off = 0.0  # natural logarithm by which the look's harmonics are off
        self._slack = 0.0  # relative excess over limits that they show of designs that keep them
        self._found = found

    @property
    def whole(self) -> bool:
        """Whether it has all harmonics."""
        return self.scout is self.search

    def first(self) -> None:
        """Look over the whole range for the first time."""
        if self.seen:
            return
        sure = SURE * (self.n + 1)
        begin = list(places(self.n))
        self.at(begin[:sure])
        for z in begin[sure:]:
            if self._worth(z):
                self.at([z])

    def at(self, several: Sequence[Real]) -> None:
        """Look at designs; those without numbers are not kept."""
        every = [unscaled(self.search.variables, z) for z in several]
        self.scout.ahead(every)
        for values in every:
            evaluation = self.scout(values)
            if evaluation.good:
                self.seen.append(evaluation)

    def ended(self, best: Local) -> DesignEvaluation | None:
        """Look at where a search ended, which tells how far off the look is; None without numbers."""
        there = best.evaluation if self.whole else self.scout(best.evaluation.values)
        if not there.good:
            return None
        if not self.whole:
            exact, rough = best.evaluation.objective, there.objective
            self.off = max(self.off, abs(math.log(max(exact, 1e-300) / max(rough, 1e-300))))
            if best.feasible:
                self._slack = max(self._slack, self.scout.model(there).violation)
        self.seen.append(there)
        return there

    def _worth(self, z: Real) -> bool:
        """Return whether a place of the look may be one to start from, as far as what was seen tells."""
        if self.n == 1 or not self.seen:
            return True
        models = self.models()
        known = np.array([model.place for model in models])
        mean, spread = between(models, known, z[None, :])
        least = min(model.value for model in models)
        return bool(mean[0] - LOOSE * spread[0] < WORTH * least)

    def flat(self) -> bool:
        """Return whether no design depends on any variable, with all harmonics too."""
        if not self.seen or not all(is_flat(self.scout.model(e)) for e in self.seen):
            return False
        return all(is_flat(self.search.model(e)) for e in self.exact(self.seen[:2]))

    def exact(self, some: Iterable[DesignEvaluation]) -> list[DesignEvaluation]:
        """Return designs of the look with all harmonics, those that can be computed."""
        if self.whole:
            return list(some)
        chosen = list(some)
        self.search.ahead(e.values for e in chosen)
        exact = [self.search(e.values) for e in chosen]
        return [e for e in exact if e.good]

    def infeasible(self) -> bool:
        """Return whether no design known keeps all limits."""
        known = (*self.seen, *(local.evaluation for local in self._found))
        return all(self.scout.model(e).violation > KEPT for e in known)

    def models(self) -> list[Taylor]:
        """Return what the designs of the look tell of others: of what is minimised, or of the limits."""
        feasibility = self.infeasible()
        models = [self.scout.model(e) for e in self.seen]
        if not feasibility:
            models = [replace(model, excess=model.excess - self._slack) for model in models]
        return [taylor_of(model, feasibility=feasibility) for model in models]

    def where_kept(self) -> None:
        """Look wherever the limits may be kept, until they are or nothing is left to look at."""
        places = self._between_all if self.n == 1 else self._where_kept
        for _ in range(FINEST):
            more = places()
            self.at(more)
            if not more or not self.infeasible():
                break

    def _between_all(self) -> list[Real]:
        """Return the middles of the intervals of one variable that are wide, or may have a design kept."""
        models = sorted(self.models(), key=lambda model: float(model.place[0]))
        return [
            0.5 * (one.place + other.place)
            for one, other in pairwise(models)
            if (wide := float((other.place - one.place)[0])) > 2.0**-FINEST
            and (wide > 2.0**-COARSE or _may_keep(one, other))
        ]

    def _where_kept(self) -> list[Real]:
        """Return places where the limits may be kept, as far as what was seen tells."""
        return promising(
            self.models(), quasi_random(self.n, 2 ** math.ceil(math.log2(MORE_EACH * self.n)), SEED),
            (1.0 + KEPT) * math.exp(self.off), self.apart, MORE_AT_ONCE * self.n, doubt=LOOSE,
        )  # fmt: skip

    def minima(self) -> list[tuple[float, DesignEvaluation]]:
        """Return the designs that no neighbour beats, by what they may lead to, the least first."""
        models = self.models()
        known = np.array([model.place for model in models])
        values = np.array([model.value for model in models])
        distance = np.abs(known[:, None, :] - known).max(axis=2)
        count = min(2 * self.n + 1, len(models))
        near = np.argpartition(distance, count - 1, axis=1)[:, :count]
        reach = np.sort(distance, axis=1)[:, min(2, len(models) - 1)]
        minima = np.flatnonzero(values <= values[near].min(axis=1))
        if self.n == 1:
            order = np.argsort(known[:, 0])
            line = np.concatenate([[np.inf], values[order], [np.inf]])
            minima = order[(line[1:-1] <= line[:-2]) & (line[1:-1] <= line[2:])]
        steps = np.vstack([np.zeros(self.n), 2.0 * candidates(self.n, 1)[:64] - 1.0])
        found = []
        for i in minima.tolist():
            around = np.clip(known[i] + reach[i] * steps, 0.0, 1.0)
            found.append((float(models[i].at(around).min()), self.seen[i]))
        return sorted(found, key=lambda each: each[0])

    def least(self) -> float:
        """Return the least of what is minimised, or of the limits, by as much higher as the look is off."""
        return min(model.value for model in self.models()) * math.exp(self.off)

    def further(self, turn: int) -> list[Real]:
        """Return places to look at, where what is known leaves room for something better than the best."""
        if not self.seen:
            return []
        enough, most = (1.0 - BETTER) * self.least(), BATCH * min(self.n, 3)
        return promising(self.models(), candidates(self.n, turn), enough, self.apart, most)


def _may_keep(one: Taylor, other: Taylor) -> bool:
    """Return whether an excess counted from 1 may fall to none between two designs, by value and slopes.

    It may be lower than they say by as much as each is wrong about the other, a few times.
    """
    ahead, back = one.at(other.place[None, :])[0], other.at(one.place[None, :])[0]
    unsure = max(abs(ahead - other.value), abs(back - one.value))
    return bool(min(one.value, other.value, ahead, back) - LOOSE * unsure <= 1.0 + KEPT)
