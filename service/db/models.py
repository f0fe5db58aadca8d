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
    LargeBinary,
    MetaData,
    String,
    Text,
    TypeDecorator,
    UniqueConstraint,
    false,
    func,
    select,
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


class Base(DeclarativeBase):
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


class Job(Base):
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

    __table_args__ = (
        Index(None, "state", "owner", "priority", "id"),
        Index(None, "spec_hash", "state", "owner"),
        Index(None, "kind", "id"),
        Index(None, "scene_name", "id"),
        Index(None, "result_of"),
        Index(None, "owner", "id"),
        Index(None, "owner", "stored_bytes"),
        UniqueConstraint("owner", "idempotency_key"),
        CheckConstraint("attempt >= 0 AND max_attempts >= 1", name="attempts"),
        CheckConstraint("(state = 'running') = (lease_owner IS NOT NULL)", name="lease"),
    )


class JobResult(Base):
    """What a job computed, apart from its sweeps; in a table of its own so that lists of jobs stay light."""

    __tablename__ = "job_result"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), primary_key=True
    )
    body: Mapped[dict[str, Any]]
    sha256: Mapped[str | None] = mapped_column(String(64))


class Checkpoint(Base):
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


class ApiKey(Base):
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


class Upload(Base):
    """A file that a client sent, to be referred to by its id."""

    __tablename__ = "upload"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH))
    name: Mapped[str] = mapped_column(String(200))
    format: Mapped[str] = mapped_column(String(32))
    size: Mapped[int]
    sha256: Mapped[str] = mapped_column(String(64))
    created: Mapped[datetime]
    data: Mapped[bytes] = mapped_column(LargeBinary(), deferred=True)

    __table_args__ = (Index(None, "owner", "id"),)


class Scene(Base):
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


class Sweep(Base):
    """One branch that a job computed, without its contacts and arrays: what people filter by."""

    __tablename__ = "sweep"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    job_id: Mapped[str] = mapped_column(String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"))
    position: Mapped[int]
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH), default=NOBODY, server_default=NOBODY)
    scene_name: Mapped[str] = mapped_column(String(200))
    scene_hash: Mapped[str] = mapped_column(String(64))
    parameter: Mapped[str] = mapped_column(String(200))
    from_value: Mapped[float]
    to_value: Mapped[float]
    frequency_hz: Mapped[float | None]
    excitation_amplitude: Mapped[float | None]
    harmonics: Mapped[int]
    points: Mapped[int]
    peak: Mapped[float | None]
    peak_at: Mapped[float | None]
    limit: Mapped[float | None]
    band_hz: Mapped[float | None]
    error_estimate: Mapped[float | None]
    peaks_known: Mapped[bool | None]
    newton_iterations: Mapped[int]
    rejected_steps: Mapped[int]
    seconds: Mapped[float]
    completed: Mapped[bool]
    intermediate: Mapped[bool] = mapped_column(default=False, server_default=false())
    status: Mapped[str] = mapped_column(Text())
    created: Mapped[datetime]

    @property
    def key(self) -> str:
        """Its id."""
        return self.id

    __table_args__ = (
        Index(None, "job_id", "id"),
        Index(None, "owner", "id"),
        Index(None, "scene_name", "peak", "id"),
        Index(None, "scene_name", "id"),
        Index(None, "scene_hash", "id"),
        Index(None, "completed", "id"),
        Index(None, "intermediate", "id"),
        Index(None, "parameter", "id"),
        Index(None, "peak", "id"),
        Index(None, "peak_at", "id"),
        Index(None, "band_hz", "id"),
        Index(None, "points", "id"),
        Index(None, "seconds", "id"),
        Index(None, "harmonics", "id"),
    )


class SweepContact(Base):
    """The values of one contact during a sweep; the value that was swept is NULL, it has no single value."""

    __tablename__ = "sweep_contact"

    sweep_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("sweep.id", ondelete="CASCADE"), primary_key=True
    )
    name: Mapped[str] = mapped_column(String(200), primary_key=True)
    position: Mapped[int]
    kt: Mapped[float | None]
    mu: Mapped[float | None]
    N0: Mapped[float | None] = mapped_column("N0")
    N1: Mapped[float | None] = mapped_column("N1")
    N1_phase: Mapped[float | None] = mapped_column("N1_phase")

    __table_args__ = (Index(None, "N0", "name", "sweep_id"), Index(None, "name", "N0", "sweep_id"))


class SweepArray(Base):
    """One array of a sweep in NumPy's npy format, with the SHA-256 of its bytes."""

    __tablename__ = "sweep_array"

    sweep_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("sweep.id", ondelete="CASCADE"), primary_key=True
    )
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    sha256: Mapped[str] = mapped_column(String(64))
    data: Mapped[bytes] = mapped_column(LargeBinary())


class Design(Base):
    """What a design job found, without its variables: what people filter by. Its id is its job's."""

    __tablename__ = "design"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), primary_key=True
    )
    owner: Mapped[str] = mapped_column(String(OWNER_LENGTH), default=NOBODY, server_default=NOBODY)
    scene_name: Mapped[str] = mapped_column(String(200))
    scene_hash: Mapped[str] = mapped_column(String(64))
    method: Mapped[str] = mapped_column(String(32))
    robust: Mapped[bool]
    reached: Mapped[bool]
    feasible: Mapped[bool]
    status: Mapped[str] = mapped_column(Text())
    objective: Mapped[float | None]
    peak: Mapped[float | None]
    peak_at: Mapped[float | None]
    limit: Mapped[float | None]
    band_hz: Mapped[float | None]
    harmonics: Mapped[int]
    evaluations: Mapped[int]
    work: Mapped[float | None]
    seconds: Mapped[float]
    created: Mapped[datetime]

    @property
    def key(self) -> str:
        """Its id."""
        return self.job_id

    __table_args__ = (
        Index(None, "owner", "job_id"),
        Index(None, "scene_name", "peak", "job_id"),
        Index(None, "scene_name", "job_id"),
        Index(None, "scene_hash", "job_id"),
        Index(None, "method", "job_id"),
        Index(None, "robust", "job_id"),
        Index(None, "reached", "job_id"),
        Index(None, "feasible", "job_id"),
        Index(None, "objective", "job_id"),
        Index(None, "peak", "job_id"),
        Index(None, "peak_at", "job_id"),
        Index(None, "band_hz", "job_id"),
        Index(None, "work", "job_id"),
        Index(None, "seconds", "job_id"),
    )


class DesignVariable(Base):
    """A variable of a design with its bounds and its best value, NULL if no design could be computed."""

    __tablename__ = "design_variable"

    design_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("design.job_id", ondelete="CASCADE"), primary_key=True
    )
    name: Mapped[str] = mapped_column(String(500), primary_key=True)
    position: Mapped[int]
    value: Mapped[float | None]
    low: Mapped[float]
    high: Mapped[float]

    __table_args__ = (Index(None, "name", "value", "design_id"), Index(None, "value", "name", "design_id"))


NAME_LENGTH = 200
TAG_LENGTH = 50


class Run(Base):
    """What is said of a job: the project it belongs to, its name, its notes, whether it is in the bin.

    A job of which nothing was ever said has no row here.
    """

    __tablename__ = "run"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"), primary_key=True
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


class Project(Base):
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


class RunTag(Base):
    """A word that a run is marked with."""

    __tablename__ = "run_tag"

    job_id: Mapped[str] = mapped_column(
        String(ID_LENGTH), ForeignKey("run.job_id", ondelete="CASCADE"), primary_key=True
    )
    tag: Mapped[str] = mapped_column(String(TAG_LENGTH), primary_key=True)

    __table_args__ = (Index(None, "tag", "job_id"),)


class Share(Base):
    """A link to a run that needs no key; of its token only a digest is kept."""

    __tablename__ = "share"

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    job_id: Mapped[str] = mapped_column(String(ID_LENGTH), ForeignKey("job.id", ondelete="CASCADE"))
    digest: Mapped[str] = mapped_column(String(64))
    created: Mapped[datetime]
    expires: Mapped[datetime | None]

    __table_args__ = (Index(None, "job_id", "id"), Index(None, "expires", "id"))
