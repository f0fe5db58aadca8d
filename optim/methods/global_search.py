"""The search of the whole range: designs that fill the space, local searches from them, and further designs.

Sampled are corners, middles and a Sobol sequence of designs; local searches begin from those that no
neighbour beats; then designs are added wherever the slopes of what was seen say that something better than
the best end may lie (`optim.methods.linearised`), until nothing does, or few rounds have found nothing. What
the local searches found is compared with every design sampled. With several variables half the harmonics
serve: they only rank designs, by as much as both differ where both were computed, and none of their numbers
is kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.methods.evaluator import DesignSearch
from optim.methods.linearised import (
    KEPT,
    Evaluate,
    Local,
    LocalSearch,
    ModelOf,
    Taylor,
    candidates,
    ended,
    is_flat,
    of_limits,
    places,
    predicted,
    promising,
    quasi_random,
    standing,
    taylor_of,
    without_limits,
)
from optim.problem.variables import Real, scaled, snapped, unscaled
from optim.results.design_result import DesignStatus

PATIENCE = 20  # designs of a local search, after which it ends if it is far behind the best end
LITTLE = 1e-5  # relative gain; two such in a row, far behind the best end, and a search is at its own
FAR_OFF = 0.01  # relative excess over a limit that is
IDLE = 3  # rounds in a row that find nothing, after which a look is finished
IDLE_MANY = 2  # the same with more than two variables
MOST_ROUNDS = 16
ON_THE_WAY = (1.0 / 3.0, 2.0 / 3.0)  # to a known end, where it is looked at whether a search leads there
LOOK_AHEAD = 2  # better designs of a local search from one such look to the next
SMALL = 1e-6  # share of the way along which a slope is taken
MOST_BEGINS = 4  # designs that the first local searches begin from
BEGINS_EACH = 4  # and for each variable before it is said that no design keeps the limits
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
# Of the pattern search, where slopes are of no use: scaled steps, what a failed one shrinks by, and designs
# for each variable.
FIRST_STEP, LAST_STEP, SMALLER, MOST = 0.01, 1e-7, 0.35, 40


class GlobalSearch:
    """A search of the whole range of a problem; `seen`: designs sampled before with fewer harmonics."""

    def __init__(
        self, search: DesignSearch, local_search: LocalSearch, seen: Sequence[DesignEvaluation] = ()
    ) -> None:
        self.search = search
        self.found: list[Local] = []
        self.finished = False
        self._local_search = local_search
        self._samples = Samples(search, self.found, seen)
        self._starts: list[Real] = []
        self._ends: list[tuple[Local, DesignEvaluation]] = []  # with the numbers of the look
        self._apart: list[Real] = []  # from where it was looked whether a search leads to one of them

    @property
    def looked_at(self) -> tuple[DesignEvaluation, ...]:
        """Every design of the look, in order."""
        return tuple(self._samples.seen)

    def run(self, given: Iterable[Mapping[str, float]]) -> DesignStatus | None:
        """Search; `given`: designs to begin from besides those sampled.

        Returns
        -------
        Why there is nothing to search; else None, and `found` holds the ends of local searches.
        """
        try:
            self._samples.first()
            begins = [e for values in given if (e := self.search(values)).good]
            if not self._samples.seen and not begins:
                return DesignStatus.NO_RESPONSE
            if self._samples.flat():
                return DesignStatus.FLAT
            self._starts_given(begins)
            self._rounds()
            self._last()
            if not self._feasible() and self.search.problem.limits:
                self._everywhere()
        finally:
            if not self._samples.whole:
                self.search.scouting_done(self._samples.scout)
        return None

    def _starts_given(self, begins: list[DesignEvaluation]) -> None:
        for begin in begins:
            self._descend(begin)
        known = bool(begins) and self._samples.n == 1  # the tracked optima without limits are among them
        if self.search.problem.limits and self._samples.seen and not known:
            # Limits that do not bind must not make a search worse: begin from what is best without them.
            least = min(self._samples.seen, key=lambda e: e.objective)
            for begin in self._samples.exact([least]):
                self._descend(self._local(begin, lambda e: without_limits(self.search.model(e))).evaluation)

    def _everywhere(self) -> None:
        """Look wherever the limits may be kept before it is said that no design keeps them."""
        self._samples.where_kept()
        self._from_least()
        if self._feasible():
            self._rounds()
            self._last()

    def _from_least(self) -> None:
        """Search for a design that keeps all limits from those of the look that exceed them least."""
        left = BEGINS_EACH * self._samples.n
        for one in sorted(self._samples.seen, key=lambda e: self._samples.scout.model(e).violation):
            if left == 0 or self._feasible():
                return
            z = scaled(self.search.variables, one.values)
            if all(np.abs(z - other).max() >= 2.0 * self._samples.apart for other in self._starts):
                left -= 1
                for exact in self._samples.exact([one]):
                    self._descend(exact)

    def _rounds(self) -> None:
        """Alternate between local searches and further looks until these find nothing."""
        idle, most = 0, max(self.search.problem.basins, min(2 + self._samples.n, MOST_BEGINS))
        for turn in range(MOST_ROUNDS):
            before = self._best()
            for _ in range(most):
                # One at a time: the end of one may lie lower than another can lead.
                begin = self._begin()
                if begin is None:
                    break
                self._starts.append(scaled(self.search.variables, begin.values))
                for exact in self._samples.exact([begin]):
                    self._descend(exact)
            after = self._best()
            idle = 0 if turn == 0 or _beats(after, before) else idle + 1
            enough = IDLE if self._samples.n <= 2 else IDLE_MANY
            more = [] if idle >= enough else self._samples.further(turn)
            if not more:
                self.finished = True
                return
            self._samples.at(more)
            most = 2

    def _best(self) -> tuple[float, float]:
        return min((local.standing for local in self.found), default=(math.inf, math.inf))

    def _descend(self, begin: DesignEvaluation) -> None:
        """Search locally from a design, for the limits alone where it ends without keeping them."""
        self._starts.append(scaled(self.search.variables, begin.values))
        here, ends, watched, joined = begin, list[Local](), _Watched(self), False
        try:
            if self.search.model(begin).violation > KEPT and not self._feasible():
                # A design that keeps all limits, the first that does.
                here = self._thorough(
                    begin, watched, lambda e: of_limits(self.search.model(e)), enough=1.0 + KEPT
                ).evaluation  # fmt: skip
                ends.append(self._ended(here))
            if not ends or ends[0].feasible:
                end = self._local(here, self.search.model, watched)
                ends.append(replace(self._ended(end.evaluation), at_a_jump=end.at_a_jump))
        except JoinedError as left:
            joined = left.end is None
            ends += [] if left.end is None else [self._ended(left.end)]
        seen = min((begin, here, *watched.best), key=self._standing)
        known = min([self._best(), *(local.standing for local in ends if not joined)])
        if self._standing(seen)[0] == 0.0 and _beats(self._standing(seen), known):
            # What is minimised may lead out of the limits that a design keeps, to an end that breaks them.
            ends.append(self._thorough(seen, self.search, self.search.model, strict=True))
        elif joined:
            return
        best = min(ends, key=lambda local: local.standing)
        self.found.append(best)
        self._apart.clear()
        there = self._samples.ended(best)
        if there is not None:
            self._ends.append((best, there))

    def _feasible(self) -> bool:
        """Return whether an end keeps all limits."""
        return any(local.feasible for local in self.found)

    def _standing(self, there: DesignEvaluation) -> tuple[float, float]:
        return standing(self.search.model(there))

    def _thorough(self, begin: DesignEvaluation, evaluate: Evaluate, model_of: ModelOf, **more: Any) -> Local:
        from optim.methods.minimax import thorough_search

        return thorough_search(evaluate, self.search.variables, begin, model_of, **more)

    def _local(self, begin: DesignEvaluation, model_of: ModelOf, evaluate: Evaluate | None = None) -> Local:
        return self._local_search(evaluate or self.search, self.search.variables, begin, model_of)

    def joins(self, here: DesignEvaluation) -> bool:
        """Return whether what is minimised falls all the way from a design to an end that is known.

        Of a design that does not keep its limits it is the largest excess.

        On the straight way to the nearest end that is better, values and slopes fall at every design looked
        at: the design is in the basin of that end, as far as these tell (hill-valley test: Ursem, Proc. CEC
        1999, p. 1633, doi:10.1109/CEC.1999.785470).
        """
        mine = self._ended(here)
        better = [(local, there) for local, there in self._ends if _beats(local.standing, mine.standing)]
        if not better:
            return False
        broken = not mine.feasible
        z = scaled(self.search.variables, here.values)
        if any(np.abs(z - other).max() < self._samples.apart for other in self._apart):
            return False  # it was looked at from there
        self._apart.append(z)
        ways = [scaled(self.search.variables, local.evaluation.values) - z for local, _ in better]
        nearest = min(range(len(ways)), key=lambda i: float(np.abs(ways[i]).max()))
        way = ways[nearest]
        end = taylor_of(self._samples.scout.model(better[nearest][1]), feasibility=broken).value
        if not _falls(taylor_of(self.search.model(here), feasibility=broken), way):
            return False
        last = math.inf
        for share in ON_THE_WAY:
            there = self._samples.scout(unscaled(self.search.variables, z + share * way))
            if not there.good:
                return False
            self._samples.seen.append(there)
            one = taylor_of(self._samples.scout.model(there), feasibility=broken)
            if not end < one.value < last or not _falls(one, way):
                return False
            last = one.value
        return True

    def behind(self, best: tuple[float, float]) -> bool:
        """Return whether a standing breaks limits that an end keeps, or leads far above all basins wanted."""
        idle = self._distinct() >= self.search.problem.basins and self.far_behind(best)
        return self._best()[0] == 0.0 and (best[0] > FAR_OFF or idle)

    def far_behind(self, best: tuple[float, float]) -> bool:
        """Return whether a standing is far above the best end, which keeps all limits."""
        violation, objective = self._best()
        return violation == 0.0 and best[1] > WORTH * objective

    def _ended(self, there: DesignEvaluation) -> Local:
        return ended(there, self.search.model(there), self.search.variables)

    def _begin(self) -> DesignEvaluation | None:
        """Return the next design of the look to start from, if any.

        No neighbour beats it, and it may lead below the best.
        """
        if not self._samples.seen:
            return None
        ends = [local.evaluation for local in self.found]
        started = [*self._starts, *(scaled(self.search.variables, end.values) for end in ends)]
        wanted, enough = self._distinct() < self.search.problem.basins, WORTH * self._samples.least()
        for potential, one in self._samples.minima():
            z = scaled(self.search.variables, one.values)
            fresh = all(np.abs(z - other).max() >= self._samples.apart for other in started)
            if fresh and (wanted or potential <= enough):
                return one
        return None

    def _distinct(self) -> int:
        """Return how many ends differ."""
        places: list[Real] = []
        for local in self.found:
            z = scaled(self.search.variables, local.evaluation.values)
            if all(np.abs(z - other).max() > self._samples.apart for other in places):
                places.append(z)
        return len(places)

    def _last(self) -> None:
        """Go on from a design that beats every end; without slopes from an end that did not settle."""
        for _ in range(3):
            good = self.search.good()
            if not good:
                return
            best = min(good, key=lambda e: standing(self.search.model(e)))
            if not _beats(standing(self.search.model(best)), self._best()):
                break
            self._descend(best)
        end = min(self.found, key=lambda local: local.standing)
        if not (end.settled or end.at_a_jump):
            better = polished(self.search, end)
            self.found.append(better)
            if not better.settled:
                self._descend(better.evaluation)


class JoinedError(Exception):
    """A local search leads to an end that is known, or stays far behind it; `end`: its own, as good as."""

    def __init__(self, end: DesignEvaluation | None = None) -> None:
        self.end = end
        super().__init__()


class _Watched:
    """Evaluates for a local search, and ends it once it leads to an end that is known."""

    def __init__(self, whole: GlobalSearch) -> None:
        self._whole, self._best, self._better, self._count = whole, (math.inf, math.inf), 0, 0
        self._little = 0  # gains in a row that were
        self.best: list[DesignEvaluation] = []  # the best seen

    def __call__(self, values: Mapping[str, float]) -> DesignEvaluation:
        """Evaluate a design.

        Raises
        ------
        JoinedError
            It is on the way to an end that is known, or stays far behind it.
        """
        found = self._whole.search(values)
        self._count += 1
        if not found.good:
            return found
        here = standing(self._whole.search.model(found))
        if here < self._best:
            self._little = self._little + 1 if self._best[1] - here[1] <= LITTLE * here[1] else 0
            self._best, self._better, self.best = here, self._better + 1, [found]
            if self._little > 1 and here[0] == 0.0 and self._whole.far_behind(here):
                raise JoinedError(found)
            if self._better % LOOK_AHEAD == 0 and self._whole.joins(found):
                raise JoinedError
        if self._count >= PATIENCE and self._whole.behind(self._best):
            raise JoinedError
        return found


def _falls(model: Taylor, way: Real) -> bool:
    """Return whether what a model is of falls at its place along a way."""
    ahead = model.place + SMALL * way
    return bool(model.at(ahead[None, :])[0] < model.value)


def _beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether a standing is better than another, by more than rounding."""
    if one[0] != other[0]:
        return one[0] < other[0] - BETTER
    return one[1] < other[1] - BETTER * abs(other[1])


class Samples:
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
        self._of = True, 0.0, 0.0  # whether no design keeps all limits, slack and scale, of the models
        self._models: list[Taylor] = []  # of the designs seen, in their order
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
        if self.n == 1:  # from the middle outward: beyond it responses may be far higher than there
            begin.sort(key=lambda z: abs(float(z[0]) - 0.5))
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
        mean, spread = predicted(models, known, z[None, :])
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
        of = self.infeasible(), self._slack, self.scout.model(self.seen[0]).unit
        if of != self._of:
            self._of, self._models = of, []
        for one in self.seen[len(self._models) :]:
            model = self.scout.model(one)
            model = model if of[0] else replace(model, excess=model.excess - of[1])
            self._models.append(taylor_of(model, feasibility=of[0]))
        return self._models

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
            self.models(), quasi_random(self.n, MORE_EACH * self.n, SEED),
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


def polished(search: DesignSearch, local: Local) -> Local:
    """Return the end of a pattern search from where a local search was stuck."""
    n = len(search.variables)
    rng = np.random.default_rng(0)
    here, step, left = local.evaluation, FIRST_STEP, MOST * n
    best = local.standing
    lead: Real | None = None
    while step >= LAST_STEP and left > 0:
        z = scaled(search.variables, here.values)
        moved = False
        for direction in _directions(n, rng, lead):
            place = snapped(z + step * direction)
            if left <= 0 or np.array_equal(place, z):
                continue
            left -= 1
            trial = search(unscaled(search.variables, place))
            if trial.good and (there := standing(search.model(trial))) < best:
                here, best, lead, moved = trial, there, direction, True
                break
        step *= 1.0 / SMALLER if moved else SMALLER
        lead = lead if moved else None
    return ended(here, search.model(here), search.variables)


def _directions(n: int, rng: np.random.Generator, lead: Real | None) -> list[Real]:
    """Return the directions to try: the last that succeeded, both ways along an orthogonal basis."""
    basis = np.eye(n) if n == 1 or rng.random() < 0.5 else np.linalg.qr(rng.normal(size=(n, n)))[0]
    return ([] if lead is None else [lead]) + [sign * column for column in basis.T for sign in (1.0, -1.0)]
