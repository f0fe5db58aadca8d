"""An index of the names and notes of runs, for searches of a piece of them.

Revision 0009, after 0008. On SQLite a full-text index of triples of letters, which triggers keep; it names
rows by a number, which runs get. On PostgreSQL an index of `pg_trgm`; where that extension cannot be had
searches read all rows, as before.
"""

from __future__ import annotations

import logging

import sqlalchemy as sa
from alembic import op
from sqlalchemy.exc import DBAPIError

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_LOGGER = logging.getLogger("stickslip.migrations")
_COLUMNS = "job_id, project_id, name, notes, changed, revision, deleted"
_GONE = (
    "INSERT INTO run_text (run_text, rowid, name, notes) VALUES ('delete', old.number, old.name, old.notes)"
)
_NEW = "INSERT INTO run_text (rowid, name, notes) VALUES (new.number, new.name, new.notes)"
_INDEX = """
    CREATE VIRTUAL TABLE run_text USING fts5 (
        name, notes, content='run', content_rowid='number', tokenize='trigram')
"""
_KEPT = (
    ("insert", "INSERT", (_NEW,)),
    ("delete", "DELETE", (_GONE,)),
    ("update", "UPDATE OF name, notes", (_GONE, _NEW)),
)
_TRIGRAMS = "(name gin_trgm_ops, notes gin_trgm_ops)"


def upgrade() -> None:
    """To this revision."""
    sqlite = op.get_bind().dialect.name == "sqlite"
    if sqlite:
        _rebuilt(numbered=True)
    else:
        op.drop_constraint("fk_run_tag_job_id_run", "run_tag", type_="foreignkey")
        op.drop_constraint("pk_run", "run", type_="primary")
        op.execute("ALTER TABLE run ADD COLUMN number BIGSERIAL CONSTRAINT pk_run PRIMARY KEY")
        op.create_unique_constraint("uq_run_job_id", "run", ["job_id"])
        _refer_to_runs()
    if sqlite:
        op.execute(_INDEX)
        for name, when, does in _KEPT:
            op.execute(f"CREATE TRIGGER run_text_{name} AFTER {when} ON run BEGIN {'; '.join(does)}; END")
        op.execute("INSERT INTO run_text (run_text) VALUES ('rebuild')")
    elif _has_trigrams():
        op.execute(f"CREATE INDEX ix_run_text ON run USING gin {_TRIGRAMS} WITH (fastupdate = off)")


def downgrade() -> None:
    """Back to the one before."""
    if op.get_bind().dialect.name == "sqlite":
        for name, _, _ in _KEPT:
            op.execute(f"DROP TRIGGER run_text_{name}")
        op.drop_table("run_text")
        _rebuilt(numbered=False)
        return
    op.execute("DROP INDEX IF EXISTS ix_run_text")
    op.drop_constraint("fk_run_tag_job_id_run", "run_tag", type_="foreignkey")
    op.drop_constraint("uq_run_job_id", "run", type_="unique")
    op.drop_column("run", "number")
    op.create_primary_key("pk_run", "run", ["job_id"])
    _refer_to_runs()


def _refer_to_runs() -> None:
    op.create_foreign_key(
        "fk_run_tag_job_id_run", "run_tag", "run", ["job_id"], ["job_id"], ondelete="CASCADE"
    )


def _has_trigrams() -> bool:
    """Whether PostgreSQL has the extension now."""
    try:
        with op.get_bind().begin_nested():
            op.execute("CREATE EXTENSION IF NOT EXISTS pg_trgm")
    except DBAPIError as error:
        _LOGGER.warning("runs are searched without an index: pg_trgm cannot be had (%s)", error.orig)
        return False
    return True


def _rebuilt(*, numbered: bool) -> None:
    """Copy the runs to a table with a number or without one; the tags refer to it by its name."""
    key = (
        (
            sa.PrimaryKeyConstraint("number", name="pk_run"),
            sa.UniqueConstraint("job_id", name="uq_run_job_id"),
        )
        if numbered
        else (sa.PrimaryKeyConstraint("job_id", name="pk_run"),)
    )
    op.create_table(
        "run_copy",
        *((sa.Column("number", sa.Integer(), nullable=False),) if numbered else ()),
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("project_id", sa.String(length=36), nullable=True),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("notes", sa.Text(), nullable=False),
        sa.Column("changed", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("deleted", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name="fk_run_job_id_job", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(
            ["project_id"], ["project.id"], name="fk_run_project_id_project", ondelete="SET NULL"
        ),
        *key,
    )
    op.execute(f"INSERT INTO run_copy ({_COLUMNS}) SELECT {_COLUMNS} FROM run ORDER BY job_id")
    op.drop_table("run")
    op.rename_table("run_copy", "run")
    op.create_index("ix_run_project_id_job_id", "run", ["project_id", "job_id"])
    op.create_index("ix_run_deleted_job_id", "run", ["deleted", "job_id"])
