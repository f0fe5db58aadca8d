"""The tables, each with the names of its constraints, as SQLAlchemy and Alembic see them."""

from __future__ import annotations

import enum
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    DateTime,
    Dialect,
    Enum,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    TypeDecorator,
    UniqueConstraint,
    column,
    func,
    select,
    table,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, column_property, mapped_column

NAMING_CONVENTION = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}

ID_LENGTH = 36
OWNER_LENGTH = 100
NOBODY = ""
"""The owner of what was made without a key."""


class JobState(enum.StrEnum):
    """The states of a job, in the words of OGC API Processes."""

    ACCEPTED = "accepted"
    RUNNING = "running"
    SUCCESSFUL = "successful"
    FAILED = "failed"
    DISMISSED = "dismissed"

    @property
    def finished(self) -> bool:
        """Whether a job in this state stays in it."""
        return self in (JobState.SUCCESSFUL, JobState.FAILED, JobState.DISMISSED)


class UtcDateTime(TypeDecorator[datetime]):
    """A point in time; aware in Python, kept as UTC (SQLite has no time zones)."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To UTC; a naive time is an error of the program."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"a time must carry its zone, got {value!r}")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Aware again."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


def _values(members: type[enum.Enum]) -> list[str]:
    return [str(member.value) for member in members]


class TableBase(DeclarativeBase):
    """Root of the tables."""

    metadata = MetaData(naming_convention=NAMING_CONVENTION)
    type_annotation_map = {  # noqa: RUF012 - SQLAlchemy reads it from the class
        datetime: UtcDateTime(),
        dict[str, Any]: JSON(none_as_null=True),
        list[str]: JSON(),
        JobState: Enum(
            JobState,
            name="state",
            native_enum=False,
            create_constraint=True,
            length=16,
            values_callable=_values,
        ),
    }


class Job(TableBase):
    """A job, and with its state `accepted` the queue."""

    __tablename__ = "job"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    state: Mapped[JobState]
    priority: Mapped[int] = mapped_column(default=0)
    scene_name: Mapped[str | None] = mapped_column(String(200))
    scene_hash: Mapped[str | None] = mapped_column(String(64))
    spec_hash: Mapped[str] = mapped_column(String(64))
    request_hash: Mapped[str] = mapped_column(String(64))
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH), default=NOBODY, server_default=NOBODY)
    idempotency_key: Mapped[str | None] = mapped_column(String(200))
    seconds_limit: Mapped[float | None]
    attempt: Mapped[int] = mapped_column(default=0)
    max_attempts: Mapped[int]
    lease_owner: Mapped[str | None] = mapped_column(String(200))
    lease_until: Mapped[datetime | None]
    cancel_requested: Mapped[bool] = mapped_column(default=False)
    progress: Mapped[float] = mapped_column(default=0.0)
    points: Mapped[int] = mapped_column(default=0)
    best: Mapped[dict[str, Any] | None]
    created: Mapped[datetime]
    started: Mapped[datetime | None]
    finished: Mapped[datetime | None]
    result_of: Mapped[str | None] = mapped_column(String(ID_LENGTH), ForeignKey("job.id"))
    error: Mapped[dict[str, Any] | None]
    request: Mapped[dict[str, Any]]
    spec: Mapped[dict[str, Any]]
    stored_bytes: Mapped[int] = mapped_column(BigInteger(), default=0, server_default="0")
    trace: Mapped[str | None] = mapped_column(String(64))

    __table_args__ = (
        Index(None, "state", "owner", "priority", "id"), Index(None, "spec_hash", "state", "owner"),
        Index(None, "kind", "id"), Index(None, "scene_name", "id"), Index(None, "result_of"),
        Index(None, "owner", "id"), Index(None, "owner", "stored_bytes"),
        UniqueConstraint("owner", "idempotency_key"),
        CheckConstraint("attempt >= 0 AND max_attempts >= 1", name="attempts"),
        CheckConstraint("(state = 'running') = (lease_owner IS NOT NULL)", name="lease"),
    )  # fmt: skip


class JobResult(TableBase):
    """What a job computed, apart from its sweeps; in a table of its own so that lists of jobs stay light."""

    __tablename__ = "job_result"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), primary_key=True
    )
    body: Mapped[dict[str, Any]]
    sha256: Mapped[str | None] = mapped_column(String(64))
    figures: Mapped[dict[str, Any] | None]


class Checkpoint(TableBase):
    """A piece of what an unfinished job has computed; gone when the job ends."""

    __tablename__ = "checkpoint"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), primary_key=True
    )
    part: Mapped[int] = mapped_column(primary_key=True)
    attempt: Mapped[int]
    created: Mapped[datetime]
    sha256: Mapped[str] = mapped_column(String(64))
    data: Mapped[bytes] = mapped_column(LargeBinary())


class ApiKey(TableBase):
    """A key to the REST API; of its secret only a digest is kept."""

    __tablename__ = "api_key"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH))
    scopes: Mapped[list[str]]
    digest: Mapped[str] = mapped_column(String(64))
    limits: Mapped[dict[str, Any]]
    created: Mapped[datetime]
    expires: Mapped[datetime | None]
    revoked: Mapped[datetime | None]
    last_used: Mapped[datetime | None]

    __table_args__ = (Index(None, "owner", "id"),)


class Upload(TableBase):
    """A file that a client sent, to be referred to by its id; `UploadFiles` has what it holds."""

    __tablename__ = "upload"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH))
    name: Mapped[str] = mapped_column(String(200))
    format: Mapped[str] = mapped_column(String(32))
    size: Mapped[int] = mapped_column(BigInteger())
    sha256: Mapped[str] = mapped_column(String(64))
    created: Mapped[datetime]

    __table_args__ = (Index(None, "owner", "id"),)


class UploadPiece(TableBase):
    """A piece of what an upload holds, in PostgreSQL; it comes before the upload's row and goes after it."""

    __tablename__ = "upload_piece"

    upload_id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary())


class StoredScene(TableBase):
    """A scene stored under a name; never changed, so that a name means one thing for ever to its owner."""

    __tablename__ = "scene"

    owner: Mapped[str] = mapped_column(
        String(OWNER_LENGTH), primary_key=True, default=NOBODY, server_default=NOBODY
    )
    name: Mapped[str] = mapped_column(String(200), primary_key=True)
    scene_hash: Mapped[str] = mapped_column(String(64))
    created: Mapped[datetime]
    size: Mapped[int] = mapped_column(BigInteger(), default=0, server_default="0")
    body: Mapped[dict[str, Any]]

    @property
    def shipped(self) -> bool:
        """Whether it comes with the package: such a one is in no database, and was never stored."""
        return self.created is None


class Result(TableBase):
    """What was computed and can be asked for: a sweep, a design, or the result of a job of another kind.

    Its figures are rows of `Figure`. Results are numbered in the order in which they were stored. The id of
    what a job has one of is that of the job.
    """

    __tablename__ = "result"

    number: Mapped[int] = mapped_column(BigInteger().with_variant(Integer(), "sqlite"), primary_key=True)
    id: Mapped[str] = mapped_column(String(ID_LENGTH), unique=True)
    of: Mapped[str] = mapped_column(String(32))
    job_id: Mapped[str] = mapped_column(String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"))
    position: Mapped[int]
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH))
    scene_name: Mapped[str | None] = mapped_column(String(200))
    scene_hash: Mapped[str | None] = mapped_column(String(64))
    status: Mapped[str] = mapped_column(Text())
    created: Mapped[datetime]

    __table_args__ = (
        Index(None, "job_id", "of"), Index(None, "of", "number"), Index(None, "of", "owner", "number"),
        Index(None, "of", "scene_name", "number"), Index(None, "of", "scene_hash", "number"),
    )  # fmt: skip


class Quantity(TableBase):
    """What figures are: of what results, and their name. A part has its name for a label, a word itself."""

    __tablename__ = "quantity"

    id: Mapped[int] = mapped_column(primary_key=True)
    of: Mapped[str] = mapped_column(String(32))
    name: Mapped[str] = mapped_column(String(200))
    label: Mapped[str] = mapped_column(String(500))

    __table_args__ = (UniqueConstraint("of", "name", "label"),)


class Figure(TableBase):
    """A figure of a result: a number, a truth as 1 or 0, or 0 for a word or the place of a part."""

    __tablename__ = "figure"

    quantity: Mapped[int] = mapped_column(ForeignKey("quantity.id"), primary_key=True)
    value: Mapped[float] = mapped_column(primary_key=True)
    result: Mapped[int] = mapped_column(ForeignKey("result.number", ondelete="CASCADE"), primary_key=True)

    # SQLite keeps such a table in the order of its key: a filter reads what it finds, and nothing else.
    __table_args__ = (Index(None, "result", "quantity", "value"), {"sqlite_with_rowid": False})


class SweepArray(TableBase):
    """One array of a sweep in NumPy's npy format, with the SHA-256 of its bytes.

    One with a `size` is in the store of arrays (`stickslip.lab.stores.array_store`), and has no bytes here.
    """

    __tablename__ = "sweep_array"

    sweep_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("result.id", ondelete="CASCADE"), primary_key=True
    )
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    sha256: Mapped[str] = mapped_column(String(64))
    data: Mapped[bytes] = mapped_column(LargeBinary())
    size: Mapped[int | None] = mapped_column(BigInteger())


NAME_LENGTH = 200
TAG_LENGTH = 50


class Run(TableBase):
    """What is said of a job: the project it belongs to, its name, its notes, whether it is in the bin.

    A job of which nothing was ever said has no row here. The number is for the index of names and notes that
    SQLite has (`RUN_TEXT`); to all others a run is known by its job.
    """

    __tablename__ = "run"

    number: Mapped[int] = mapped_column(BigInteger().with_variant(Integer(), "sqlite"), primary_key=True)
    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), unique=True
    )
    project_id: Mapped[str | None] = mapped_column(
        String(ID_LENGTH), ForeignKey("project.id", ondelete="SET NULL")
    )
    name: Mapped[str] = mapped_column(String(NAME_LENGTH))
    notes: Mapped[str] = mapped_column(Text())
    changed: Mapped[datetime]
    revision: Mapped[int]
    deleted: Mapped[datetime | None]

    __table_args__ = (Index(None, "project_id", "job_id"), Index(None, "deleted", "job_id"))
    __mapper_args__ = {"primary_key": [job_id]}  # noqa: RUF012 - SQLAlchemy reads it from the class


RUN_TEXT = table("run_text", column("rowid", Integer), column("run_text", Text))
"""SQLite's index of the names and notes of runs, kept by triggers; `rowid` is the number of the run."""

RUN_LETTERS = table("run_text_letters", column("term", Text), column("doc", Integer))
"""The triples of letters in that index and where each stands; every letter begins one."""


class Project(TableBase):
    """A name under which an owner gathers runs.

    `revision` counts its changes. `deleted` is when it was put in the bin, NULL outside of it. `runs` counts
    those in it that are not in the bin.
    """

    __tablename__ = "project"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH))
    name: Mapped[str] = mapped_column(String(NAME_LENGTH))
    notes: Mapped[str] = mapped_column(Text())
    created: Mapped[datetime]
    changed: Mapped[datetime]
    revision: Mapped[int]
    deleted: Mapped[datetime | None]
    runs: Mapped[int] = column_property(
        select(func.count())
        .where(Run.project_id == id, Run.deleted.is_(None))
        .correlate_except(Run)
        .scalar_subquery()
    )

    __table_args__ = (Index(None, "owner", "id"), Index(None, "deleted", "id"))


class RunTag(TableBase):
    """A word that a run is marked with."""

    __tablename__ = "run_tag"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("run.job_id", ondelete="CASCADE"), primary_key=True
    )
    tag: Mapped[str] = mapped_column(String(TAG_LENGTH), primary_key=True)

    __table_args__ = (Index(None, "tag", "job_id"),)


class Share(TableBase):
    """A link to a run that needs no key; of its token only a digest is kept."""

    __tablename__ = "share"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    job_id: Mapped[str] = mapped_column(String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"))
    digest: Mapped[str] = mapped_column(String(64))
    created: Mapped[datetime]
    expires: Mapped[datetime | None]

    __table_args__ = (Index(None, "job_id", "id"), Index(None, "expires", "id"))
