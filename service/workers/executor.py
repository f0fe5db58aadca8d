"""The contract between the queue and what runs its attempts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

from service.db.repositories import Attempt
from service.jobs.outputs import JobFailure, JobOutput, Report, ResultPiece


@dataclass(frozen=True, slots=True)
class Finished:
    """The computation ended by itself."""

    output: JobOutput


@dataclass(frozen=True, slots=True)
class Failed:
    """An error that another attempt would meet again."""

    failure: JobFailure


@dataclass(frozen=True, slots=True)
class Stopped:
    """The computation ended because it was told to."""


@dataclass(frozen=True, slots=True)
class Lost:
    """What ran the attempt died; `reason` says how, `signal` which one ended it if one did."""

    reason: str
    signal: int | None = None


Outcome = Finished | Failed | Stopped | Lost


class Sink(Protocol):
    """What the queue wants to hear; called from the executor's threads."""

    def reported(self, attempt: Attempt, report: Report) -> None:
        """The attempt got this far."""

    def kept(self, attempt: Attempt, pieces: Sequence[ResultPiece], *, anew: bool) -> None:
        """The attempt keeps pieces of its work for a later one; `anew` if they replace all before them."""

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        """The attempt ended; called exactly once for each one submitted."""

    def room(self) -> None:
        """There may be room for another attempt."""


class Unwatched:
    """The part of a `Sink` whose attempts nobody watches, and which have no later attempt."""

    def _nobody(self, *_: object, **__: object) -> None:
        """Nobody watches."""

    reported = kept = _nobody


class Executor(Protocol):
    """Runs attempts; never touches the database."""

    def start(self, sink: Sink) -> None:
        """Get ready; returns at once, `Sink.room` is called when attempts can be taken."""

    def free(self) -> int:
        """How many attempts could start now."""

    def submit(self, attempt: Attempt) -> None:
        """Run an attempt; the caller has seen that there is room."""

    def stop_attempt(self, attempt: Attempt) -> None:
        """Ask an attempt to stop, and end it by force when its grace is over; nothing if it ended."""

    def close(self) -> None:
        """End everything; attempts still running end as `Stopped` or `Lost` before this returns."""

    def status(self) -> ExecutorStatus:
        """How it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutorStatus:
    """How an executor is."""

    workers: Annotated[int, "How many attempts it could run at a time when all is well."]
    ready: Annotated[int, "How many workers are up, busy ones too."]
    busy: Annotated[int, "How many run an attempt."]
    trouble: Annotated[str | None, "Why workers do not come up."] = None
