"""A database that the first version wrote, brought to the revision of today by those between, works."""

import gzip
from pathlib import Path

import pytest
import sqlalchemy as sa

from service.db import revisions
from service.db.engine import database_path, is_sqlite, migrating
from service.db.models import JobState
from service.db.repositories.integrity import check
from service.queue.core import Service
from service.settings.settings import load_settings

# Two sweeps (the second answered by the first), solve, march, a design that was found and one that was not, a
# dismissed and a waiting job, a stored scene.
OLD = Path(__file__).parent.parent / "data" / "first_revision.db.gz"
TABLES = ("job", "job_result", "scene", "result", "sweep_array", "quantity", "figure")


@pytest.fixture
def old(url: str, tmp_path: Path) -> str:
    """The old database as SQLite's file, or its rows in a PostgreSQL."""
    file = database_path(url) if is_sqlite(url) else tmp_path / "old.db"
    file.write_bytes(gzip.decompress(OLD.read_bytes()))
    if not is_sqlite(url):
        revisions.upgrade(url)
        for name in TABLES:
            copy(name, f"sqlite:///{file}", url)
    return url


def copy(name: str, source: str, target: str) -> None:
    with migrating(source) as connection:
        table = sa.Table(name, sa.MetaData(), autoload_with=connection)
        rows = [dict(row) for row in connection.execute(sa.select(table)).mappings()]
    # A job that was answered by another one refers to it.
    rows.sort(key=lambda row: row.get("result_of") is not None)
    with migrating(target) as connection:
        table = sa.Table(name, sa.MetaData(), autoload_with=connection)
        connection.execute(sa.insert(table), rows)


def test_a_service_of_today_works_with_what_the_first_one_stored(old: str) -> None:
    assert revisions.upgrade(old) == revisions.head_revision()
    assert check(old).trouble == ()
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
