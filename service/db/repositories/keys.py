"""The keys to the REST API."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from datetime import datetime
from typing import Any

from sqlalchemy import insert, or_, select, update

from service.db.engine import Database
from service.db.models import ApiKey

__all__ = ["KeyRepository", "KeyRow"]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyRow:
    """A key; `digest` is all there is of its secret."""

    id: str
    owner: str
    scopes: list[str]
    digest: str
    limits: dict[str, Any]
    created: datetime
    expires: datetime | None = None
    revoked: datetime | None = None
    last_used: datetime | None = None


_COLUMNS = [getattr(ApiKey, item.name) for item in fields(KeyRow)]


class KeyRepository:
    """Keys of one database. Its writes are short and may be made beside a running service, on SQLite too."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add(self, row: KeyRow) -> None:
        """Store a key."""
        with self._db.writing() as connection:
            connection.execute(insert(ApiKey).values(**asdict(row)))

    def get(self, key_id: str) -> KeyRow | None:
        """The key, or None."""
        with self._db.reading() as connection:
            row = connection.execute(select(*_COLUMNS).where(ApiKey.id == key_id)).mappings().one_or_none()
        return None if row is None else KeyRow(**row)

    def all(self) -> list[KeyRow]:
        """Every key, also those that do not work any more, by owner and age."""
        query = select(*_COLUMNS).order_by(ApiKey.owner, ApiKey.created, ApiKey.id)
        with self._db.reading() as connection:
            return [KeyRow(**row) for row in connection.execute(query).mappings()]

    def usable(self, now: datetime) -> bool:
        """Whether any key works."""
        alive = or_(ApiKey.expires.is_(None), ApiKey.expires > now)
        query = select(ApiKey.id).where(ApiKey.revoked.is_(None), alive).limit(1)
        with self._db.reading() as connection:
            return connection.execute(query).one_or_none() is not None

    def rotate(self, key_id: str, digest: str) -> bool:
        """Give a key another secret; whether there is such a key that was not revoked."""
        change = update(ApiKey).where(ApiKey.id == key_id, ApiKey.revoked.is_(None)).values(digest=digest)
        with self._db.writing() as connection:
            return connection.execute(change).rowcount > 0

    def revoke(self, key_id: str, now: datetime) -> bool:
        """End a key; whether there is such a key that was not revoked before."""
        change = update(ApiKey).where(ApiKey.id == key_id, ApiKey.revoked.is_(None)).values(revoked=now)
        with self._db.writing() as connection:
            return connection.execute(change).rowcount > 0

    def touch(self, key_id: str, now: datetime) -> None:
        """Note that a key was used."""
        with self._db.writing() as connection:
            connection.execute(update(ApiKey).where(ApiKey.id == key_id).values(last_used=now))
