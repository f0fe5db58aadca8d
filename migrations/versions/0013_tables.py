"""The tables of the first release.

Revision 0013: databases of the revisions before it were never released.
"""

from __future__ import annotations

import logging
from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.exc import DBAPIError

revision = "0013"
down_revision = None
branch_labels = None
depends_on = None

_LOGGER = logging.getLogger("stickslip.migrations")
_STATES = "'accepted', 'running', 'successful', 'failed', 'dismissed'"
_NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")  # what SQLite counts by itself
_ID = 36  # characters


def _text(name: str, length: int | None = None, **options: Any) -> sa.Column[Any]:
    kind = sa.Text() if length is None else sa.String(length)
    return sa.Column(name, kind, **{"nullable": False, **options})


def _time(name: str, **options: Any) -> sa.Column[Any]:
    return sa.Column(name, sa.DateTime(timezone=True), **{"nullable": False, **options})


def _number(name: str, kind: Any = sa.Integer, **options: Any) -> sa.Column[Any]:
    return sa.Column(name, kind, **{"nullable": False, **options})


def _json(name: str, *, nullable: bool = False) -> sa.Column[Any]:
    return sa.Column(name, sa.JSON(), nullable=nullable)


def _bytes(name: str) -> sa.Column[Any]:
    return sa.Column(name, sa.LargeBinary(), nullable=False)


def _table(name: str, key: str, *parts: Any, **options: Any) -> None:
    op.create_table(name, *parts, sa.PrimaryKeyConstraint(*key.split(), name=f"pk_{name}"), **options)


def _refers(table: str, column: str, to: str, ondelete: str | None = "CASCADE") -> sa.ForeignKeyConstraint:
    name = f"fk_{table}_{column}_{to.partition('.')[0]}"
    return sa.ForeignKeyConstraint([column], [to], name=name, ondelete=ondelete)


def _index(table: str, *columns: str) -> None:
    op.create_index(f"ix_{table}_{'_'.join(columns)}", table, list(columns))


def upgrade() -> None:
    """Make the tables."""
    _jobs()
    _results()
    _runs()
    _others()
    if op.get_bind().dialect.name == "sqlite":
        _texts_of_sqlite()
    else:
        _texts_of_postgresql()


def _jobs() -> None:
    _table(
        "job", "id",
        _text("id", _ID), _text("kind", 32), _text("state", 16), _number("priority"),
        _text("scene_name", 200, nullable=True), _text("scene_hash", 64, nullable=True),
        _text("spec_hash", 64), _text("request_hash", 64), _text("idempotency_key", 200, nullable=True),
        _number("attempt"), _number("max_attempts"), _text("lease_owner", 200, nullable=True),
        _time("lease_until", nullable=True), _number("cancel_requested", sa.Boolean),
        _number("progress", sa.Double), _number("points"), _time("created"),
        _time("started", nullable=True), _time("finished", nullable=True),
        _text("result_of", _ID, nullable=True), _json("error", nullable=True), _json("request"),
        _json("spec"), _text("owner", 100, server_default=""),
        _number("seconds_limit", sa.Double, nullable=True),
        _number("stored_bytes", sa.BigInteger, server_default="0"), _json("best", nullable=True),
        _text("trace", 64, nullable=True),
        sa.CheckConstraint("(state = 'running') = (lease_owner IS NOT NULL)", name=op.f("ck_job_lease")),
        sa.CheckConstraint("attempt >= 0 AND max_attempts >= 1", name=op.f("ck_job_attempts")),
        sa.CheckConstraint(f"state IN ({_STATES})", name=op.f("ck_job_state")),
        _refers("job", "result_of", "job.id", None),
        sa.UniqueConstraint("owner", "idempotency_key", name="uq_job_owner_idempotency_key"),
    )  # fmt: skip
    for columns in ("kind id", "owner id", "owner stored_bytes", "result_of", "scene_name id",
                    "spec_hash state owner", "state owner priority id"):  # fmt: skip
        _index("job", *columns.split())
    _table(
        "checkpoint", "job_id part",
        _text("job_id", _ID), _number("part"), _number("attempt"), _time("created"), _text("sha256", 64),
        _bytes("data"), _refers("checkpoint", "job_id", "job.id"),
    )  # fmt: skip


def _results() -> None:
    _table(
        "job_result", "job_id",
        _text("job_id", _ID), _json("body"), _text("sha256", 64, nullable=True),
        _json("figures", nullable=True), _refers("job_result", "job_id", "job.id"),
    )  # fmt: skip
    _table(
        "result", "number",
        _number("number", _NUMBER), _text("id", _ID), _text("of", 32), _number("position"),
        _text("job_id", _ID), _text("owner", 100), _text("scene_name", 200, nullable=True),
        _text("scene_hash", 64, nullable=True), _text("status"), _time("created"),
        _refers("result", "job_id", "job.id"), sa.UniqueConstraint("id", name="uq_result_id"),
    )  # fmt: skip
    _index("result", "job_id", "of")
    for column in ("", "owner ", "scene_hash ", "scene_name "):
        _index("result", *f"of {column}number".split())
    _table(
        "quantity", "id",
        _number("id"), _text("of", 32), _text("name", 200), _text("label", 500),
        sa.UniqueConstraint("of", "name", "label", name="uq_quantity_of_name_label"),
    )  # fmt: skip
    _table(
        "figure", "quantity value result",
        _number("quantity"), _number("value", sa.Double), _number("result", _NUMBER),
        _refers("figure", "quantity", "quantity.id", None), _refers("figure", "result", "result.number"),
        sqlite_with_rowid=False,
    )  # fmt: skip
    _index("figure", "result", "quantity", "value")
    _table(
        "sweep_array", "sweep_id name",
        _text("sweep_id", _ID), _text("name", 64), _text("sha256", 64), _bytes("data"),
        _number("size", sa.BigInteger, nullable=True),
        _refers("sweep_array", "sweep_id", "result.id"),
    )  # fmt: skip


def _runs() -> None:
    _table(
        "project", "id",
        _text("id", _ID), _text("owner", 100), _text("name", 200), _text("notes"), _time("created"),
        _time("changed"), _number("revision"), _time("deleted", nullable=True),
    )  # fmt: skip
    _index("project", "deleted", "id")
    _index("project", "owner", "id")
    _table(
        "run", "number",
        _number("number", _NUMBER), _text("job_id", _ID), _text("project_id", _ID, nullable=True),
        _text("name", 200), _text("notes"), _time("changed"), _number("revision"),
        _time("deleted", nullable=True), sa.UniqueConstraint("job_id", name="uq_run_job_id"),
        _refers("run", "job_id", "job.id"), _refers("run", "project_id", "project.id", "SET NULL"),
    )  # fmt: skip
    _index("run", "project_id", "job_id")
    _index("run", "deleted", "job_id")
    _table(
        "run_tag", "job_id tag",
        _text("job_id", _ID), _text("tag", 50), _refers("run_tag", "job_id", "run.job_id"),
    )  # fmt: skip
    _index("run_tag", "tag", "job_id")
    _table(
        "share", "id",
        _text("id", _ID), _text("job_id", _ID), _text("digest", 64), _time("created"),
        _time("expires", nullable=True), _refers("share", "job_id", "job.id"),
    )  # fmt: skip
    _index("share", "expires", "id")
    _index("share", "job_id", "id")


def _others() -> None:
    _table(
        "scene", "owner name",
        _text("name", 200), _text("scene_hash", 64), _time("created"), _json("body"),
        _text("owner", 100, server_default=""), _number("size", sa.BigInteger, server_default="0"),
    )  # fmt: skip
    _table(
        "api_key", "id",
        _text("id", _ID), _text("owner", 100), _json("scopes"), _text("digest", 64), _json("limits"),
        _time("created"), _time("expires", nullable=True), _time("revoked", nullable=True),
        _time("last_used", nullable=True),
    )  # fmt: skip
    _index("api_key", "owner", "id")
    _table(
        "upload", "id",
        _text("id", _ID), _text("owner", 100), _text("name", 200), _text("format", 32),
        _number("size", sa.BigInteger), _text("sha256", 64), _time("created"),
    )  # fmt: skip
    _index("upload", "owner", "id")
    # What pieces belong to is written after them: they refer to nothing.
    _table("upload_piece", "upload_id position", _text("upload_id", _ID), _number("position"), _bytes("data"))


def _texts_of_sqlite() -> None:
    """An index of triples of letters of names and notes, which triggers keep.

    Two characters more stand after each text, which no text has, so that every letter begins a triple: a
    piece of one or two letters is the beginning of a word of its vocabulary.
    """
    op.execute("CREATE VIRTUAL TABLE run_text USING fts5 (name, notes, content='', tokenize='trigram')")
    op.execute("CREATE VIRTUAL TABLE run_text_letters USING fts5vocab(run_text, 'instance')")
    end, columns = " || char(31, 31)", "rowid, name, notes"
    gone, new = (f"{row}.number, {row}.name{end}, {row}.notes{end}" for row in ("old", "new"))
    gone = f"INSERT INTO run_text (run_text, {columns}) VALUES ('delete', {gone})"
    new = f"INSERT INTO run_text ({columns}) VALUES ({new})"
    for name, when, does in (
        ("insert", "INSERT", (new,)),
        ("delete", "DELETE", (gone,)),
        ("update", "UPDATE OF name, notes", (gone, new)),
    ):
        op.execute(f"CREATE TRIGGER run_text_{name} AFTER {when} ON run BEGIN {'; '.join(does)}; END")


def _texts_of_postgresql() -> None:
    """Indexes of triples of letters, where `pg_trgm` can be had, and of letters and pairs of them."""
    try:
        with op.get_bind().begin_nested():
            op.execute("CREATE EXTENSION IF NOT EXISTS pg_trgm")
    except DBAPIError as error:
        _LOGGER.warning("runs are searched without an index: pg_trgm cannot be had (%s)", error.orig)
    else:
        trigrams = "(name gin_trgm_ops, notes gin_trgm_ops)"
        op.execute(f"CREATE INDEX ix_run_text ON run USING gin {trigrams} WITH (fastupdate = off)")
    op.execute("""
        CREATE FUNCTION letters_of(name text, notes text) RETURNS text[]
        LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE COST 10000 AS $$
            DECLARE letters text[] := string_to_array(lower(name || chr(31) || notes), NULL);
            BEGIN
                RETURN letters || ARRAY(
                    SELECT one || coalesce(next, '') FROM unnest(letters, letters[2:]) AS pairs (one, next));
            END
        $$
    """)
    index = "CREATE INDEX ix_run_letters ON run USING gin (letters_of(name, notes))"
    op.execute(f"{index} WITH (fastupdate = off)")


def downgrade() -> None:
    """Take them away."""
    sqlite = op.get_bind().dialect.name == "sqlite"
    gone = "share run_tag run project sweep_array figure quantity result job_result checkpoint job scene"
    for name in (*(["run_text_letters", "run_text"] if sqlite else []), *gone.split(), "api_key", "upload",
                 "upload_piece"):  # fmt: skip
        op.drop_table(name)
    if not sqlite:
        op.execute("DROP FUNCTION letters_of")
