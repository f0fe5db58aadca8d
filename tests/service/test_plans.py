"""The busy statements stay quick in a long table: SQLite, which plans without counts, goes by their index."""

from pathlib import Path

from each import each
from service_helpers import with_tables
from sqlalchemy import Select, Update
from sqlalchemy.dialects import sqlite

from service.db.engine import Database
from service.db.repositories import attempts, owned, waiting

BY_KEY = "sqlite_autoindex_job_1"


@each(
    ("statement", "index"),
    [
        (attempts.COMPUTED_BEFORE, "ix_job_spec_hash_state"),
        (waiting.WAITING_OWNERS, "ix_job_state_owner_priority_id"),
        (waiting.NEXT_PRIORITY, "ix_job_state_owner_priority_id"),
        (waiting.NEXT_JOBS, "ix_job_state_owner_priority_id"),
        (owned.OF_JOBS, "ix_job_owner_stored_bytes"),
        (attempts.TAKE, BY_KEY),
        (attempts.REPORT, BY_KEY),
        (attempts.SUCCEED, BY_KEY),
        (attempts.BY_ID, BY_KEY),
    ],
)
def test_it_goes_by_its_index(tmp_path: Path, statement: Select[tuple[object]] | Update, index: str) -> None:
    compiled = statement.compile(dialect=sqlite.dialect())
    values = tuple(None for _ in compiled.positiontup or ())
    database = Database(with_tables(tmp_path))
    try:
        with database.reading() as connection:
            rows = connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {compiled}", values).all()
    finally:
        database.close()
    plan = [str(row[-1]) for row in rows]
    assert any(index in step for step in plan), plan
    assert not any(step.startswith("SCAN job") for step in plan), plan
