"""What belongs to owners: rows found, listed, stored, put in the bin; projects, scenes, uploads and keys.

A token of a key or a link is ``<prefix>_<id>_<secret>`` and shown once. The secret has 256 random bits, so a
plain SHA-256 is enough to keep: slow hashes (bcrypt, Argon2) make guessing dear where people choose words,
and nobody guesses one of 2^256 numbers however fast the hash is. They would only cost every request a tenth
of a second.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from sqlalchemy import (
    BindParameter,
    ColumnElement,
    Connection,
    Select,
    and_,
    bindparam,
    delete,
    func,
    insert,
    inspect,
    literal,
    or_,
    select,
    update,
)
from sqlalchemy.orm import Session, defer

from service.db.clock import Clock, new_id, utc_now
from service.db.engine import Database
from service.db.models import ApiKey, Job, Project, StoredScene, Upload
from service.db.upload_files import UploadFiles
from service.errors import ChangedMeanwhileError, ConflictError, NotFoundError, StorageFullError
from service.jobs.strict_json import encoded


class Kept(Protocol):
    """A row with what is kept of a token."""

    id: Any
    digest: Any


KeptT = TypeVar("KeptT", bound=Kept)


@dataclass(frozen=True, slots=True)
class Made(Generic[KeptT]):
    """What was just made to be opened by a token; `token` is nowhere else."""

    row: KeptT
    token: str

    def __repr__(self) -> str:
        """Without the token, which must not get into a log."""
        return f"Made(row.id={self.row.id!r})"


def digest_of(token: str) -> str:
    """What is kept of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


# Compared with when there is no such row: a refusal then costs what it costs for one there is.
_NO_DIGEST = digest_of(secrets.token_hex(32))


class Tokens:
    """Tokens of one prefix, whose ids have so many bytes."""

    def __init__(self, prefix: str, id_bytes: int) -> None:
        self._prefix, self._id_bytes = prefix, id_bytes
        self._form = re.compile(rf"{prefix}_([0-9a-f]{{{2 * id_bytes}}})_([0-9a-f]{{64}})")

    def new(self, row_id: str | None = None) -> tuple[str, str]:
        """An id, that of a row or a new one, and a token of it."""
        found = secrets.token_hex(self._id_bytes) if row_id is None else row_id
        return found, f"{self._prefix}_{found}_{secrets.token_hex(32)}"

    def id_of(self, token: str) -> str | None:
        """The id in a token; None if this is none."""
        found = self._form.fullmatch(token)
        return None if found is None else found[1]


def matches(token: str, row: Kept | None) -> bool:
    """Whether a token is the one of a row, in a time that tells nothing; also without a row."""
    same = hmac.compare_digest(digest_of(token), _NO_DIGEST if row is None else row.digest)
    return same and row is not None


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

    NotFoundError with `missing`, the same for what is not there and for another's.
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

    @cached_property
    def _by_key(self) -> Select[Any]:
        """The row of a key, whose parts are given by the names of their columns."""
        return self._select.where(*(column == bindparam(column.key) for column in _key_of(self.table)))

    def _given(self, key: tuple[str, ...]) -> dict[str, str]:
        return {column.key: one for column, one in zip(_key_of(self.table), key, strict=True)}

    def get(self, *key: str) -> RowT | None:
        """The row of a key, in general its id, whoever owns it, or None."""
        return next(iter(self._all(self._by_key, self._given(key))), None)

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
        with self._db.looking() as connection:
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
        self, row_id: str, changes: Mapping[str, Any], expected: Collection[int] | None, sees: str | None
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


MOST_PROJECTS = 1000


class Projects(Binned[Project], Rows[Project]):
    """Projects of one database; a project in the bin keeps its runs."""

    what, table, said = "project", Project, Project

    def add(self, owner: str, name: str, notes: str, most: int = MOST_PROJECTS) -> Project:
        """Make a project (StorageFullError if the owner has `most`, with those in the bin)."""
        now = self._now()
        with self._db.writing() as connection:
            words = f"an owner may have {most} projects, with those in the bin"
            self._require_room(connection, Project.owner == owner, most, words)
            row = Project(
                id=new_id(), owner=owner, name=name, notes=notes, created=now, changed=now, revision=1, runs=0
            )
            return self._insert(connection, row)

    def page(
        self, limit: int, before: str | None = None, *, owner: str | None = None, text: str | None = None,
        deleted: bool = False,
    ) -> list[Project]:  # fmt: skip
        """Projects of an owner, or of everybody (None), newest first, older than the project `before`."""
        holds: list[ColumnElement[bool]] = [
            Project.deleted.is_not(None) if deleted else Project.deleted.is_(None)
        ]
        if text is not None:
            named = (one.icontains(text, autoescape=True) for one in (Project.name, Project.notes))
            holds.append(or_(*named))
        return self._newest(limit, before, owner, *holds)


class SceneRepository(Rows[StoredScene]):
    """Scenes of one database, each of an owner and a name; a stored scene never changes."""

    table = StoredScene

    def add(self, owner: str, name: str, scene_hash: str, body: dict[str, Any]) -> tuple[StoredScene, bool]:
        """Store a scene, or find the one of this owner and name; whether it was stored."""
        text = encoded(body)

        def find_or_add(connection: Connection) -> tuple[StoredScene, bool]:
            for known in self._read(connection, self._by_key, self._given((owner, name))):
                return known, False
            row = StoredScene(
                owner=owner, name=name, scene_hash=scene_hash, created=self._now(), size=len(text), body=body
            )
            return self._insert(connection, row, body=text), True

        return self._db.written(find_or_add)

    def page(self, owner: str | None, after: tuple[str, str] | None, limit: int) -> list[StoredScene]:
        """Scenes of an owner, or of everybody (None), by name, without their tables.

        Parameters
        ----------
        after : name and owner of the last one on the page before.
        limit : most that are listed.
        """
        query = (
            self._select.options(defer(StoredScene.body))
            .order_by(StoredScene.name, StoredScene.owner)
            .limit(limit)
        )
        if owner is not None:
            query = query.where(StoredScene.owner == owner)
        if after is not None:
            name, whose = after
            query = query.where(
                or_(StoredScene.name > name, and_(StoredScene.name == name, StoredScene.owner > whose))
            )
        return self._all(query)


class UploadRepository(Rows[Upload]):
    """Uploads of one database; what a stored one holds never changes."""

    table = Upload

    @cached_property
    def files(self) -> UploadFiles:
        """What they hold."""
        return UploadFiles(self._db.url, self._db.reading, self._db.writing)

    def add(self, file: Path, row: Upload, parts: Collection[str] | None = ()) -> tuple[Upload, bool]:
        """Store a file of `files.work`, or find the same one of the same owner and format; if it was stored.

        One that is there already counts as new from now on: who sent it is about to use it.

        Parameters
        ----------
        row : what is said of it; id and time are given here.
        parts : those it was put together of, which go as it comes; of a part None, which is never the same
            as another: whoever sent it deletes it.
        """
        row.id, row.created = new_id(), self._now()
        self.files.put(row.id, file)
        same = (Upload.owner == row.owner, Upload.sha256 == row.sha256, Upload.format == row.format)
        known_rows = self._select.where(*same).order_by(Upload.id).limit(1)
        with self._db.writing() as connection:
            for known in self._read(connection, known_rows) if parts is not None else ():
                known.created = row.created
                connection.execute(update(Upload).where(Upload.id == known.id).values(created=row.created))
                break
            else:
                known = self._insert(connection, row)
            connection.execute(delete(Upload).where(Upload.id.in_(parts or ())))
        self.files.remove([*(parts or ()), *([row.id] if known is not row else ())])
        return known, known is row

    def page(self, limit: int, before: str | None = None, owner: str | None = None) -> list[Upload]:
        """Uploads, newest first, older than the upload `before`; only those of `owner` if given."""
        return self._newest(limit, before, owner)

    def delete(self, upload_id: str, before: datetime | None = None) -> int:
        """Forget an upload, unless it was sent again since a time; how many were, 0 or 1."""
        old = () if before is None else (Upload.created < before,)
        found = self._updated(delete(Upload).where(Upload.id == upload_id, *old))
        if found:
            self.files.remove([upload_id])
        return int(found)


_OWNER: BindParameter[str] = bindparam("owner")
OF_JOBS = select(func.coalesce(func.sum(Job.stored_bytes), 0)).where(Job.owner == _OWNER)
_OF_UPLOADS = select(func.coalesce(func.sum(Upload.size), 0)).where(Upload.owner == _OWNER)
_OF_SCENES = select(func.coalesce(func.sum(StoredScene.size), 0)).where(StoredScene.owner == _OWNER)


class StorageRepository:
    """What is stored in one database, by owner."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def of(self, owner: str) -> int:
        """Bytes of an owner's jobs with results and sweeps, of their uploads and of their scenes."""
        with self._db.reading() as connection:
            counted = (
                connection.execute(one, {"owner": owner}) for one in (OF_JOBS, _OF_UPLOADS, _OF_SCENES)
            )
            return sum(int(one.scalar_one()) for one in counted)


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

    def usable(self, now: datetime | None, owner: str | None = None) -> bool:
        """Whether any key works, or one of an owner; without a time whether one was not revoked."""
        query = select(ApiKey.id).where(ApiKey.revoked.is_(None)).limit(1)
        if now is not None:
            query = query.where(or_(ApiKey.expires.is_(None), ApiKey.expires > now))
        if owner is not None:
            query = query.where(ApiKey.owner == owner)
        with self._db.reading() as connection:
            return connection.execute(query).one_or_none() is not None

    def rotate(self, key_id: str) -> Made[ApiKey]:
        """Give a key another secret; the old one ends.

        NotFoundError if there is none of this id, or it was revoked.
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
