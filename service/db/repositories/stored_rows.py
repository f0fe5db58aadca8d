"""What the repository takes and gives: frozen rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from service.db.models import NOBODY, JobState
from service.jobs.outputs import ResultPiece
from service.jobs.strict_json import JsonText


@dataclass(frozen=True, slots=True, kw_only=True)
class JobRow:
    """A job without its spec and its result; `request` is None in lists, it may hold a whole scene."""

    id: str
    kind: str
    state: JobState
    priority: int
    scene_name: str | None
    scene_hash: str | None
    spec_hash: str
    request_hash: str
    owner: str
    idempotency_key: str | None
    seconds_limit: float | None
    attempt: int
    max_attempts: int
    cancel_requested: bool
    progress: float
    points: int
    best: dict[str, Any] | None
    created: datetime
    started: datetime | None
    finished: datetime | None
    result_of: str | None
    error: dict[str, Any] | None
    request: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunWords:
    """What is said of a run: the id of its project, its name, its notes, the words it is marked with."""

    project: str | None = None
    name: str = ""
    notes: str = ""
    tags: tuple[str, ...] = ()


NO_WORDS = RunWords()


@dataclass(frozen=True, slots=True, kw_only=True)
class NewJob:
    """A job to be inserted."""

    kind: str
    request: dict[str, Any]
    spec: dict[str, Any] | JsonText
    spec_hash: str
    request_hash: str
    max_attempts: int
    scene_name: str | None = None
    scene_hash: str | None = None
    priority: int = 0
    fresh: bool = False
    idempotency_key: str | None = None
    owner: str = NOBODY
    seconds_limit: float | None = None
    words: RunWords = NO_WORDS
    trace: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """One attempt at a job: what a worker needs, and what guards the write of its outcome.

    Attributes
    ----------
    created : datetime
        When its job was handed in.
    spec_hash : str
        Digest of what is computed, to which its checkpoints belong.
    seconds_limit : float or None
        Longest time it may take [s], if the job has a limit of its own.
    trace : str or None
        The `traceparent` it is part of, if there are traces.
    progress, points : float, int
        How far earlier attempts got, as far as `saved` goes; 0 without it.
    saved : tuple of Piece
        What they kept.
    """

    job_id: str
    kind: str
    spec: dict[str, Any]
    attempt: int
    max_attempts: int
    lease_owner: str
    created: datetime
    spec_hash: str = ""
    owner: str = NOBODY
    seconds_limit: float | None = None
    trace: str | None = None
    progress: float = 0.0
    points: int = 0
    saved: tuple[ResultPiece, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveredJobs:
    """What became of running jobs whose owner is gone."""

    accepted: int = 0
    failed: int = 0
    dismissed: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        return self.accepted + self.failed + self.dismissed
