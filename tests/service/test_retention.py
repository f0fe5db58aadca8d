"""What is old is deleted a little at a time; what others need is not."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from service_helpers import MakeSettings, new_job, stored_upload, until
from sqlalchemy import func, select, text, update

from service.cli import main
from service.client.embedded import EmbeddedService
from service.db import revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobResult, JobState, Result, RunTag, SweepArray, Upload
from service.db.repositories import JobRepository, UploadRepository
from service.db.repositories.integrity import check
from service.db.repositories.owned import Projects
from service.db.repositories.retention_repository import Pruned, RetentionRepository
from service.db.repositories.run_repository import Runs, RunWords, Shares
from service.errors import ConflictError, DatabaseError, StorageFullError
from service.jobs.outputs import JobOutput
from service.jobs.stored_figures import DesignRecord, StoredArray, SweepRecord
from service.queue.retention import Retention, prune, prune_database, prune_uploads

DAY = timedelta(days=1)


def sweep(points: int = 10) -> SweepRecord:
    values = {"scene_name": "s", "scene_hash": "0" * 64, "parameter": "frequency", "from_value": 1.0,
              "to_value": 2.0, "frequency_hz": None, "excitation_amplitude": 1.0, "harmonics": 1,
              "points": points, "peak": 1.0, "peak_at": 1.5, "limit": None, "band_hz": None,
              "newton_iterations": 1, "rejected_steps": 0, "seconds": 0.1, "completed": True,
              "status": "done"}  # fmt: skip
    return SweepRecord(**values, arrays={"parameter": StoredArray.of(np.zeros(points))})


def design() -> DesignRecord:
    return DesignRecord(
        scene_name="s", scene_hash="0" * 64, method="tracked", robust=False, reached=True, feasible=True,
        status="done", objective=1.0, peak=1.0, peak_at=1.5, limit=None, band_hz=None, harmonics=1,
        evaluations=3, work=1.0, seconds=0.1,
    )  # fmt: skip


def ended(database: Database, days: float, output: JobOutput, **values: Any) -> str:
    """A job that ended some days ago."""
    jobs = JobRepository(database)
    row, _ = jobs.submit(new_job(**values), queue_limit=100)
    if row.state is JobState.ACCEPTED:
        attempt = jobs.claim("one", utc_now() + DAY)
        assert attempt is not None
        assert jobs.succeed(attempt, output)
    with database.writing() as connection:
        connection.execute(update(Job).where(Job.id == row.id).values(finished=utc_now() - days * DAY))
    return row.id


@contextmanager
def before_a_service(url: str) -> Iterator[Database]:
    """A database with its tables while no service runs on it, whose dispatcher would take the jobs."""
    revisions.upgrade(url)
    database = Database(url)
    yield database
    database.close()


def left(database: Database) -> dict[str, int]:
    tables = {"jobs": Job, "results": JobResult, "arrays": SweepArray}
    counted = {name: select(func.count()).select_from(table) for name, table in tables.items()}
    counted |= {f"{of}s": select(func.count()).where(Result.of == of) for of in ("sweep", "design")}
    with database.reading() as connection:
        return {name: connection.execute(query).scalar_one() for name, query in counted.items()}


def before(days: float) -> datetime:
    return utc_now() - days * DAY


@pytest.mark.parametrize("keep", [True, False])
def test_old_jobs_go_with_all_they_computed(database: Database, keep: bool) -> None:
    output = JobOutput(result={}, sweeps=(sweep(), sweep()))
    for index in range(5):
        ended(database, 40.0, output, spec_hash=f"{index:064}")
    ended(database, 40.0, JobOutput(result={"optimum": 1}, sweeps=(sweep(),), design=design()))
    young = ended(database, 20.0, output)
    waiting, _ = JobRepository(database).submit(new_job(), queue_limit=10)
    expected = Pruned(jobs=5 if keep else 6, sweeps=11)
    assert RetentionRepository(database).count(before(30), keep_designs=keep) == expected
    assert prune(database, before(30), keep_designs=keep) == expected
    kept = 1 if keep else 0
    assert left(database) == {
        "jobs": 2 + kept, "results": 1 + kept, "sweeps": 2, "arrays": 2, "designs": kept
    }  # fmt: skip
    assert prune(database, before(30), keep_designs=keep) == Pruned()
    jobs = JobRepository(database)
    assert jobs.get(young) is not None
    assert jobs.get(waiting.id) is not None


@pytest.mark.parametrize("keep", [True, False])
def test_an_answer_that_a_younger_job_gives_is_kept(database: Database, keep: bool) -> None:
    output = JobOutput(result={"value": 1}, sweeps=(sweep(),))
    source = ended(database, 40.0, output, spec_hash="a" * 64)
    young = ended(database, 10.0, output, spec_hash="a" * 64, fresh=False)
    jobs = JobRepository(database)
    row = jobs.get(young)
    assert row is not None
    assert row.result_of == source
    assert prune(database, before(30), keep_designs=keep) == Pruned()
    assert jobs.result(source) == {"value": 1}
    assert prune(database, before(5), keep_designs=keep) == Pruned(jobs=2, sweeps=1)
    assert left(database)["jobs"] == 0


def test_what_lost_its_sweeps_answers_nobody(database: Database) -> None:
    found = JobOutput(result={"optimum": 1}, sweeps=(sweep(),), design=design())
    old = ended(database, 40.0, found, spec_hash="b" * 64)
    assert prune(database, before(30), keep_designs=True) == Pruned(sweeps=1)
    jobs = JobRepository(database)
    assert jobs.result(old) == {"optimum": 1}
    again, _ = jobs.submit(new_job(spec_hash="b" * 64, fresh=False), queue_limit=10)
    assert (again.state, again.result_of) == (JobState.ACCEPTED, None), "it is computed again"


@pytest.mark.few(2)
def test_no_transaction_takes_long(database: Database) -> None:
    """Megabytes of arrays, and a writer beside that never waits long."""
    heavy = JobOutput(result={}, sweeps=tuple(sweep(4000) for _ in range(40)))
    for index in range(10):
        ended(database, 40.0, heavy, spec_hash=f"{index:064}")
    took: list[float] = []
    found = prune(database, before(30), keep_designs=True, pause=lambda s: bool(took.append(s)))
    assert found == Pruned(jobs=10, sweeps=400)
    assert len(took) > 10
    assert float(np.median(took)) < 0.05


def test_a_service_deletes_what_is_old(make_settings: MakeSettings) -> None:
    with before_a_service(make_settings().database) as database:
        ended(database, 40.0, JobOutput(result={}, sweeps=(sweep(),)))
        young = ended(database, 1.0, JobOutput(result={}, sweeps=(sweep(),)))
    with EmbeddedService(make_settings(retention_days=30.0)) as service:
        until(lambda: left(service._service.database)["jobs"] == 1)
        assert service.job(young).status is JobState.SUCCESSFUL
        until(lambda: service._service.retention.pruned == Pruned(jobs=1, sweeps=1))


def uploaded(database: Database, days: float, sha256: str) -> str:
    """An upload that came some days ago."""
    said = {"owner": "", "name": "M.npz", "format": "npz", "sha256": sha256}
    row, _ = stored_upload(UploadRepository(database), b"abc", **said)
    with database.writing() as connection:
        connection.execute(update(Upload).where(Upload.id == row.id).values(created=utc_now() - days * DAY))
    return row.id


def naming(upload: str) -> dict[str, Any]:
    return {"request": {"scene": {"structure": {"M": f"upload:{upload}"}}}, "spec_hash": upload[-32:]}


def test_uploads_that_nobody_uses_go(database: Database) -> None:
    """Those that a waiting, running or young job names stay, and those that were sent again."""
    cases = ("unused", "ended", "waiting", "running", "recent", "again", "young")
    ids = {name: uploaded(database, 1.0 if name == "young" else 40.0, name) for name in cases}
    jobs = JobRepository(database)
    old, recent = (ended(database, 35.0, JobOutput(result={}), **naming(ids[n])) for n in ("ended", "recent"))
    with database.writing() as connection:
        connection.execute(update(Job).where(Job.id == old).values(created=utc_now() - 36 * DAY))
    for name in ("running", "waiting"):
        jobs.submit(new_job(**naming(ids[name])), queue_limit=10)
    assert jobs.claim("one", utc_now() + DAY) is not None
    assert uploaded(database, 0.0, "again") == ids["again"]
    assert UploadRepository(database).delete(ids["again"], before(30)) == 0
    assert prune_uploads(database, before(30)) == Pruned(uploads=2)
    uploads = UploadRepository(database)
    assert {name for name, one in ids.items() if uploads.get(one) is None} == {"unused", "ended"}
    assert prune_uploads(database, before(30)) == Pruned()
    for one in (old, recent):
        assert jobs.get(one) is not None, "jobs are another matter"


def test_a_service_deletes_old_uploads_alone(make_settings: MakeSettings) -> None:
    with before_a_service(make_settings().database) as database:
        job = ended(database, 40.0, JobOutput(result={}))
        old, young = uploaded(database, 40.0, "a"), uploaded(database, 1.0, "b")
    with EmbeddedService(make_settings(retention_upload_days=30.0)) as service:
        until(lambda: service._service.retention.pruned == Pruned(uploads=1))
        uploads = service._service.uploads.repository
        assert (uploads.get(old) is None, uploads.get(young) is None) == (True, False)
        assert service.job(job).status is JobState.SUCCESSFUL


def test_the_command(tmp_path: Path, make_settings: MakeSettings, capsys: pytest.CaptureFixture[str]) -> None:
    url = make_settings().database
    assert main(["db", "prune", "--older-than", "30d", "--database", url]) == 2
    with before_a_service(url) as database:
        for index in range(30):
            ended(database, 40.0, JobOutput(result={}, sweeps=(sweep(4000),)), spec_hash=f"{index:064}")
    with EmbeddedService(make_settings()) as service:
        assert main(["db", "prune", "--older-than", "30d", "--dry-run", "--database", url]) == 0
        assert "30 jobs, 30 sweeps and 0 uploads would be deleted" in capsys.readouterr().out
        old = uploaded(service._service.database, 40.0, "a")
        assert main(["db", "prune", "--older-than", "30d", "--uploads", "--dry-run", "--database", url]) == 0
        assert "30 sweeps and 1 uploads would be deleted" in capsys.readouterr().out
        assert main(["db", "prune", "--older-than", "30d", "--database", url]) == 1
        assert "is in use by another stickslip service" in capsys.readouterr().err
    size = (tmp_path / "jobs.db").stat().st_size
    assert main(["db", "prune", "--older-than", "30d", "--vacuum", "--json", "--database", url]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "jobs": 30, "sweeps": 30, "uploads": 0, "projects": 0, "links": 0, "deleted": True
    }  # fmt: skip
    assert main(["db", "prune", "--older-than", "30d", "--uploads", "--database", url]) == 0
    assert "0 jobs, 0 sweeps and 1 uploads are deleted" in capsys.readouterr().out
    database = Database(url)
    assert UploadRepository(database).get(old) is None
    database.close()
    assert (tmp_path / "jobs.db").stat().st_size < 0.6 * size
    assert check(url).sound
    for bad in ("30", "d", "-3d", "3 weeks", "nan d", "1e400d"):
        assert main(["db", "prune", "--older-than", bad, "--database", url]) == 2
        assert "such as 30d" in capsys.readouterr().err


def test_tables_of_another_revision_are_left_alone(database: Database) -> None:
    with database.writing() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '0001'"))
    with pytest.raises(DatabaseError, match="db upgrade"):
        prune_database(database.url, 1.0, keep_designs=True)


def test_space_of_postgresql_is_its_own_affair(cluster: Any) -> None:
    with cluster.database(empty=False) as url, pytest.raises(DatabaseError, match="autovacuum"):
        prune_database(url, 1.0, keep_designs=True, vacuum=True)


@pytest.fixture
def binned(database: Database) -> tuple[Database, dict[str, str]]:
    """A run and a design put in the bin eight days ago, a run put there today, one whose answer is in use."""
    output = JobOutput(result={}, sweeps=(sweep(),))
    found = {
        "old": ended(database, 9.0, output, spec_hash="1" * 64, words=RunWords(name="old", tags=("a",))),
        "design": ended(database, 9.0, JobOutput(result={}, sweeps=(sweep(),), design=design())),
        "young": ended(database, 9.0, output, spec_hash="2" * 64),
        "source": ended(database, 9.0, output, spec_hash="3" * 64),
    }
    found["user"] = ended(database, 9.0, output, spec_hash="3" * 64, fresh=False)
    shares = Shares(database, Runs(database, utc_now, 7.0), utc_now)
    for days in (-1.0, 1.0):
        shares.add(found["user"], days, None, most=2)
    with pytest.raises(StorageFullError):
        shares.add(found["user"], None, None, most=2)
    for name, days in (("old", 8.0), ("design", 8.0), ("young", 1.0), ("source", 8.0)):
        Runs(database, lambda days=days: utc_now() - days * DAY, 7.0).put_in_bin(found[name], None)
    return database, found


def test_what_was_in_the_bin_for_days_is_deleted_for_good(
    binned: tuple[Database, dict[str, str]], make_settings: MakeSettings
) -> None:
    database, made = binned
    projects = Projects(database, lambda: utc_now() - 8.0 * DAY, 7.0)
    project, kept = (projects.add("", name, "", most=9).id for name in ("thrown away", "kept"))
    Runs(database, utc_now, 7.0).change(made["user"], {"project": project}, None, None)
    projects.put_in_bin(project, None)
    assert RetentionRepository(database).count(before(7), keep_designs=True).projects == 1
    retention = Retention(database, make_settings(), utc_now)
    assert retention.once() == Pruned(jobs=2, sweeps=2, projects=1, links=1)
    runs = Runs(database, utc_now, 7.0)
    there = {name: runs.get(job) for name, job in made.items()}
    assert {name for name, row in there.items() if row is not None} == {"young", "source", "user"}
    assert there["user"].words.project is None, "its runs stay without it"
    assert projects.get(kept) is not None
    assert retention.once() == Pruned()
    with database.reading() as connection:
        assert connection.execute(select(func.count()).select_from(RunTag)).scalar_one() == 0


def test_a_run_whose_time_in_the_bin_is_over_is_not_restored(
    binned: tuple[Database, dict[str, str]],
) -> None:
    database, made = binned
    runs = Runs(database, utc_now, 7.0)
    with pytest.raises(ConflictError, match="in the bin for more than 7 days"):
        runs.restore(made["old"], None)
    assert runs.restore(made["young"], None).deleted is None
