"""What the repositories of the workbench take and give: frozen rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from service.db.models import NOBODY, JobState
from service.db.repositories.rows import JobRow, RunWords


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """A run: a job with what is said of it.

    Attributes
    ----------
    revision : int
        Counts the changes of its words; 0 if there was none.
    changed, deleted : datetime or None
        When its words were changed last, when it was put in the bin.
    sweeps : int
        How many sweeps are stored with it.
    """

    job: JobRow
    words: RunWords
    revision: int = 0
    changed: datetime | None = None
    deleted: datetime | None = None
    sweeps: int = 0

    @property
    def owner(self) -> str:
        """Whom it belongs to."""
        return self.job.owner


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFilter:
    """Which runs to list; every condition must hold.

    Attributes
    ----------
    owner : str or None
        Whose; None for everybody's.
    states : sequence of JobState
        In one of them; any if empty.
    tags : sequence of str
        Marked with all of them.
    text : str or None
        In the name or the notes, whatever its case.
    after, before : datetime or None
        Handed in at the earliest, and earlier than.
    deleted : bool
        Those in the bin in place of those outside.
    """

    owner: str | None = NOBODY
    of_owner: str | None = None
    states: Sequence[JobState] = ()
    kind: str | None = None
    scene: str | None = None
    project: str | None = None
    tags: Sequence[str] = ()
    text: str | None = None
    after: datetime | None = None
    before: datetime | None = None
    deleted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectRow:
    """A project; `runs` are those outside of the bin."""

    id: str
    owner: str
    name: str
    notes: str
    created: datetime
    changed: datetime
    revision: int
    deleted: datetime | None = None
    runs: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ShareRow:
    """A link to a run; `digest` is all there is of its token."""

    id: str
    job_id: str
    digest: str
    created: datetime
    expires: datetime | None = None
