"""Evaluating designs one after the other: all are kept, progress is reported, the caller may stop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from optim.criteria.evaluation import evaluate, natural_scales
from optim.criteria.linearised import Model, model_of
from optim.criteria.rows import Evaluation
from optim.problem.problem import Problem
from optim.problem.variables import Variable
from optim.results.design import DesignStatus
from solver.results.watch import OnProgress, ShouldStop

MOST_EVALUATIONS = 800


class StoppedError(Exception):
    """The caller asked to stop, or the evaluations are used up."""

    def __init__(self, status: DesignStatus) -> None:
        self.status = status
        super().__init__(status.value)


class Search:
    """Evaluates designs, keeps all of them, reports progress and looks whether to stop."""

    def __init__(
        self, problem: Problem, on_progress: OnProgress = None, should_stop: ShouldStop = None,
        most: int = MOST_EVALUATIONS,
    ) -> None:  # fmt: skip
        self.problem = problem
        self.history: list[Evaluation] = []
        self.scales = natural_scales(problem)
        self.should_stop = should_stop
        self.on_progress = on_progress
        self.scouted = 0  # responses of a coarse stage with fewer harmonics
        self._before = 0
        self._most = most
        self._scale: float | None = None

    def __call__(self, values: Mapping[str, float]) -> Evaluation:
        """Evaluate one design with gradients.

        Raises
        ------
        StoppedError
            The caller asked to stop, or the evaluations are used up.
        """
        self.check()
        if len(self.history) >= self._most:
            raise StoppedError(DesignStatus.TOO_MANY)
        evaluation = evaluate(self.problem, values, should_stop=self.should_stop)
        self.keep(evaluation)
        return evaluation

    @property
    def count(self) -> int:
        """Designs looked at so far."""
        return self._before + len(self.history)

    def scout(self, harmonics: int) -> Search:
        """Return a search of the same problem with fewer harmonics, to be handed to `scouting_done`."""
        return Search(replace(self.problem, harmonics=harmonics), self.on_progress, self.should_stop)

    def scouting_done(self, scout: Search) -> None:
        """Count what a scout looked at; its numbers are not exact enough to be kept."""
        self._before += len(scout.history)
        self.scouted += sum(len(evaluation.responses) for evaluation in scout.history)

    def check(self) -> None:
        """Raise StoppedError if the caller asked to stop."""
        if self.should_stop is not None and self.should_stop():
            raise StoppedError(DesignStatus.STOPPED)

    def keep(self, evaluation: Evaluation) -> None:
        """Add an evaluation to the history and report it."""
        self.history.append(evaluation)
        if self._scale is None and evaluation.good:
            self._scale = evaluation.objective or 1.0
        if self.on_progress is not None:
            # The number of evaluations is not known beforehand: the share approaches 1 from below.
            done = self.count
            self.on_progress(done / (done + 12.0), done)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What may be chosen."""
        return self.problem.variables

    def good(self) -> list[Evaluation]:
        """Return every design whose numbers are known."""
        return [evaluation for evaluation in self.history if evaluation.good]

    def model(self, evaluation: Evaluation) -> Model:
        """Return the model of a good evaluation, relative to the first one."""
        return model_of(evaluation, self.variables, self._scale or 1.0, self.scales)

    def merit(self, evaluation: Evaluation) -> float:
        """Return what the search decreases."""
        return self.model(evaluation).merit
