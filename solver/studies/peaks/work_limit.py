"""How long peaks are followed: until the caller says stop, or the work allowed is used up.

The work allowed is counted in Newton iterations, in units of a frequency response, so that the same question
always ends at the same place, however fast the machine is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from solver.jit.timer import clock
from solver.studies.peaks.track_results import TrackStatus

RESPONSES = 100.0  # frequency responses whose work may be spent
LEAST_UNIT = 200.0  # Newton iterations: a response that is nearly linear takes fewer
LONGEST = 30.0  # times a response that one may take
AFTERWARDS = 0.25  # s that may be spent on what was found once the end has come
_EVERY = 0.1  # s between two questions to the caller


class HaltedError(Exception):
    """Nothing more is to be followed; the status says why."""

    def __init__(self, status: TrackStatus) -> None:
        self.status = status
        super().__init__(status.value)


class Allowance:
    """Asks the caller, and counts the work.

    Parameters
    ----------
    should_stop : the caller's; None: never.
    responses : whose work is allowed.
    """

    def __init__(self, should_stop: Callable[[], bool] | None, responses: float = RESPONSES) -> None:
        self._should_stop, self._responses = should_stop, responses
        self._asked = clock()
        self._ended = math.inf
        self._status: TrackStatus | None = None
        self._unit = math.inf

    @property
    def most(self) -> float:
        """Newton iterations allowed in all; infinity before the first response."""
        return self._responses * self._unit

    @property
    def longest(self) -> float:
        """Newton iterations after which a response is given up; infinity before the first."""
        return LONGEST * self._unit

    def measure(self, iterations: Sequence[int]) -> None:
        """Take the median of the Newton iterations of responses as the unit of work."""
        if iterations:
            self._unit = max(float(sorted(iterations)[len(iterations) // 2]), LEAST_UNIT)

    def ask(self) -> bool:
        """Return whether the caller wants it to end."""
        self._asked = clock()
        return self._should_stop is not None and self._should_stop()

    def due(self) -> bool:
        """Return whether the caller wants it to end, asking now and then only."""
        return clock() - self._asked >= _EVERY and self.ask()

    def check(self, spent: float) -> None:
        """Raise HaltedError if the end has come; `spent`: Newton iterations so far."""
        if self._status is not None:
            raise HaltedError(self._status)
        if self.due():
            raise HaltedError(TrackStatus.STOPPED)
        if spent > self.most:
            raise HaltedError(TrackStatus.WORK_USED_UP)

    def end(self, status: TrackStatus) -> None:
        """Say that the end has come: what was found may still be read, for a moment."""
        if self._status is None:
            self._status, self._ended = status, clock()

    @property
    def ended(self) -> bool:
        """Whether the end has come."""
        return self._status is not None

    @property
    def over(self) -> bool:
        """Whether what was found may not even be read any more, as far as that takes solving."""
        return clock() - self._ended > AFTERWARDS
