"""The search of the whole range: a look that fills the space, local searches from it, and a second look.

The look takes corners, middles and a Sobol sequence of designs; local searches begin from those that no
neighbour beats; then designs are added wherever the slopes of what was seen say that something better than
the best end may lie (`optim.methods.surrogate`), until nothing does, or a few rounds have found nothing. What
the local searches found is compared with every design looked at (`optim.methods.look`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.methods.evaluator import DesignSearch
from optim.methods.kkt import (
    KEPT,
    Evaluate,
    Local,
    LocalSearch,
    ModelOf,
    ended,
    of_limits,
    standing,
    without_limits,
)
from optim.methods.look import BETTER, WORTH, Look
from optim.methods.pattern_search import polished
from optim.methods.surrogate import Taylor, taylor_of
from optim.problem.variables import Real, scaled, unscaled

PATIENCE = 20  # designs of a local search, after which it ends if it is far behind the best end
FAR_OFF = 0.01  # relative excess over a limit that is
IDLE = 3  # rounds in a row that find nothing, after which a look is finished
IDLE_MANY = 2  # the same with more than two variables
MOST_ROUNDS = 16
ON_THE_WAY = (1.0 / 3.0, 2.0 / 3.0)  # to a known end, where it is looked at whether a search leads there
LOOK_AHEAD = 2  # better designs of a local search from one such look to the next
SMALL = 1e-6  # share of the way along which a slope is taken
MOST_BEGINS = 4  # designs that the first local searches begin from
BEGINS_EACH = 4  # and for each variable before it is said that no design keeps the limits


class WholeRange:
    """A search of the whole range of a problem; `seen`: designs of an earlier look with fewer harmonics."""

    def __init__(
        self,
        search: DesignSearch,
        local_search: LocalSearch,
        found: list[Local],
        seen: Sequence[DesignEvaluation] = (),
    ) -> None:
        self.search, self.found = search, found
        self.finished = False
        self._local_search = local_search
        self._look = Look(search, found, seen)
        self._starts: list[Real] = []
        self._ends: list[tuple[Local, DesignEvaluation]] = []  # with the numbers of the look

    @property
    def looked_at(self) -> tuple[DesignEvaluation, ...]:
        """Every design of the look, in order."""
        return tuple(self._look.seen)

    def run(self, given: Iterable[Mapping[str, float]]) -> bool | None:
        """Search; `given`: designs to begin from besides those of the look.

        Returns
        -------
        True if nothing depends on the variables, None if no response could be computed.
        """
        try:
            self._look.first()
            begins = [e for values in given if (e := self.search(values)).good]
            if not self._look.seen and not begins:
                return None
            if self._look.flat():
                return True
            self._starts_given(begins)
            self._rounds()
            self._last()
            if not self._feasible() and self.search.problem.limits.any:
                self._everywhere()
        finally:
            if not self._look.whole:
                self.search.scouting_done(self._look.scout)
        return False

    def _starts_given(self, begins: list[DesignEvaluation]) -> None:
        for begin in begins:
            self._descend(begin)
        known = bool(begins) and self._look.n == 1  # the tracked optima without limits are among them
        if self.search.problem.limits.any and self._look.seen and not known:
            # Limits that do not bind must not make a search worse: begin from what is best without them.
            least = min(self._look.seen, key=lambda e: e.objective)
            for begin in self._look.exact([least]):
                free = self._local(begin, lambda e: without_limits(self.search.model(e)))
                self._descend(free)

    def _everywhere(self) -> None:
        """Look wherever the limits may be kept before it is said that no design keeps them."""
        self._look.where_kept()
        self._from_least()
        if self._feasible():
            self._rounds()
            self._last()

    def _from_least(self) -> None:
        """Search for a design that keeps all limits from those of the look that exceed them least."""
        left = BEGINS_EACH * self._look.n
        for one in sorted(self._look.seen, key=lambda e: self._look.scout.model(e).violation):
            if left == 0 or self._feasible():
                return
            z = scaled(self.search.variables, one.values)
            if all(np.abs(z - other).max() >= 2.0 * self._look.apart for other in self._starts):
                left -= 1
                for exact in self._look.exact([one]):
                    self._descend(exact)

    def _rounds(self) -> None:
        """Alternate between local searches and further looks until these find nothing."""
        idle, most = 0, max(self.search.problem.basins, min(2 + self._look.n, MOST_BEGINS))
        for turn in range(MOST_ROUNDS):
            before = self._best()
            for _ in range(most):
                # One at a time: the end of one may lie lower than another can lead.
                begins = self._begins()
                for begin in begins:
                    self._starts.append(scaled(self.search.variables, begin.values))
                for exact in self._look.exact(begins):
                    self._descend(exact)
                if not begins:
                    break
            after = self._best()
            idle = 0 if turn == 0 or _beats(after, before) else idle + 1
            enough = IDLE if self._look.n <= 2 else IDLE_MANY
            more = [] if idle >= enough else self._look.further(turn)
            if not more:
                self.finished = True
                return
            self._look.at(more)
            most = 2

    def _best(self) -> tuple[float, float]:
        return min((local.standing for local in self.found), default=(math.inf, math.inf))

    def _descend(self, begin: DesignEvaluation) -> None:
        """Search locally from a design, for the limits alone where it ends without keeping them."""
        self._starts.append(scaled(self.search.variables, begin.values))
        here, ends, watched, joined = begin, list[Local](), _Watched(self), False
        try:
            if self.search.model(begin).violation > KEPT and not self._feasible():
                here = self._eased(begin, watched)
                ends.append(self._ended(here))
            if not ends or ends[0].feasible:
                ends.append(self._ended(self._local(here, self.search.model, watched)))
        except JoinedError:
            joined = True
        seen = min((begin, here, *watched.best), key=self._standing)
        known = min([self._best(), *(local.standing for local in ends if not joined)])
        if self._standing(seen)[0] == 0.0 and _beats(self._standing(seen), known):
            # What is minimised may lead out of the limits that a design keeps, to an end that breaks them.
            ends.append(self._strict(seen))
        elif joined:
            return
        best = min(ends, key=lambda local: local.standing)
        self.found.append(best)
        there = self._look.ended(best)
        if there is not None:
            self._ends.append((best, there))

    def _feasible(self) -> bool:
        """Return whether an end keeps all limits."""
        return any(local.feasible for local in self.found)

    def _standing(self, there: DesignEvaluation) -> tuple[float, float]:
        return standing(self.search.model(there))

    def _strict(self, begin: DesignEvaluation) -> Local:
        """Return the end of a search that keeps the limits all the way."""
        from optim.methods.minimax import thorough_search

        return thorough_search(self.search, self.search.variables, begin, self.search.model, strict=True)

    def _eased(self, begin: DesignEvaluation, evaluate: Evaluate) -> DesignEvaluation:
        """Return the end of a search for a design that keeps all limits: the first that does."""
        from optim.methods.minimax import thorough_search

        return thorough_search(
            evaluate, self.search.variables, begin, lambda e: of_limits(self.search.model(e)),
            enough=1.0 + KEPT,
        ).evaluation  # fmt: skip

    def _local(
        self, begin: DesignEvaluation, model_of: ModelOf, evaluate: Evaluate | None = None
    ) -> DesignEvaluation:
        return self._local_search(
            evaluate or self.search, self.search.variables, begin, model_of
        ).evaluation  # fmt: skip

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
        ways = [scaled(self.search.variables, local.evaluation.values) - z for local, _ in better]
        nearest = min(range(len(ways)), key=lambda i: float(np.abs(ways[i]).max()))
        way = ways[nearest]
        end = taylor_of(self._look.scout.model(better[nearest][1]), feasibility=broken).value
        if not _falls(taylor_of(self.search.model(here), feasibility=broken), way):
            return False
        last = math.inf
        for share in ON_THE_WAY:
            there = self._look.scout(unscaled(self.search.variables, z + share * way))
            if not there.good:
                return False
            self._look.seen.append(there)
            one = taylor_of(self._look.scout.model(there), feasibility=broken)
            if not end < one.value < last or not _falls(one, way):
                return False
            last = one.value
        return True

    def behind(self, best: tuple[float, float]) -> bool:
        """Return whether a standing breaks limits that an end keeps, or leads far above all basins wanted."""
        violation, objective = self._best()
        idle = self._distinct() >= self.search.problem.basins and best[1] > WORTH * objective
        return violation == 0.0 and (best[0] > FAR_OFF or idle)

    def _ended(self, there: DesignEvaluation) -> Local:
        return ended(there, self.search.model(there), self.search.variables)

    def _begins(self) -> list[DesignEvaluation]:
        """Return the next design of the look to start from, if any.

        No neighbour beats it, and it may lead below the best.
        """
        if not self._look.seen:
            return []
        ends = [local.evaluation for local in self.found]
        started = [*self._starts, *(scaled(self.search.variables, end.values) for end in ends)]
        wanted, enough = self._distinct() < self.search.problem.basins, WORTH * self._look.least()
        for potential, one in self._look.minima():
            z = scaled(self.search.variables, one.values)
            fresh = all(np.abs(z - other).max() >= self._look.apart for other in started)
            if fresh and (wanted or potential <= enough):
                return [one]
        return []

    def _distinct(self) -> int:
        """Return how many ends differ."""
        places: list[Real] = []
        for local in self.found:
            z = scaled(self.search.variables, local.evaluation.values)
            if all(np.abs(z - other).max() > self._look.apart for other in places):
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
        if not end.settled:
            better = polished(self.search, end)
            self.found.append(better)
            if not better.settled:
                self._descend(better.evaluation)


class JoinedError(Exception):
    """A local search leads to an end that is known, or stays far behind it."""


class _Watched:
    """Evaluates for a local search, and ends it once it leads to an end that is known."""

    def __init__(self, whole: WholeRange) -> None:
        self._whole, self._best, self._better, self._count = whole, (math.inf, math.inf), 0, 0
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
            self._best, self._better, self.best = here, self._better + 1, [found]
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
