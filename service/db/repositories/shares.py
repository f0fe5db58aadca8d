"""The links to runs that need no key."""

from __future__ import annotations

from datetime import timedelta

from sqlalchemy import delete

from service.db.clock import Clock
from service.db.engine import Database
from service.db.models import Share
from service.db.repositories.owned import Rows
from service.db.repositories.runs import RunRow, Runs
from service.db.tokens import Made, Tokens, digest_of, matches
from service.errors import NotFoundError

MOST_SHARES = 20
_TOKENS = Tokens("share", id_bytes=8)


class Shares(Rows[Share]):
    """Links to the runs of one database."""

    table = Share

    def __init__(self, database: Database, runs: Runs, now: Clock) -> None:
        super().__init__(database, now)
        self._runs = runs

    def add(self, job_id: str, days: float | None, sees: str | None, most: int = MOST_SHARES) -> Made[Share]:
        """Make a link to a run.

        Parameters
        ----------
        days : after which it ends; None for never.

        Raises
        ------
        NotFoundError, ConflictError, StorageFullError
            There is no such run, it is in the bin, it has `most` links.
        """
        self._runs.outside(job_id, sees)
        share_id, token = _TOKENS.new()
        now = self._now()
        expires = None if days is None else now + timedelta(days=days)
        row = Share(id=share_id, job_id=job_id, digest=digest_of(token), created=now, expires=expires)
        with self._db.writing() as connection:
            words = f"a run may have {most} links: end one of run {job_id}"
            self._require_room(connection, Share.job_id == job_id, most, words)
            return Made(self._insert(connection, row), token)

    def of_run(self, job_id: str, sees: str | None) -> list[Share]:
        """The links to a run, without their tokens, oldest first."""
        self._runs.seen(job_id, sees)
        return self._all(self._select.where(Share.job_id == job_id).order_by(Share.created, Share.id))

    def end(self, job_id: str, share_id: str, sees: str | None) -> None:
        """End a link to a run (NotFoundError if there is none)."""
        self._runs.seen(job_id, sees)
        if not self._updated(delete(Share).where(Share.id == share_id, Share.job_id == job_id)):
            raise NotFoundError(f"run {job_id} has no link {share_id!r:.80}")

    def run_of(self, token: str) -> RunRow:
        """The run that a link is to.

        Raises
        ------
        NotFoundError
            The link is none, has ended, or its run is in the bin.
        """
        share_id = _TOKENS.id_of(token)
        row = None if share_id is None else self.get(share_id)
        run = None
        if matches(token, row) and row is not None and (row.expires is None or row.expires > self._now()):
            run = self._runs.get(row.job_id)
        if run is None or run.deleted is not None:
            raise NotFoundError("there is no such link, or it has ended")
        return run
