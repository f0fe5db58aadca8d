"""The keys to the REST API."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import or_, select, update

from service.db.models import ApiKey
from service.db.repositories.owned import Rows
from service.db.tokens import Made, Tokens, digest_of
from service.errors import NotFoundError

KEYS = Tokens("stickslip", id_bytes=6)


class KeyRepository(Rows[ApiKey]):
    """Keys of one database. Its writes are short and may be made beside a running service, on SQLite too."""

    table = ApiKey

    def add(self, **values: Any) -> Made[ApiKey]:
        """Make a key with these values of its row."""
        key_id, token = KEYS.new()
        with self._db.writing() as connection:
            return Made(self._insert(connection, ApiKey(id=key_id, digest=digest_of(token), **values)), token)

    def all(self) -> list[ApiKey]:
        """Every key, also those that do not work any more, by owner and age."""
        return self._all(self._select.order_by(ApiKey.owner, ApiKey.created, ApiKey.id))

    def usable(self, now: datetime) -> bool:
        """Whether any key works."""
        alive = or_(ApiKey.expires.is_(None), ApiKey.expires > now)
        with self._db.reading() as connection:
            query = select(ApiKey.id).where(ApiKey.revoked.is_(None), alive).limit(1)
            return connection.execute(query).one_or_none() is not None

    def rotate(self, key_id: str) -> Made[ApiKey]:
        """Give a key another secret; the old one ends.

        Raises
        ------
        NotFoundError
            If there is none of this id, or it was revoked.
        """
        _, token = KEYS.new(key_id)
        self._change(key_id, digest=digest_of(token))
        [row] = self._all(self._select.where(ApiKey.id == key_id))
        return Made(row, token)

    def revoke(self, key_id: str) -> None:
        """End a key; errors as of `rotate`."""
        self._change(key_id, revoked=self._now())

    def touch(self, key_id: str, now: datetime) -> None:
        """Note that a key was used."""
        self._updated(update(ApiKey).where(ApiKey.id == key_id).values(last_used=now))

    def _change(self, key_id: str, **values: object) -> None:
        working = (ApiKey.id == key_id, ApiKey.revoked.is_(None))
        if not self._updated(update(ApiKey).where(*working).values(**values)):
            raise NotFoundError(f"there is no key {key_id!r} that works: `stickslip keys list` shows all")
