"""The progress of a design: that of its search, then that of the look at what it found."""

from __future__ import annotations

from collections.abc import Callable

from solver.results.watch import OnProgress

SEARCHED = 0.75  # share of the progress that the search has
USUAL = 12.0  # evaluations of a usual search; how many are left is not known beforehand


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

    def searching(self, share: float, count: int) -> None:
        """Hear of the search: the `on_progress` to give to it."""
        self._count = count
        self._searched = max(self._searched, SEARCHED * share)
        self.tell(self._searched)

    def again(self, before: int) -> Callable[[float, int], None]:
        """Return the `on_progress` of a search that follows after so many evaluations."""
        return lambda share, count: self.searching(share, before + count)

    def further(self) -> None:
        """Hear of another evaluation after the search."""
        self._afterwards += 1
        self.tell(SEARCHED + (1.0 - SEARCHED) * share_of(self._afterwards))

    def tell(self, share: float) -> None:
        """Report."""
        if self._on_progress is not None:
            self._on_progress(share, self._count + self._afterwards)
