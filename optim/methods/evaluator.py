"""Evaluating designs one after the other: all are kept, progress is reported, the caller may stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.methods.linearised import KEPT, Model, model_of
from optim.problem.design_problem import Problem
from optim.problem.variables import BoundedVariable
from optim.results.design_result import FEWER_HARMONICS, PEAKS_OPEN, VERIFIED, BestSoFar, DesignStatus, OnBest
from optim.results.doubts import open_peaks
from solver.results.spread import Ahead
from solver.results.watch import OnProgress, ShouldStop

MOST_EVALUATIONS = 800
SEARCHED = 0.75  # share of the progress that the search has
FAR_ABOVE = 20.0  # times the best, from where on no model leads below it: see `linearised.MOST_GROWTH`
USUAL = 12.0  # evaluations of a usual search; how many are left is not known beforehand


class SearchStoppedError(Exception):
    """The caller asked to stop, or the evaluations are used up."""

    def __init__(self, status: DesignStatus) -> None:
        self.status = status
        super().__init__(status.value)


def stop_if_asked(should_stop: ShouldStop) -> None:
    """Raise SearchStoppedError if the caller asks to stop."""
    if should_stop is not None and should_stop():
        raise SearchStoppedError(DesignStatus.STOPPED)


class DesignSearch:
    """Evaluates designs, keeps all of them, reports progress and looks whether to stop."""

    def __init__(
        self, problem: Problem, on_progress: OnProgress = None, should_stop: ShouldStop = None,
        most: int = MOST_EVALUATIONS, *, on_best: OnBest = None, above: DesignSearch | None = None,
        before: Iterable[DesignEvaluation] = (),
    ) -> None:  # fmt: skip
        self.problem = problem
        self.history: list[DesignEvaluation] = []
        self.scales = problem.scales
        self.should_stop = should_stop
        self.on_progress, self.on_best = on_progress, on_best
        self.scouted = 0  # responses of a coarse stage with fewer harmonics
        self._before = 0
        self._most = most
        self._scale = 0.0  # the first objective that is not 0
        self._above = above  # the search with all harmonics, for which this one only ranks designs
        self._scout: DesignSearch | None = None
        self._least = (math.inf, math.inf)
        self._best = self._enough = math.inf  # least objective that keeps all limits; the highest followed
        self._known: dict[tuple[float, ...], DesignEvaluation] = {}
        # By identity, with the evaluation itself, which so keeps its place in memory.
        self._models: dict[int, tuple[DesignEvaluation, Model]] = {}
        self._ahead: Ahead[tuple[float, ...], DesignEvaluation] = Ahead(should_stop)
        # Of another search: by another measure, or with other harmonics.
        self._earlier = {self._place(one.values): one for one in before}

    def __call__(self, values: Mapping[str, float]) -> DesignEvaluation:
        """Evaluate one design with gradients, each once.

        Raises
        ------
        StoppedError
            The caller asked to stop, or the evaluations are used up.
        """
        stop_if_asked(self.should_stop)
        place = self._place(values)
        if place in self._known:
            return self._known[place]
        if len(self.history) >= self._most:
            raise SearchStoppedError(DesignStatus.TOO_MANY)
        evaluation = self._ahead.take(place) or evaluate(
            self.problem, values, errors=False, should_stop=self.should_stop, before=self._earlier.get(place),
            most=self._enough,
        )  # fmt: skip
        self._known[place] = evaluation
        self.keep(evaluation)
        return evaluation

    def ahead(self, several: Iterable[Mapping[str, float]]) -> None:
        """Compute designs that will be asked for, where there are others to do so."""
        calls = {self._place(values): (values,) for values in several}
        self._enough = FAR_ABOVE * self._best
        known = self._known.keys() | self._earlier.keys()
        unknown = {place: call for place, call in calls.items() if place not in known}
        judged = partial(evaluate, self.problem, errors=False, most=self._enough)
        self._ahead.compute(judged, unknown)

    def _place(self, values: Mapping[str, float]) -> tuple[float, ...]:
        return tuple(values[variable.name] for variable in self.variables)

    @property
    def count(self) -> int:
        """Designs looked at so far."""
        scout = 0 if self._scout is None else len(self._scout.history)
        return self._before + len(self.history) + scout

    def scout(self, harmonics: int) -> DesignSearch:
        """Return a search of the same problem with fewer harmonics, to be handed to `scouting_done`."""
        fewer = replace(self.problem, harmonics=harmonics)
        self._scout = DesignSearch(
            fewer, self.on_progress, self.should_stop, on_best=self.on_best, above=self,
            before=self._earlier.values(),
        )  # fmt: skip
        return self._scout

    def scouting_done(self, scout: DesignSearch) -> None:
        """Count what a scout looked at; its numbers are not exact enough to be kept."""
        self._before, self._scout = self._before + len(scout.history), None
        self.scouted += sum(evaluation.computed for evaluation in scout.history)

    def tracking(self, _share: float, sweeps: int) -> None:
        """Hear of responses to a problem without its limits."""
        if self.on_progress is not None:
            self.on_progress(share_of(self.count + sweeps), self.count + sweeps)

    def tracked(self, sweeps: int) -> None:
        """Count those responses."""
        self._before += sweeps
        self.scouted += sweeps

    def keep(self, evaluation: DesignEvaluation) -> None:
        """Add an evaluation to the history and report it."""
        self.history.append(evaluation)
        if not self._scale and evaluation.good:
            self._scale = evaluation.objective
        if evaluation.good and evaluation.violation(self.scales) <= KEPT:
            self._best = min(self._best, evaluation.objective)
        if self.on_best is not None and evaluation.good:
            self._compare(evaluation, self.on_best)
        if self.on_progress is not None:
            count = (self._above or self).count
            self.on_progress(share_of(count), count)

    def _compare(self, evaluation: DesignEvaluation, on_best: Callable[[BestSoFar], None]) -> None:
        """Tell of a design that is better than all before."""
        violation = max(evaluation.violation(self.scales), 0.0)
        standing = (0.0 if violation <= KEPT else violation, evaluation.objective)
        ranked = self._above is not None
        # Once a design was computed with all harmonics, those that are only ranked are not told any more.
        if standing >= self._least or (self._above is not None and self._above.history):
            return
        self._least = standing
        known = VERIFIED if not open_peaks(evaluation) else PEAKS_OPEN
        on_best(
            BestSoFar(
                values=dict(evaluation.values),
                peak=evaluation.peaks[0].value if evaluation.peaks else math.nan,
                objective=evaluation.objective_told, feasible=violation <= KEPT,
                verified=known is VERIFIED and not ranked, words=FEWER_HARMONICS if ranked else known,
                evaluations=(self._above or self).count,
            )
        )  # fmt: skip

    @property
    def variables(self) -> tuple[BoundedVariable, ...]:
        """What may be chosen."""
        return self.problem.variables

    def good(self) -> list[DesignEvaluation]:
        """Return every design whose numbers are known."""
        return [evaluation for evaluation in self.history if evaluation.good]

    def model(self, evaluation: DesignEvaluation) -> Model:
        """Return the model of a good evaluation, relative to the first objective that is not 0."""
        scale = self._scale or 1.0
        known = self._models.get(id(evaluation))
        if known is None or known[1].unit != scale:
            known = evaluation, model_of(evaluation, self.variables, scale, self.scales)
            self._models[id(evaluation)] = known
        return known[1]

    def merit(self, evaluation: DesignEvaluation) -> float:
        """Return what the search decreases."""
        return self.model(evaluation).merit


def share_of(done: int) -> float:
    """Return a share that approaches 1 from below."""
    return done / (done + USUAL)


class Tally:
    """Counts what both look at; the count never falls back.

    Parameters
    ----------
    on_progress : told of the share of the whole and of the count.
    """

    def __init__(self, on_progress: OnProgress) -> None:
        self._on_progress = on_progress
        self._count = self._afterwards = 0
        self._searched = 0.0

    def after(self, before: int) -> Callable[[float, int], None]:
        """Return the `on_progress` of a search that follows after so many evaluations."""

        def hear(share: float, count: int) -> None:
            self._count = before + count
            self._searched = max(self._searched, SEARCHED * share)
            self.tell(self._searched)

        return hear

    def further(self) -> None:
        """Hear of another evaluation after the search."""
        self._afterwards += 1
        self.tell(SEARCHED + (1.0 - SEARCHED) * share_of(self._afterwards))

    def tell(self, share: float) -> None:
        """Report."""
        if self._on_progress is not None:
            self._on_progress(share, self._count + self._afterwards)
