"""Several dispatchers and several services on one PostgreSQL database."""

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import psycopg
import pytest
from launch import free_port
from postgresql_cluster import Cluster, binaries
from private_kinds import PRIVATE
from service_helpers import PATIENCE, pids, settings_of, until
from sqlalchemy import ColumnElement, column, func, make_url, select, text, update

from service.auth.callers import KEYLESS
from service.cli import main
from service.client.client import Client
from service.db import postgresql, revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobState
from service.db.repositories import JobRepository, NewJob
from service.errors import DatabaseError, DatabaseInUseError, ServiceProblem
from service.http.routes.events import job_events
from service.jobs.outputs import JobOutput
from service.queue.core import Service
from service.queue.health import check
from service.schemas.answers import JobPoints, JobProgress

SCRIPT = Path(__file__).with_name("serve_private.py")
NEW = NewJob(kind="iteration", request={}, spec={}, spec_hash="", request_hash="", max_attempts=3, fresh=True)


@pytest.fixture
def empty(cluster: Cluster) -> Iterator[str]:
    """A PostgreSQL database without tables."""
    with cluster.database() as url:
        yield url


@pytest.fixture
def url(cluster: Cluster) -> Iterator[str]:
    """A PostgreSQL database with its tables."""
    with cluster.database(empty=False) as url:
        yield url


def test_two_dispatchers_take_each_job_once(url: str) -> None:
    databases = [Database(url) for _ in range(2)]
    for _ in range(120):
        JobRepository(databases[0]).submit(NEW, queue_limit=1000)

    def work(number: int) -> list[str]:
        jobs, owner, done = JobRepository(databases[number % 2]), f"dispatcher {number}", []
        while (attempt := jobs.claim(owner, utc_now())) is not None:
            assert jobs.succeed(attempt, JobOutput(result={"by": owner}))
            done.append(attempt.job_id)
        return done

    with ThreadPoolExecutor(4) as threads:
        done = [job for found in threads.map(work, range(4)) for job in found]
    assert len(done) == len(set(done)) == 120
    counts = JobRepository(databases[0]).count()
    assert counts[JobState.SUCCESSFUL] == 120
    for database in databases:
        database.close()


def test_renewing_leases_waits_for_nobody_who_changes_a_row(url: str) -> None:
    """It would be a deadlock with a transaction that waits for a lease renewed before."""
    database = Database(url)
    jobs = JobRepository(database)
    for _ in range(3):
        jobs.submit(NEW, queue_limit=10)
    attempts = jobs.claim_several("me", utc_now(), 3)
    later = utc_now() + timedelta(hours=1)
    until = select(Job.lease_until).order_by(Job.id)
    with database.writing() as changing:
        changing.execute(select(Job.id).where(Job.id == attempts[1].job_id).with_for_update())
        with ThreadPoolExecutor(1) as thread:
            assert thread.submit(jobs.renew, attempts, later).result(timeout=PATIENCE) == []
        changing.execute(text("SET LOCAL lock_timeout = '20s'"))
        assert [found == later for found in changing.execute(until).scalars()] == [True, False, True]
        changing.execute(update(Job).where(Job.id == attempts[0].job_id).values(points=1))
    assert jobs.succeed(attempts[2], JobOutput(result={}))
    assert jobs.renew(attempts, later) == [attempts[2]]
    database.close()


def test_a_dispatcher_passes_by_what_another_one_is_taking(url: str) -> None:
    database = Database(url)
    jobs = JobRepository(database)
    first, second = (jobs.submit(NEW, queue_limit=10)[0].id for _ in range(2))
    with database.writing() as taking:
        taking.execute(select(Job.id).where(Job.id == first).with_for_update())
        attempt = jobs.claim("me", utc_now())
        assert attempt is not None
        assert attempt.job_id == second
        assert jobs.claim("me", utc_now()) is None
        assert jobs.recover_expired().accepted == 1, "a lock on one job holds up no other"
    claimed = jobs.claim("me", utc_now())
    assert claimed is not None
    assert claimed.job_id == first
    database.close()


def test_of_services_that_start_on_an_empty_database_one_makes_the_tables(empty: str) -> None:
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(revisions.prepare, [empty] * 4))
    assert revisions.current_revision(empty) == revisions.head_revision()


def test_tables_do_not_change_under_a_service(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    database = Database(url)
    database.version()
    with pytest.raises(DatabaseInUseError, match=r":\*\*\*@.* is in use by running stickslip services"):
        revisions.upgrade(url)
    database.close()
    assert main(["db", "upgrade", "--database", url]) == 0
    printed = capsys.readouterr().out
    assert f"is at revision {revisions.head_revision()}" in printed
    assert ":***@" in printed, "no password is printed"


def test_a_database_can_be_checked_in_use(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    database = Database(url)
    jobs = JobRepository(database)
    jobs.submit(NEW, queue_limit=10)
    assert main(["db", "check", "--database", url]) == 0
    attempt = jobs.claim("me", utc_now())
    assert attempt is not None
    assert jobs.succeed(attempt, JobOutput(result={}))
    with database.writing() as connection:
        connection.execute(text("DELETE FROM job_result"))
    assert main(["db", "check", "--database", url]) == 1
    assert "1 successful jobs without a result" in capsys.readouterr().out
    database.close()


def test_an_old_server_is_refused(empty: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(postgresql, "OLDEST", 99)
    with pytest.raises(DatabaseError, match=r"needs PostgreSQL 99 or newer, the server is \d+"):
        revisions.prepare(empty)


def test_a_server_that_cannot_be_reached_is_told_without_the_password() -> None:
    url = "postgresql+psycopg://me:hidden@127.0.0.1:9/jobs"
    with pytest.raises(DatabaseError, match=r"cannot be used: .*refused") as told:
        Service(settings_of(url)(), PRIVATE).open()
    assert "hidden" not in str(told.value)


def test_without_the_driver_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(DatabaseError, match=r"install stickslip\[postgresql\]"):
        Database("postgresql+psycopg://localhost/jobs")


def test_a_server_that_restarts_is_found_again(cluster: Cluster, url: str) -> None:
    database = Database(url)
    jobs = JobRepository(database)
    job, _ = jobs.submit(NEW, queue_limit=10)
    attempt = jobs.claim("me", utc_now())
    assert attempt is not None
    cluster.stop()
    cluster.start()
    assert jobs.succeed(attempt, JobOutput(result={"after": "the restart"}))
    assert jobs.result(job.id) == {"after": "the restart"}
    with pytest.raises(DatabaseInUseError):
        revisions.upgrade(url)
    database.close()


def test_a_connection_that_the_server_ended_while_it_lay_idle_is_replaced(url: str) -> None:
    """Its next use finds that the server said something, and asks for another one."""
    with closing(Database(url, connections=1)) as database, closing(Database(url)) as other:
        jobs = JobRepository(database)
        mine = text("datname = current_database() AND pid <> pg_backend_pid()")

        def asked(what: ColumnElement[Any]) -> list[Any]:
            query = select(what).select_from(text("pg_stat_activity")).where(mine)
            with other.writing() as connection:
                return list(connection.execute(query).scalars())

        for read in (partial(jobs.get, "none"), jobs.page):
            assert not read()
            assert True in asked(func.pg_terminate_backend(column("pid")))
            until(lambda: not asked(column("pid")))  # to be told to end is not to have ended
            assert not read()


def test_lists_are_planned_with_their_values_and_look_ups_once(url: str) -> None:
    """What the server has prepared may be planned for anybody: look-ups, and never a page of a list."""
    with closing(Database(url, connections=1)) as database:
        jobs = JobRepository(database)
        for _ in range(10):
            assert not jobs.page(owner="somebody")
            assert jobs.get("none") is None
        with database.reading() as connection:
            prepared = (
                connection.execute(text("SELECT statement FROM pg_prepared_statements")).scalars().all()
            )
    assert any("FROM job" in one for one in prepared)
    assert not any("ORDER BY job.id DESC" in one for one in prepared)


def test_two_services_in_one_process_share_the_jobs(url: str) -> None:
    with ExitStack() as stack:
        services = [Service(settings_of(url)(poll_seconds=0.2), PRIVATE) for _ in range(2)]
        for service in services:
            service.start()
            stack.callback(service.stop)
        one, other = services
        until(lambda: all(service.queue.status().ready for service in services))
        assert (check(one).database, check(one).ready) == ("postgresql", True)
        bodies = [{"kind": "iteration", "seconds": 0.4, "seed": seed} for seed in range(6)]
        jobs = [one.submit(body)[0].id for body in bodies]
        until(lambda: all(service.queue.status().busy for service in services))
        done = [other.wait(job, PATIENCE) for job in jobs]
        assert [(row.state, row.attempt) for row in done] == [(JobState.SUCCESSFUL, 1)] * 6
        long = one.submit({"kind": "iteration", "seconds": 600.0})[0].id
        until(lambda: one.job(long).state is JobState.RUNNING)
        away = next(service for service in services if service.queue.live(long) is None)
        away.dismiss(long)
        assert away.wait(long, PATIENCE).state is JobState.DISMISSED, "wherever it runs"


def test_who_watches_at_one_service_gets_the_points_that_another_finds(url: str) -> None:
    """Each once and in order, with the best design, long before its row has it; of others nothing is told."""
    with ExitStack() as stack:
        services = [Service(settings_of(url)(poll_seconds=0.2), PRIVATE) for _ in "ab"]
        for service in services:
            service.start()
            stack.callback(service.stop)
        until(lambda: all(service.queue.status().ready for service in services))
        body = {"kind": "iteration", "seconds": 600.0, "tells": True}
        job = services[0].submit(body)[0].id
        until(lambda: any(service.queue.live(job) for service in services))
        runs, away = sorted(services, key=lambda service: service.queue.live(job) is None)
        assert runs._elsewhere is not None
        assert runs._elsewhere._watched == {}, "nobody watches elsewhere"
        until(lambda: (live := runs.queue.live(job)) is not None and len(live.found) > 250)

        async def watched() -> tuple[list[tuple[float, float]], list[JobProgress]]:
            points: list[tuple[float, float]] = []
            progress: list[JobProgress] = []
            async for event in job_events(away, job, KEYLESS):
                if isinstance(event.data, JobPoints):
                    assert event.data.start == len(points)
                    points += event.data.points
                elif isinstance(event.data, JobProgress):
                    progress.append(event.data)
                if len(points) > 600:
                    break
            return points, progress

        points, progress = asyncio.run(asyncio.wait_for(watched(), 60.0))
        live = runs.queue.live(job)
        assert live is not None
        assert points == list(live.found)[: len(points)]
        assert progress[-1].best is not None
        assert progress[-1].best["values"]["step"] > 250
        runs.dismiss(job)
        until(lambda: runs._elsewhere is not None and not runs._elsewhere._watched)


Start = Callable[[], "tuple[subprocess.Popen[bytes], Client]"]


@pytest.fixture
def start(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Starts services as processes; what they log is shown if the test fails."""
    monkeypatch.setenv("STICKSLIP_LEASE_SECONDS", "2")
    monkeypatch.setenv("STICKSLIP_POLL_SECONDS", "0.2")
    log = tmp_path / "log"
    with ExitStack() as stack:

        def begin() -> tuple[subprocess.Popen[bytes], Client]:
            port = free_port()
            with log.open("ab") as stderr:
                process = subprocess.Popen([sys.executable, str(SCRIPT), url, str(port)], stderr=stderr)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process, stack.enter_context(Client(f"http://127.0.0.1:{port}"))

        yield begin
    sys.stderr.write(log.read_text())


def answers(client: Client) -> bool:
    try:
        list(client.sweeps(limit=1))
    except ServiceProblem:
        return False
    return True


@pytest.mark.long
def test_the_jobs_of_a_killed_service_are_done_by_another(tmp_path: Path, start: Start) -> None:
    file = tmp_path / "pids"
    running = [start() for _ in range(2)]
    for _, client in running:
        until(lambda client=client: answers(client))
    (killed, first), (process, second) = running
    specs = [{"kind": "iteration", "seconds": 0.8, "seed": n, "pid_file": str(file)} for n in range(8)]
    jobs = [first.submit(spec).id for spec in specs]
    until(lambda: len(pids(file)) >= 4)
    os.kill(killed.pid, signal.SIGKILL)
    done = [second.wait(job, timeout=PATIENCE) for job in jobs]
    assert [job.status for job in done] == [JobState.SUCCESSFUL] * 8
    assert max(job.attempt for job in done) == 2
    assert sum(job.attempt for job in done) == len(pids(file)), "each attempt is counted, none is made twice"
    process.terminate()
    assert process.wait(PATIENCE) == 0


@pytest.mark.long
def test_names_that_cannot_be_stored_are_refused(start: Start) -> None:
    _, client = start()
    until(lambda: answers(client))
    with pytest.raises(ServiceProblem) as refused:
        client.job("a\0b")
    assert refused.value.status == 422
    with pytest.raises(ServiceProblem) as refused:
        list(client.sweeps(scene="a\0b"))
    assert refused.value.status == 422


def test_services_tell_each_other_without_polling(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new job, the end of one and a cancel reach another service long before it would look by itself."""
    monkeypatch.setattr("service.queue.core._LOOK_AGAIN_SECONDS", 60.0)
    with ExitStack() as stack:
        services = [Service(settings_of(url)(poll_seconds=60.0, lease_seconds=300.0), PRIVATE) for _ in "ab"]
        for service in services:
            service.start()
            stack.callback(service.stop)
        one, other = services
        until(lambda: all(service.queue.status().ready for service in services))
        bodies = [{"kind": "iteration", "seconds": seconds, "seed": 1} for seconds in (599.0, 600.0)]
        long = [one.submit(body)[0].id for body in bodies]
        until(lambda: all(service.queue.status().busy for service in services))
        away = next(job for job in long if one.queue.live(job) is None)
        one.dismiss(away)
        assert one.wait(away, 30.0).state is JobState.DISMISSED
        here = next(job for job in long if job != away)
        job = one.submit({"kind": "iteration", "seconds": 0.2, "seed": 2})[0].id
        assert one.wait(job, 30.0).state is JobState.SUCCESSFUL
        assert not other.queue.status().busy
        one.dismiss(here)


def test_the_drill_of_deploy_restores_a_backup(cluster: Cluster, tmp_path: Path) -> None:
    """It dumps, restores beside, checks and drops; a database that is damaged ends it with what is wrong."""
    programs, command = binaries(), Path(sys.executable).parent
    assert programs is not None
    drill = Path(__file__).resolve().parents[2] / "deploy" / "restore-drill.sh"
    with cluster.database(empty=False) as url:
        parts = make_url(url)
        environment = {
            **os.environ, "PATH": os.pathsep.join([str(command), str(programs), os.environ["PATH"]]),
            "PGHOST": str(parts.host), "PGPORT": str(parts.port), "PGUSER": str(parts.username),
            "PGPASSWORD": str(parts.password),
        }  # fmt: skip
        dump = tmp_path / "backup.dump"

        def drilled() -> subprocess.CompletedProcess[str]:
            words = ["sh", str(drill), str(parts.database), str(dump)]
            return subprocess.run(words, env=environment, capture_output=True, text=True, check=False)

        done = drilled()
        assert done.returncode == 0, done.stderr
        assert "checked" in done.stdout
        assert dump.stat().st_size > 1000
        with psycopg.connect(cluster.conninfo(str(parts.database)), autocommit=True) as connection:
            assert connection.execute(
                "SELECT count(*) FROM pg_database WHERE datname LIKE %s", [f"{parts.database}_%"]
            ).fetchone() == (0,), "the copy is gone"
            connection.execute("UPDATE alembic_version SET version_num = 'another'")
        failed = drilled()
        assert failed.returncode != 0
        assert "revision" in failed.stderr + failed.stdout
