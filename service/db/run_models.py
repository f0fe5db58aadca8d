"""The tables of the workbench: projects, what people say of their runs, and links that share a run."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, Index, String, Text, func, select
from sqlalchemy.orm import Mapped, column_property, mapped_column

from service.db.models import ID_LENGTH, OWNER_LENGTH, Base

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
