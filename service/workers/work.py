"""An attempt on a cluster, and the order on its way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from distributed import Future

from service.db.repositories import Attempt
from service.jobs.checkpoints import KeptPieces


class Work:
    """An attempt, and what is known of it.

    Parameters
    ----------
    attempt : Attempt
        What is computed.
    losses : int
        How often its worker may die without that it costs the attempt.
    """

    def __init__(self, attempt: Attempt, losses: int) -> None:
        self.attempt = attempt
        self.saved = attempt.saved
        self.told = 0  # points of its branch that the queue knows
        self.pending = True
        self._losses = losses

    def go_on(self, kept: Sequence[KeptPieces]) -> None:
        """Order again what stopped on its way, behind what it kept."""
        for one in kept:
            before = () if one.anew else self.saved
            known = {piece.part: piece for piece in (*before, *one.pieces)}
            self.saved = tuple(known[part] for part in sorted(known))
        self.pending = True

    def may_lose(self) -> bool:
        """Count a loss; whether the attempt can bear it."""
        self._losses -= 1
        return self._losses >= 0


@dataclass(slots=True, kw_only=True)
class Flight:
    """An order on its way."""

    work: Work
    future: Future
    begun: Annotated[int, "What its worker said when it began; 0 before."] = 0
    worker: Annotated[str, "The address of that."] = ""
    threads: Annotated[int, "How many orders that computes at a time."] = 0
    deadline: Annotated[float, "When it is to have ended, once it was let go (monotonic) [s]."] = 0.0

    def leaving(self, deadline: float) -> Flight:
        """This one, let go."""
        self.deadline = deadline
        return self
