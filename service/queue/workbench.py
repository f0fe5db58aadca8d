"""Projects, runs and links to them, as one caller sees them: found, changed, put in the bin and taken out."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from service.auth.callers import KEYLESS, Caller, Scope, visible
from service.db.clock import Clock
from service.db.engine import Database
from service.db.repositories.workbench.projects import ProjectRepository
from service.db.repositories.workbench.rows import ProjectRow, RunRow, ShareRow
from service.db.repositories.workbench.runs import RunRepository
from service.db.repositories.workbench.shares import ShareRepository
from service.errors import ConflictError, NotFoundError
from service.settings.settings import Settings

MOST_PROJECTS = 1000
MOST_SHARES = 20
_TOKEN = re.compile(r"share_([0-9a-f]{16})_([0-9a-f]{64})")
_NO_DIGEST = hashlib.sha256(secrets.token_bytes(32)).hexdigest()


@dataclass(frozen=True, slots=True)
class NewShare:
    """A link that was just made; `token` is nowhere else."""

    row: ShareRow
    token: str

    def __repr__(self) -> str:
        """Without the token, which must not get into a log."""
        return f"NewShare(row.id={self.row.id!r})"


class Projects:
    """Projects of a service."""

    def __init__(self, database: Database, settings: Settings, now: Clock) -> None:
        self.repository = ProjectRepository(database, now)
        self._settings, self._now = settings, now

    def add(self, name: str, notes: str, caller: Caller = KEYLESS) -> ProjectRow:
        """Make a project (StorageFullError if there are too many)."""
        return self.repository.add(caller.owner, name, notes, MOST_PROJECTS)

    def get(self, project_id: str, caller: Caller = KEYLESS) -> ProjectRow:
        """A project, in the bin or not (NotFoundError if the caller sees none of this id)."""
        return visible(self.repository.get(project_id), caller, f"there is no project {project_id!r}")

    def change(
        self,
        project_id: str,
        changes: Mapping[str, Any],
        expected: Collection[int] | None = None,
        caller: Caller = KEYLESS,
    ) -> ProjectRow:
        """Change name or notes of a project; `ProjectRepository.change` lists the errors."""
        row = self.get(project_id, caller)
        if row.deleted is not None:
            raise ConflictError(_binned("project", project_id))
        if changes or expected is not None:
            self.repository.change(project_id, changes, expected)
        return self.get(project_id, caller)

    def put_in_bin(self, project_id: str, caller: Caller = KEYLESS) -> ProjectRow:
        """Put a project in the bin; its runs stay where they are."""
        if self.get(project_id, caller).deleted is None:
            self.repository.change(project_id, {"deleted": self._now()})
        return self.get(project_id, caller)

    def restore(self, project_id: str, caller: Caller = KEYLESS) -> ProjectRow:
        """Take a project out of the bin (ConflictError if its time there is over)."""
        row = self.get(project_id, caller)
        if row.deleted is not None:
            _require_in_time("project", project_id, row.deleted, self._settings, self._now)
            self.repository.change(project_id, {"deleted": None})
        return self.get(project_id, caller)


class Runs:
    """Runs of a service."""

    def __init__(self, database: Database, settings: Settings, now: Clock) -> None:
        self.repository = RunRepository(database, now)
        self._settings, self._now = settings, now

    def get(self, job_id: str, caller: Caller = KEYLESS) -> RunRow:
        """A run, in the bin or not (NotFoundError if the caller sees none of this id)."""
        return visible(self.repository.get(job_id), caller, f"there is no run {job_id!r}")

    def change(
        self,
        job_id: str,
        changes: Mapping[str, Any],
        expected: Collection[int] | None = None,
        caller: Caller = KEYLESS,
    ) -> RunRow:
        """Change what is said of a run; `RunRepository.change` lists the errors."""
        row = self.get(job_id, caller)
        if row.deleted is not None:
            raise ConflictError(_binned("run", job_id))
        if changes or expected is not None:
            self.repository.change(row, changes, expected)
        return self.get(job_id, caller)

    def put_in_bin(self, job_id: str, caller: Caller = KEYLESS) -> RunRow:
        """Put a run in the bin.

        Raises
        ------
        NotFoundError
            The caller sees none of this id.
        ConflictError
            It has not ended.
        """
        row = self.get(job_id, caller)
        if not row.job.state.finished:
            raise ConflictError(
                f"run {job_id} is {row.job.state.value}: dismiss it first, DELETE /v1/jobs/{job_id}"
            )
        if row.deleted is None:
            self.repository.put_in_bin(job_id)
        return self.get(job_id, caller)

    def restore(self, job_id: str, caller: Caller = KEYLESS) -> RunRow:
        """Take a run out of the bin (ConflictError if its time there is over)."""
        row = self.get(job_id, caller)
        if row.deleted is not None:
            _require_in_time("run", job_id, row.deleted, self._settings, self._now)
            self.repository.restore(job_id)
        return self.get(job_id, caller)


class Shares:
    """Links to runs that need no key."""

    def __init__(self, database: Database, runs: Runs, now: Clock) -> None:
        self.repository = ShareRepository(database)
        self._runs, self._now = runs, now

    def add(self, job_id: str, days: float | None, caller: Caller = KEYLESS) -> NewShare:
        """Make a link to a run.

        Parameters
        ----------
        days : after which it ends; None for never.

        Raises
        ------
        NotFoundError, ConflictError, StorageFullError
            There is no such run, it is in the bin, it has too many links.
        """
        run = self._runs.get(job_id, caller)
        if run.deleted is not None:
            raise ConflictError(_binned("run", job_id))
        share_id, now = secrets.token_hex(8), self._now()
        token = f"share_{share_id}_{secrets.token_hex(32)}"
        expires = None if days is None else now + timedelta(days=days)
        row = ShareRow(id=share_id, job_id=job_id, digest=_digest(token), created=now, expires=expires)
        self.repository.add(row, MOST_SHARES)
        return NewShare(row, token)

    def of_run(self, job_id: str, caller: Caller = KEYLESS) -> list[ShareRow]:
        """The links to a run, without their tokens."""
        return self.repository.of_run(self._runs.get(job_id, caller).job.id)

    def end(self, job_id: str, share_id: str, caller: Caller = KEYLESS) -> None:
        """End a link to a run (NotFoundError if there is none)."""
        self._runs.get(job_id, caller)
        if not self.repository.delete(job_id, share_id):
            raise NotFoundError(f"run {job_id} has no link {share_id!r:.80}")

    def run_of(self, token: str) -> tuple[RunRow, Caller]:
        """The run that a link is to, and who may read that run and nothing else.

        Compared in a time that tells nothing. The caller owns what the run's owner owns: routes must ask for
        nothing but this run with it.

        Raises
        ------
        NotFoundError
            The link is none, has ended, or its run is in the bin.
        """
        found = _TOKEN.fullmatch(token)
        row = None if found is None else self.repository.get(found[1])
        same = hmac.compare_digest(_digest(token), _NO_DIGEST if row is None else row.digest)
        if row is None or not same or (row.expires is not None and row.expires <= self._now()):
            raise NotFoundError(_NO_LINK)
        run = self._runs.repository.get(row.job_id)
        if run is None or run.deleted is not None:
            raise NotFoundError(_NO_LINK)
        return run, replace(KEYLESS, owner=run.owner, scopes=frozenset({Scope.READ}))


_NO_LINK = "there is no such link, or it has ended"


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


def _binned(what: str, name: str) -> str:
    return f"{what} {name} is in the bin: POST /v1/{what}s/{name}/restore takes it out"


def _require_in_time(what: str, name: str, deleted: datetime, settings: Settings, now: Clock) -> None:
    # What is older may be being deleted at this moment.
    if deleted < now() - timedelta(days=settings.bin_days):
        raise ConflictError(
            f"{what} {name} was in the bin for more than {settings.bin_days:g} days and is being deleted"
        )
