"""The database: its transactions, its lock, its revisions."""

import sqlite3
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, timedelta
from pathlib import Path

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from private_kinds import PRIVATE
from service_helpers import PATIENCE, MakeSettings, new_job
from sqlalchemy import CheckConstraint, insert, inspect, select, text
from sqlalchemy.exc import DBAPIError, StatementError

from service.client.embedded import EmbeddedService
from service.db import revisions
from service.db.clock import new_id, utc_now
from service.db.engine import Database, backup, is_sqlite, migrating, sqlite_note, write_engine
from service.db.models import NOBODY, Job, JobState, TableBase
from service.db.repositories import Attempt, JobRepository, SceneRepository
from service.errors import DatabaseError, DatabaseInUseError, WrongRevisionError
from service.jobs.outputs import FailureKind, JobFailure, JobOutput
from service.jobs.stored_figures import StoredArray
from service.queue.core import Service


@pytest.fixture
def file_url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path}/jobs.db"


def claimed(jobs: JobRepository, owner: str = "one") -> Attempt:
    jobs.submit(new_job(), queue_limit=10)
    attempt = jobs.claim(owner, utc_now())
    assert attempt is not None
    return attempt


def test_read_modify_writes_of_four_processes_lose_nothing(file_url: str) -> None:
    engine = write_engine(file_url)
    with engine.begin() as connection:
        connection.execute(text("CREATE TABLE counter (number INTEGER NOT NULL)"))
        connection.execute(text("INSERT INTO counter VALUES (0)"))
    script = Path(__file__).with_name("counting.py")
    running = [subprocess.Popen([sys.executable, str(script), file_url, "300"]) for _ in range(4)]
    assert [process.wait(PATIENCE) for process in running] == [0, 0, 0, 0]
    with engine.begin() as connection:
        assert connection.execute(text("SELECT number FROM counter")).scalar_one() == 1200
    engine.dispose()


def test_connections_are_set_up(file_url: str) -> None:
    database = Database(file_url)
    with database.writing() as connection:
        pragmas = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    assert pragmas == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1, "busy_timeout": 30_000}
    database.close()


def test_readers_cannot_write(database: Database) -> None:
    with pytest.raises(DBAPIError, match=r"read-?only"), database.reading() as connection:
        connection.execute(text("DELETE FROM job"))


def test_a_reader_sees_one_snapshot(database: Database) -> None:
    jobs = JobRepository(database)
    with database.reading() as connection:
        before = connection.execute(select(Job.id)).all()
        jobs.submit(new_job(), queue_limit=10)
        assert connection.execute(select(Job.id)).all() == before == []
    assert len(jobs.page()) == 1


def test_a_failed_transaction_writes_nothing(database: Database) -> None:
    jobs = JobRepository(database)
    attempt = claimed(jobs)
    with pytest.raises((StatementError, TypeError), match="not JSON serializable"):
        jobs.succeed(attempt, JobOutput(result={"not JSON": object()}))
    row = jobs.get(attempt.job_id)
    assert row is not None
    assert row.state is JobState.RUNNING
    assert jobs.succeed(attempt, JobOutput(result={})), "the attempt still owns the job"


def test_every_state_can_be_stored(database: Database) -> None:
    for state in JobState:
        with database.writing() as connection:
            connection.execute(
                insert(Job).values(
                    id=new_id(),
                    kind="iteration",
                    state=state,
                    spec_hash="",
                    request_hash="",
                    max_attempts=1,
                    created=utc_now(),
                    request={},
                    spec={},
                    lease_owner="me" if state is JobState.RUNNING else None,
                )
            )
        assert JobRepository(database).count()[state] == 1


def test_every_failure_can_be_stored(database: Database) -> None:
    jobs = JobRepository(database)
    for kind in FailureKind:
        attempt = claimed(jobs)
        assert jobs.fail(attempt, JobFailure(kind=kind, detail="why"))
        row = jobs.get(attempt.job_id)
        assert row is not None
        assert row.error == {"type": kind.value, "detail": "why"}


def test_who_lost_the_lease_writes_nothing(database: Database) -> None:
    jobs = JobRepository(database)
    ways: dict[str, Callable[[Attempt], object]] = {
        "succeed": lambda lost: jobs.succeed(lost, JobOutput(result={"wrong": True})),
        "fail": lambda lost: jobs.fail(lost, JobFailure(kind=FailureKind.GOAL, detail="wrong")),
        "release": jobs.release,
        "dismiss": jobs.dismiss,
        "report": lambda lost: jobs.report(lost, 0.5, 10, utc_now()),
        "renew": lambda lost: jobs.renew([lost], utc_now()) != [lost],
        "lose": lambda lost: jobs.lose(lost, "wrong").total > 0,
    }
    for way, write in ways.items():
        lost = claimed(jobs)
        assert jobs.recover_expired().accepted == 1
        holder = jobs.claim("two", utc_now())
        assert holder is not None
        assert (holder.job_id, holder.attempt) == (lost.job_id, 2)
        before = jobs.get(lost.job_id)
        assert not write(lost), way
        assert jobs.get(lost.job_id) == before, way
        assert jobs.result(lost.job_id) is None, way
        assert jobs.succeed(holder, JobOutput(result={"right": True}))
        assert jobs.result(lost.job_id) == {"right": True}


def test_a_cancel_that_was_asked_for_wins_over_a_result(database: Database) -> None:
    jobs = JobRepository(database)
    attempt = claimed(jobs)
    jobs.cancel(attempt.job_id)
    assert not jobs.succeed(attempt, JobOutput(result={}))
    assert jobs.dismiss(attempt)


def test_what_a_dead_owner_left(database: Database) -> None:
    """On SQLite everything that others left; on PostgreSQL others may live, and a lease has to run out."""
    jobs = JobRepository(database)
    attempts = [claimed(jobs, "dead") for _ in range(2)]
    jobs.cancel(attempts[0].job_id)
    mine = claimed(jobs, "me")
    jobs.renew([mine], utc_now() + timedelta(hours=1))
    recovered = jobs.recover_abandoned("me")
    assert (recovered.accepted, recovered.failed, recovered.dismissed) == (1, 0, 1)
    row = jobs.get(mine.job_id)
    assert row is not None
    assert row.state is JobState.RUNNING
    for _ in range(2):
        assert jobs.claim("dead", utc_now()) is not None
        recovered = jobs.recover_abandoned("me")
    assert recovered.failed == 1
    row = jobs.get(attempts[1].job_id)
    assert row is not None
    assert row.error is not None
    why = "the service ended while the job ran" if database.exclusive else "its owner gave no sign of life"
    assert f"{why}, in attempt 3 of 3" in row.error["detail"]


def test_a_job_with_a_lease_is_its_owners_where_several_services_may_run(database: Database) -> None:
    jobs = JobRepository(database)
    attempt = claimed(jobs, "other")
    jobs.renew([attempt], utc_now() + timedelta(hours=1))
    assert jobs.recover_expired().total == 0
    assert jobs.recover_abandoned("me").total == (1 if database.exclusive else 0)


def test_an_owner_finds_what_was_cancelled_elsewhere(database: Database) -> None:
    jobs = JobRepository(database)
    mine, other = claimed(jobs, "me"), claimed(jobs, "other")
    assert jobs.cancelled("me") == set()
    for attempt in (mine, other):
        jobs.cancel(attempt.job_id)
    assert jobs.cancelled("me") == {mine.job_id}


def test_a_key_and_a_name_used_by_several_threads_make_one_row(database: Database) -> None:
    jobs, scenes = JobRepository(database), SceneRepository(database)
    job = new_job(idempotency_key="one")
    with ThreadPoolExecutor(8) as threads:
        made = list(threads.map(lambda _: jobs.submit(job, queue_limit=100), range(16)))
        stored = list(threads.map(lambda _: scenes.add(NOBODY, "mine", "0" * 64, {}), range(16)))
    assert len({row.id for row, _ in made}) == 1
    assert [new for _, new in made].count(True) == [new for _, new in stored].count(True) == 1


def test_a_second_service_is_refused(make_settings: MakeSettings) -> None:
    settings = make_settings()
    with EmbeddedService(settings, PRIVATE) as service:
        with pytest.raises(DatabaseInUseError, match=r"in use by another stickslip service \(process \d+\)"):
            Service(settings, PRIVATE).start()
        code = (
            "from service.queue.core import Service; from service.settings.settings import load_settings; "
            f"Service(load_settings(database={settings.database!r})).open()"
        )
        other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert other.returncode == 1
        assert "DatabaseInUseError" in other.stderr
        with pytest.raises(DatabaseInUseError):
            revisions.upgrade(settings.database)
        done = service.wait(service.submit("iteration", {}), timeout=PATIENCE)
        assert done.status is JobState.SUCCESSFUL
    with EmbeddedService(settings, PRIVATE) as service:
        assert service.job(done.id).status is JobState.SUCCESSFUL


@pytest.mark.usefixtures("earlier")
def test_the_first_revision_upgraded_is_the_models(url: str) -> None:
    revisions.upgrade(url, "0001")
    revisions.upgrade(url)
    with migrating(url) as connection:
        # The tables of the index of texts are SQLite's own.
        options = {
            "compare_type": True,
            "include_name": lambda name, *_: not str(name).startswith("run_text"),
        }
        context = MigrationContext.configure(connection, opts=options)
        differences = compare_metadata(context, TableBase.metadata)
        of_texts = ("ix_run_text", "ix_run_letters")
        assert [one for one in differences if one[0] != "remove_index" or one[1].name not in of_texts] == []
        found = inspect(connection)
        tables = {one for one in found.get_table_names() if not one.startswith("run_text")}
        assert tables == {*TableBase.metadata.tables, "alembic_version"}
        for table in TableBase.metadata.tables.values():
            named = {check["name"] for check in found.get_check_constraints(table.name)}
            assert named == {c.name for c in table.constraints if isinstance(c, CheckConstraint)}


@pytest.mark.usefixtures("earlier")
def test_an_old_database_keeps_its_rows(url: str) -> None:
    revisions.upgrade(url, "0001")
    zone = "" if is_sqlite(url) else "+00"
    with migrating(url) as connection:
        connection.execute(
            text(
                "INSERT INTO job (id, kind, state, priority, spec_hash, request_hash, attempt, max_attempts, "
                "cancel_requested, progress, points, created, request, spec) VALUES ('a', 'iteration', "
                f"'accepted', 0, '', '', 0, 3, false, 0.0, 0, '2026-01-02 03:04:05.000000{zone}', "
                "'{}', '{}')"
            )
        )
    assert revisions.upgrade(url) == revisions.head_revision()
    database = Database(url)
    row = JobRepository(database).get("a")
    database.close()
    assert row is not None
    assert row.created.isoformat() == "2026-01-02T03:04:05+00:00"


def test_a_time_is_the_same_before_and_after(database: Database) -> None:
    jobs = JobRepository(database)
    begin = jobs.now()
    row, _ = jobs.submit(new_job(), queue_limit=10)
    again = jobs.get(row.id)
    assert again is not None
    assert begin <= again.created == row.created <= jobs.now()
    assert again.created.tzinfo is UTC
    assert [found.id for found in JobRepository(database).page()] == [row.id]


def test_a_wrong_revision_is_refused_with_the_command(url: str) -> None:
    revisions.upgrade(url)
    for revision, words in (("0000", "written by a newer"), (None, "another program")):
        with migrating(url) as connection:
            connection.execute(text("DELETE FROM alembic_version"))
            if revision is not None:
                connection.execute(text("INSERT INTO alembic_version VALUES (:r)"), {"r": revision})
        with pytest.raises(DatabaseError, match=words):
            revisions.prepare(url)
        with pytest.raises(DatabaseError, match=words):
            revisions.upgrade(url)


def test_an_older_revision_is_refused_with_the_command(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    revisions.upgrade(url)
    monkeypatch.setattr(revisions, "head_revision", lambda: "9999")
    with pytest.raises(WrongRevisionError, match=r"run `stickslip db upgrade --database (sqlite|postgresql)"):
        revisions.prepare(url)


def test_a_file_that_cannot_be_used(tmp_path: Path, make_settings: MakeSettings) -> None:
    with pytest.raises(DatabaseError, match="cannot use"):
        Service(make_settings(database=f"sqlite:///{tmp_path}/missing/jobs.db"), PRIVATE).open()
    with pytest.raises(DatabaseError, match="no folder"):
        revisions.upgrade(f"sqlite:///{tmp_path}/missing/jobs.db")
    (tmp_path / "text.db").write_text("this is no database " * 100)
    with pytest.raises(DatabaseError, match="not a database"):
        Service(make_settings(database=f"sqlite:///{tmp_path}/text.db"), PRIVATE).open()


def test_a_backup_is_a_database(file_url: str, tmp_path: Path) -> None:
    revisions.upgrade(file_url)
    database = Database(file_url)
    claimed(JobRepository(database))
    backup(file_url, tmp_path / "copy.db")
    copy = Database(f"sqlite:///{tmp_path}/copy.db")
    assert len(JobRepository(copy).page()) == 1
    copy.close()
    with pytest.raises(DatabaseError, match="does not overwrite"):
        backup(file_url, tmp_path / "copy.db")
    database.close()
    with pytest.raises(DatabaseError, match="no database"):
        backup(f"sqlite:///{tmp_path}/none.db", tmp_path / "other.db")
    with pytest.raises(DatabaseError, match=r"u:\*\*\*@localhost/x is backed up with .* pg_dump"):
        backup("postgresql+psycopg://u:secret@localhost/x", tmp_path / "other.db")


def test_arrays_are_numbers_with_a_checksum() -> None:
    array = np.arange(6.0).reshape(2, 3)
    stored = StoredArray.of(array)
    np.testing.assert_array_equal(stored.array(), array)
    with pytest.raises(DatabaseError, match="checksum"):
        StoredArray(sha256=stored.sha256, data=stored.data[:-1] + b"x").array()
    with pytest.raises(ValueError, match="Object arrays"):
        StoredArray.of(np.array([object()]))


def test_ids_sort_by_the_order_they_were_made() -> None:
    ids = [new_id() for _ in range(5000)]
    assert ids == sorted(set(ids))
    assert {(value[14], value[19] in "89ab") for value in ids} == {("7", True)}


def test_the_bug_of_old_sqlite_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite3, "sqlite_version_info", (3, 51, 3))
    assert sqlite_note() is None
    monkeypatch.setattr(sqlite3, "sqlite_version_info", (3, 51, 2))
    assert "3.51.3" in str(sqlite_note())
