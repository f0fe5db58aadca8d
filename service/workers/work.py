"""An attempt while it is computed in several places."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from distributed import Future

from service.db.repositories import Attempt
from service.jobs.checkpoints import Checkpoints, KeptPieces, keep_part, known_parts
from service.jobs.outputs import JobOutput, OnProgress, Pace
from service.jobs.parts import Account, Division, JobPart, PartOutput, final_one
from service.workers.base import Finished, Outcome, Sink
from service.workers.worker import Report, Throttle, checked

_LOSSES = 1  # of a part, that cost no attempt


class Work:
    """An attempt: its parts, or itself as the only one (place None), and what is known of them."""

    def __init__(self, attempt: Attempt) -> None:
        self.attempt = attempt
        self.saved = attempt.saved
        self.told = 0  # points of its branch that the queue knows
        self.parts: list[JobPart] = []
        self.pending: deque[int | None] = deque()
        self.flying = 0
        self._divided: Division | None = None
        self._outputs: dict[int, PartOutput] = {}
        self._output: JobOutput | None = None
        self._losses: Counter[int] = Counter()
        self._lock = threading.Lock()
        self._tell: OnProgress
        self._account: Account
        self._checkpoints = Checkpoints.none()

    def divide(self, parts: Division | None, sink: Sink, pace: Pace) -> None:
        """Make the parts, and look which of them earlier attempts kept."""

        def send(report: Report) -> None:
            sink.progress(self.attempt, report.fraction, report.points)

        self._divided = parts
        if parts is None:
            self._tell = Throttle(send, 0.0)
            self.pending.append(None)
            return
        self.parts = list(parts.split(self.attempt.spec))

        def keep(kept: KeptPieces) -> None:
            sink.kept(self.attempt, kept.pieces, anew=kept.anew)

        self._checkpoints = Checkpoints(self.attempt.job_id, self.attempt.saved, keep, pace)
        self._outputs.update(known_parts(self._checkpoints))
        self._account = Account(self.parts, self._outputs, Throttle(send, pace.progress_seconds))
        self.pending.extend(index for index in range(len(self.parts)) if index not in self._outputs)

    def progress(self, index: int | None, share: float, points: int) -> None:
        """One of them got this far."""
        with self._lock:
            if index is None:
                self._tell(share, points)
            else:
                self._account.of(index)(share, points)

    def keep(self, index: int | None, output: JobOutput | PartOutput) -> None:
        """One of them is known.

        Raises
        ------
        TypeError
            If it is not what was ordered.
        """
        with self._lock:
            if index is None and isinstance(output, JobOutput):
                self._output = output
            elif index is not None and isinstance(output, PartOutput):
                self._outputs[index] = output
                self._account.done(index, output)
                keep_part(self._checkpoints, index, output)
            else:
                raise TypeError(f"a worker answered {type(output).__name__}")

    def go_on(self, index: int | None, kept: Sequence[KeptPieces]) -> None:
        """Order again what stopped on its way, behind what it kept."""
        for one in kept:
            before = () if one.anew else self.saved
            known = {piece.part: piece for piece in (*before, *one.pieces)}
            self.saved = tuple(known[part] for part in sorted(known))
        self.pending.appendleft(index)

    def flush(self) -> None:
        """Store the parts that wait to be kept, for an attempt that may come after."""
        with self._lock:
            self._checkpoints.flush()

    def may_lose(self, index: int | None) -> bool:
        """Count a loss; whether the attempt can bear it."""
        if index is None:
            return False
        self._losses[index] += 1
        return self._losses[index] <= _LOSSES

    def outcome(self) -> Outcome | None:
        """The output of the job, once everything it needs is known."""
        with self._lock:
            if self._divided is None:
                return None if self._output is None else Finished(self._output)
            if len(self._outputs) < len(self.parts) and not final_one(self._outputs):
                return None
            outputs = dict(self._outputs)
        return Finished(checked(self._divided.joined(self.attempt.spec, outputs)))


@dataclass(slots=True, kw_only=True)
class Flight:
    """An order on its way."""

    work: Work
    index: int | None
    future: Future
    begun: Annotated[int, "What its worker said when it began; 0 before."] = 0
    worker: Annotated[str, "The address of that."] = ""
    threads: Annotated[int, "How many orders that computes at a time."] = 0
    deadline: Annotated[float, "When it is to have ended, once it was let go (monotonic) [s]."] = 0.0

    def leaving(self, deadline: float) -> Flight:
        """This one, let go."""
        self.deadline = deadline
        return self
