"""A database written by the first version, with data, goes up, down and up again on both databases.

By the revisions of before the first release, which end in the tables of today.
"""

import gzip
from pathlib import Path
from typing import Any

import earlier_revisions
import pytest
import sqlalchemy as sa
from alembic import command
from alembic.script import ScriptDirectory

from service.db import revisions
from service.db.engine import database_path, is_sqlite, migrating
from service.db.models import JobState
from service.db.repositories.integrity import check
from service.errors import DatabaseError, WrongRevisionError
from service.queue.core import Service
from service.settings.settings import load_settings

# Written by the version with revision 0001: two sweeps (the second answered by the first), solve, march, a
# design that was found and one that was not, a dismissed and a waiting job, a stored scene.
OLD = Path(__file__).parent.parent / "data" / "first_revision.db.gz"
TABLES = ("job", "job_result", "scene", "sweep", "sweep_contact", "sweep_array")
NOW = ("job", "job_result", "scene", "sweep_array", "result", "quantity", "figure")
Rows = dict[str, list[dict[str, Any]]]


@pytest.fixture
def old(url: str, tmp_path: Path, earlier: None) -> str:  # noqa: ARG001
    """The old database as SQLite's file, or its rows in a PostgreSQL of the first revision."""
    file = database_path(url) if is_sqlite(url) else tmp_path / "old.db"
    file.write_bytes(gzip.decompress(OLD.read_bytes()))
    if not is_sqlite(url):
        rows = contents(f"sqlite:///{file}")
        revisions.upgrade(url, "0001")
        with migrating(url) as connection:
            for name, found in rows.items():
                table = sa.Table(name, sa.MetaData(), autoload_with=connection)
                # A job that was answered by another one refers to it.
                found.sort(key=lambda row: row.get("result_of") is not None)
                connection.execute(sa.insert(table), found)
    return url


def contents(url: str, tables: tuple[str, ...] = TABLES) -> Rows:
    """Every row of some tables, with the columns it has now."""
    with migrating(url) as connection:
        meta = sa.MetaData()
        found = {}
        for name in tables:
            table = sa.Table(name, meta, autoload_with=connection)
            query = sa.select(table).order_by(*table.primary_key)
            found[name] = [dict(row) for row in connection.execute(query).mappings()]
    return found


def down(url: str, revision: str) -> None:
    config = revisions._config()
    with migrating(url) as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, revision)


def test_the_head_is_the_one_that_alembic_finds() -> None:
    assert revisions.head_revision() == ScriptDirectory.from_config(revisions._config()).get_current_head()


def test_an_installation_without_revisions_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(revisions, "_MIGRATIONS", tmp_path)
    with pytest.raises(DatabaseError, match="the installation is damaged"):
        revisions.head_revision()


def test_up_down_and_up_again_keeps_every_row(old: str) -> None:
    before = contents(old)
    assert {name: len(rows) for name, rows in before.items()} == {
        "job": 8, "job_result": 5, "scene": 1, "sweep": 5, "sweep_contact": 5, "sweep_array": 30,
    }  # fmt: skip
    assert revisions.upgrade(old) == revisions.head_revision()
    above = contents(old, NOW)
    for name in (*TABLES[:3], "sweep_array"):
        same = [
            {key: row[key] for key in first} for first, row in zip(before[name], above[name], strict=True)
        ]
        assert same == before[name]
    kinds = {row["id"]: row["kind"] for row in above["job"]}
    held = figures(above)
    for sweep in before["sweep"]:
        row = next(one for one in above["result"] if one["id"] == sweep["id"])
        assert {key: row[key] for key in sweep.keys() & row.keys()} == {
            key: sweep[key] for key in sweep.keys() & row.keys()
        }
        own = {name: value for (of, name, label), value in held[sweep["id"]].items() if not label}
        wanted = {name: sweep[name] for name in sweep if name not in row and sweep[name] is not None}
        assert own.pop("intermediate") == (kinds[sweep["job_id"]] == "design")
        assert held[sweep["id"]]["sweep", "parameter", wanted.pop("parameter")] == 0.0
        assert own == wanted
    for contact in before["sweep_contact"]:
        found = {name: value for (_, name, label), value in held[contact["sweep_id"]].items()
                 if label == contact["name"]}  # fmt: skip
        values = {name: value for name, value in contact.items() if isinstance(value, float)}
        assert found == values | {"contact": contact["position"]}
    others = {row["id"]: row["of"] for row in above["result"] if row["of"] not in ("sweep", "design")}
    assert sorted(others.values()) == ["march", "solve"]
    for job, of in others.items():
        [result] = [row["body"] for row in above["job_result"] if row["job_id"] == job]
        assert held[job][of, "max_abs", ""] == result["max_abs"]
    down(old, "0001")
    assert contents(old) == before
    assert revisions.upgrade(old) == revisions.head_revision()
    assert figures(contents(old, NOW)) == held
    assert check(old).trouble == ()


def test_both_ways_end_in_the_same_tables(url: str) -> None:
    revisions.upgrade(url)
    with migrating(url) as connection:
        ours = tables_of(connection)
    down(url, "base")
    with migrating(url) as connection:
        connection.exec_driver_sql("DROP TABLE alembic_version")
    with earlier_revisions.known():
        revisions.upgrade(url, "0001")
        assert revisions.upgrade(url) == revisions.head_revision()
    with migrating(url) as connection:
        assert tables_of(connection) == ours
    assert len(ours) > 150


def tables_of(connection: sa.Connection) -> set[tuple[str, ...]]:
    """Columns, keys and indexes of a database, as text; the triggers and indexes of texts too."""
    seen = sa.inspect(connection)
    found: set[tuple[str, ...]] = set()
    for table in seen.get_table_names():
        found |= {(table, each["name"], str(each["type"]), str(each["nullable"]), str(each["default"]))
                  for each in seen.get_columns(table)}  # fmt: skip
        others = (seen.get_pk_constraint(table), *seen.get_foreign_keys(table), *seen.get_indexes(table),
                  *seen.get_unique_constraints(table), *seen.get_check_constraints(table))  # fmt: skip
        # Before, SQLite's arrays referred to results by the name of the table they had been in.
        written = (str(sorted(each.items())) for each in others)
        found |= {(table, one.replace("sweep_id_sweep", "sweep_id_result")) for one in written}
    if connection.dialect.name == "sqlite":
        others = connection.exec_driver_sql("SELECT name, sql FROM sqlite_master WHERE name LIKE 'run_text%'")
    else:
        others = connection.exec_driver_sql(
            "SELECT indexname, indexdef FROM pg_indexes WHERE schemaname = 'public' "
            "UNION SELECT proname, prosrc FROM pg_proc WHERE proname = 'letters_of'"
        )
    return found | {tuple(map(str, row)) for row in others}


def test_an_earlier_database_is_told_what_to_do(url: str) -> None:
    with earlier_revisions.known():
        revisions.upgrade(url, "0012")
    told = r"0012, which was never released: bring it to 0013 with a version of its time"
    for use in (revisions.prepare, revisions.upgrade):
        with pytest.raises(WrongRevisionError, match=told):
            use(url)


def figures(rows: Rows) -> dict[str, dict[tuple[str, str, str], float]]:
    """Of each result what its figures are, and their values."""
    ids = {row["number"]: row["id"] for row in rows["result"]}
    known = {row["id"]: (row["of"], row["name"], row["label"]) for row in rows["quantity"]}
    found: dict[str, dict[tuple[str, str, str], float]] = {one: {} for one in ids.values()}
    for row in rows["figure"]:
        found[ids[row["result"]]][known[row["quantity"]]] = row["value"]
    return found


def test_a_service_of_today_works_with_what_the_first_one_stored(old: str) -> None:
    revisions.upgrade(old)
    service = Service(load_settings(database=old, workers=1))
    service.open()
    try:
        jobs = service.jobs.page(limit=100)
        states = [job.state for job in jobs]
        assert {state: states.count(state) for state in JobState} == {
            JobState.ACCEPTED: 1, JobState.RUNNING: 0, JobState.SUCCESSFUL: 5, JobState.FAILED: 1,
            JobState.DISMISSED: 1,
        }  # fmt: skip
        for job in jobs:
            if job.state is not JobState.SUCCESSFUL:
                continue
            results = service.results(job.id)
            assert results.result
            for sweep in results.sweeps:
                arrays = service.stored.arrays(sweep.id)
                assert arrays["amplitude"].array().shape == (sweep.points,)
                # Nobody knows of a sweep of that version what stands between its points.
                assert sweep.peaks_known is None
                assert sweep.error_estimate is None
        assert service.scenes.get("our-blade").body["name"] == "our-blade"
        keyed = next(job for job in jobs if job.idempotency_key == "first-sweep")
        assert keyed.owner == ""
        designs = [job for job in jobs if job.kind == "design"]
        assert {service.design(job.id).row.reached for job in designs} == {True, False}
    finally:
        service.database.close()


@pytest.mark.few(2)
def test_what_several_owners_made_is_told_apart_no_more_below_the_keys(old: str) -> None:
    """Down from 0003: of two scenes of one name, and of two jobs of one key, one keeps it."""
    revisions.upgrade(old)
    with migrating(old) as connection:
        table = sa.Table("scene", sa.MetaData(), autoload_with=connection)
        row = dict(connection.execute(sa.select(table)).mappings().one())
        connection.execute(sa.insert(table).values({**row, "owner": "alice"}))
        table = sa.Table("job", sa.MetaData(), autoload_with=connection)
        query = sa.select(table).where(table.c.idempotency_key == "first-sweep")
        row = dict(connection.execute(query).mappings().one())
        connection.execute(sa.insert(table).values({**row, "owner": "alice", "id": "zz"}))
    down(old, "0002")
    rows = contents(old)
    assert len(rows["scene"]) == 1
    keyed = [job["id"] for job in rows["job"] if job["idempotency_key"] == "first-sweep"]
    assert len(keyed) == 1
    assert keyed != ["zz"]
    assert len(rows["job"]) == 9


@pytest.mark.few(2)
def test_what_is_said_of_runs_goes_with_its_tables_and_the_runs_stay(old: str) -> None:
    revisions.upgrade(old)
    service = Service(load_settings(database=old, workers=1))
    service.open()
    try:
        job = service.jobs.page(limit=1)[0].id
        project = service.projects.add("", "old things", "").id
        words = {"name": "of old", "project": project, "tags": ("a", "b")}
        assert service.runs.change(job, words, None, None).words.tags == ("a", "b")
        service.shares.add(job, None, None)
    finally:
        service.database.close()
    assert check(old).trouble == ()
    down(old, "0005")
    assert job in {row["id"] for row in contents(old)["job"]}
    revisions.upgrade(old)
    assert check(old).trouble == ()
