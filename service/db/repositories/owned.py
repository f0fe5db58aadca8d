"""What belongs to owners: rows found, listed and stored; changed, put in the bin and taken out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from datetime import timedelta
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

from sqlalchemy import ColumnElement, Connection, Select, func, insert, inspect, literal, select, update
from sqlalchemy.orm import Session

from service.db.clock import Clock, utc_now
from service.db.engine import Database
from service.errors import ChangedMeanwhileError, ConflictError, NotFoundError, StorageFullError


class Owned(Protocol):
    """A row that belongs to somebody."""

    @property
    def owner(self) -> Any:
        """Whom it belongs to; a str."""


class InBin(Owned, Protocol):
    """A thing that may be in the bin."""

    @property
    def deleted(self) -> Any:
        """Since when; None outside of it."""


RowT = TypeVar("RowT")
OwnedT = TypeVar("OwnedT", bound=Owned)
BinnedT = TypeVar("BinnedT", bound=InBin)


def visible(row: OwnedT | None, sees: str | None, missing: str) -> OwnedT:
    """The row, if there is one and who `sees` an owner's things (None: everybody's) may see it.

    Raises
    ------
    NotFoundError
        With the words `missing`: the same for what is not there and for what is another's.
    """
    if row is None or sees not in (None, row.owner):
        raise NotFoundError(missing, withheld=row is not None)
    return row


def _key_of(table: type[Any]) -> list[Any]:
    """The columns of the primary key of a mapped class."""
    mapper: Any = inspect(table)
    return [getattr(table, column.key) for column in mapper.primary_key]


class Rows(Generic[RowT]):
    """Rows of one table, each method one transaction.

    A row is an instance of the mapped class, apart from the database; its deferred columns, which may be
    large, are not read with it.

    Parameters
    ----------
    database : where they are.
    now : the clock of the database.
    """

    table: type[RowT]

    def __init__(self, database: Database, now: Clock = utc_now) -> None:
        self._db, self._now = database, now

    @cached_property
    def _select(self) -> Select[Any]:
        """All rows; built once, which costs more than running it."""
        return select(self.table)

    @cached_property
    def _identity(self) -> Any:
        return _key_of(self.table)[0]

    def get(self, *key: str) -> RowT | None:
        """The row of a key, in general its id, whoever owns it, or None."""
        return next(iter(self._all(self._of(key))), None)

    def _of(self, key: tuple[str, ...]) -> Select[Any]:
        columns = _key_of(self.table)
        return self._select.where(*(column == one for column, one in zip(columns, key, strict=True)))

    def _newest(
        self, limit: int, before: str | None, owner: str | None, *holds: ColumnElement[bool]
    ) -> list[RowT]:
        """Rows of an owner, or of everybody (None), for which all conditions hold, newest first.

        Parameters
        ----------
        limit : most that are listed.
        before : id of the last one on the page before.
        """
        query = self._select.where(*holds).order_by(self._identity.desc()).limit(limit)
        if before is not None:
            query = query.where(self._identity < before)
        if owner is not None:
            query = query.where(self.table.owner == owner)  # type: ignore[attr-defined]
        return self._all(query)

    def _all(self, query: Select[Any], given: Mapping[str, Any] | None = None) -> list[RowT]:
        with self._db.reading() as connection:
            return self._read(connection, query, given)

    @staticmethod
    def _read(
        connection: Connection, query: Select[Any], given: Mapping[str, Any] | None = None
    ) -> list[RowT]:
        with Session(connection) as session:
            return list(session.scalars(query, given))

    def _insert(self, connection: Connection, row: RowT, **stored: Any) -> RowT:
        """Insert a row, with other values than its own where `stored` has them."""
        table: Any = self.table
        values = {column.key: getattr(row, column.key) for column in table.__table__.columns} | stored
        connection.execute(insert(self.table).values(values))
        return row

    def _require_room(
        self, connection: Connection, holds: ColumnElement[bool], most: int, words: str
    ) -> None:
        """Refuse one more (StorageFullError, with `words`) where `most` are there for which it holds."""
        held = select(func.count()).select_from(self.table).where(holds)
        if connection.execute(held).scalar_one() >= most:
            raise StorageFullError(words)

    def _updated(self, statement: Any) -> bool:
        """Execute a change or a deletion; whether there was such a row."""
        with self._db.writing() as connection:
            return connection.execute(statement).rowcount > 0


class Binned(Generic[BinnedT]):
    """What is said of things, each with a revision; they can be put in the bin and taken out.

    Parameters
    ----------
    database : where they are.
    now : the clock of the database.
    bin_days : after which they are deleted for good.
    """

    what: str
    said: Any
    """The mapped class with `revision`, `changed` and `deleted`."""
    get: Callable[..., BinnedT | None]
    """The thing of an id, in the bin or not, whoever owns it."""

    def __init__(self, database: Database, now: Clock, bin_days: float) -> None:
        self._db, self._now, self._bin_days = database, now, bin_days

    def seen(self, row_id: str, sees: str | None) -> BinnedT:
        """The thing, in the bin or not; `visible` says who may see it."""
        return visible(self.get(row_id), sees, f"there is no {self.what} {row_id!r}")

    def outside(self, row_id: str, sees: str | None) -> BinnedT:
        """The thing, as `seen` (ConflictError if it is in the bin)."""
        row = self.seen(row_id, sees)
        if row.deleted is not None:
            raise ConflictError(
                f"{self.what} {row_id} is in the bin: POST /v1/{self.what}s/{row_id}/restore takes it out"
            )
        return row

    def change(
        self,
        row_id: str,
        changes: Mapping[str, Any],
        expected: Collection[int] | None,
        sees: str | None,
    ) -> BinnedT:
        """Change what is said of a thing.

        Parameters
        ----------
        expected : the revisions of which it must have one; any if None.
        sees : whose things may be changed; everybody's if None.

        Raises
        ------
        NotFoundError, ConflictError
            As of `outside`.
        ChangedMeanwhileError
            It has another revision.
        InvalidRequestError
            It cannot be changed so.
        """
        self.outside(row_id, sees)
        if changes or expected is not None:
            with self._db.writing() as connection:
                self._lock(connection, row_id, expected)
                self._write(connection, row_id, changes)
        return self.seen(row_id, sees)

    def put_in_bin(self, row_id: str, sees: str | None) -> BinnedT:
        """Put a thing in the bin; one that is there stays since then."""
        if self.seen(row_id, sees).deleted is None:
            since = func.coalesce(self.said.deleted, literal(self._now(), self.said.deleted.type))
            self._move(row_id, since)
        return self.seen(row_id, sees)

    def restore(self, row_id: str, sees: str | None) -> BinnedT:
        """Take a thing out of the bin (ConflictError if its time there is over)."""
        deleted = self.seen(row_id, sees).deleted
        # What is older may be being deleted at this moment.
        if deleted is not None and deleted < self._now() - timedelta(days=self._bin_days):
            raise ConflictError(
                f"{self.what} {row_id} was in the bin for more than {self._bin_days:g} days "
                "and is being deleted"
            )
        if deleted is not None:
            self._move(row_id, None)
        return self.seen(row_id, sees)

    def _move(self, row_id: str, deleted: Any) -> None:
        with self._db.writing() as connection:
            self._lock(connection, row_id, None)
            self._write(connection, row_id, {"deleted": deleted})

    def _lock(self, connection: Connection, row_id: str, expected: Collection[int] | None) -> None:
        """Lock the row, and compare its revision."""
        query = select(self.said.revision).where(_key_of(self.said)[0] == row_id).with_for_update()
        revision = connection.execute(query).scalar_one_or_none()
        if expected is not None and revision not in expected:
            raise ChangedMeanwhileError(
                f"{self.what} {row_id} was changed meanwhile: get it again, and change that"
            )

    def _write(self, connection: Connection, row_id: str, values: Mapping[str, Any]) -> None:
        counted = {"revision": self.said.revision + 1, "changed": self._now()}
        change = update(self.said).where(_key_of(self.said)[0] == row_id)
        connection.execute(change.values(**values, **counted))
