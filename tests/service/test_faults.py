"""Faults at random moments: every accepted job ends, with one result, and nothing is left over.

``pytest -m long tests/service/test_faults.py -s`` makes more than 200 of them and prints what happened.
"""

import random
import sys
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import httpx
import pytest
from dask_cluster import DaskCluster
from fault_kinds import (
    Fault,
    child_killed,
    child_paused,
    cluster_worker_killed,
    connections_cut,
    disk_full,
    program_killed,
    program_paused,
    program_stopped,
    queue_full,
    scheduler_killed,
    server_restarted,
    source_killed,
)
from fault_site import Site, clients
from launch import free_port
from postgresql_cluster import Cluster
from service_helpers import until
from sqlalchemy import func, select

from service.db.engine import Database
from service.db.models import Job, JobResult, JobState, Result
from service.db.repositories.integrity import check

COMMON: dict[str, Fault] = {
    "worker killed": child_killed,
    "what workers are forked off killed": source_killed,
    "worker paused past the lease": child_paused,
    "service killed": program_killed,
    "service stopped": program_stopped,
    "service paused past the lease": program_paused,
    "queue full": queue_full,
}


def undergo(site: Site, faults: Mapping[str, Fault], number: int, seed: int) -> None:
    """Let faults happen while clients submit; then wait for the end of every accepted job, and check."""
    generator, names = random.Random(seed), list(faults)
    began = time.monotonic()
    with site:
        with clients(site, jobs=(5 if number < 10 else 8) * number, seed=seed):
            until(lambda: site.accepted)  # a service that still starts has no work to lose
            for index in range(number):
                time.sleep(generator.uniform(0.05, 0.4))
                name = names[index % len(names)] if index < len(names) else generator.choice(names)
                faults[name](site, generator)
                site.faults[name] += 1
        took = await_end(site)
    assert site.await_nobody() == [], "processes are left over"
    assert site.wrong == []
    states = check_rows(site)
    sys.stdout.write(
        f"\n{sum(site.faults.values())} faults in {time.monotonic() - began:.0f} s {dict(site.faults)}; "
        f"{len(site.accepted)} jobs accepted, {dict(states)}, the last {took:.1f} s after the last fault; "
        f"refused meanwhile {dict(site.refused)}\n"
    )


def await_end(site: Site, seconds: float = 300.0) -> float:
    """Wait until every accepted job has ended; the time it took [s]."""
    begin = time.monotonic()
    with httpx.Client(timeout=60.0) as client:
        for job in list(site.accepted):
            while True:
                assert time.monotonic() < begin + seconds, f"job {job} does not end"
                answer = client.get(f"{site.base()}/v1/jobs/{job}")
                if answer.status_code == 200 and answer.json()["finished"] is not None:
                    break
                time.sleep(0.1)
    return time.monotonic() - begin


def check_rows(site: Site) -> Counter[str]:
    """Every accepted job was successful and has one result; nothing else has one; the database is sound."""
    database = Database(site.url)
    with database.reading() as connection:
        states = {row.id: row.state for row in connection.execute(select(Job.id, Job.state))}
        results = connection.execute(select(JobResult.job_id)).scalars().all()
        counts = (
            select(Result.job_id, func.count().label("number"))
            .where(Result.of == "sweep")
            .group_by(Result.job_id)
        )
        sweeps = {row.job_id: row.number for row in connection.execute(counts)}
    database.close()
    assert set(site.accepted) <= set(states), "an accepted job was lost"
    assert set(states.values()) == {JobState.SUCCESSFUL}
    assert len(results) == len(set(results))
    assert set(results) == set(states)
    for job, body in site.accepted.items():
        assert sweeps.get(job, 0) == body["sweeps"]
    assert check(site.url).trouble == ()
    return Counter(state.value for state in states.values())


@pytest.mark.parametrize("number", [4, pytest.param(90, marks=pytest.mark.long)])
def test_one_service_on_sqlite(tmp_path: Path, number: int) -> None:
    site = Site(f"sqlite:///{tmp_path}/jobs.db", tmp_path, [free_port()])
    undergo(site, COMMON, number, seed=number)


@pytest.mark.long
@pytest.mark.parametrize("number", [2, 30])
def test_a_disk_that_is_full_for_a_while(tmp_path: Path, small_disk: Path, number: int) -> None:
    site = Site(f"sqlite:///{small_disk}/jobs.db", tmp_path, [free_port()])
    undergo(site, {"disk full": disk_full(small_disk)}, number, seed=number)


# Four: the server's own, and those after which another service goes on with the jobs.
@pytest.mark.long
@pytest.mark.parametrize("number", [4, 100])
def test_services_and_a_dispatcher_on_postgresql(cluster: Cluster, tmp_path: Path, number: int) -> None:
    with cluster.database(empty=False) as url:
        site = Site(url, tmp_path, [free_port(), free_port(), None])
        own = {
            "PostgreSQL restarted": server_restarted(cluster),
            "connections cut": connections_cut(cluster, url),
            "service killed": program_killed,
            "service paused past the lease": program_paused,
        }
        undergo(site, {**own, **COMMON}, number, seed=number)


@pytest.mark.long
@pytest.mark.parametrize("number", [30])
def test_a_service_on_a_cluster(tmp_path: Path, number: int) -> None:
    with DaskCluster(tmp_path, workers=2) as dask:
        extra = {"STICKSLIP_EXECUTOR": "dask", "STICKSLIP_DASK_SCHEDULER": dask.address}
        site = Site(f"sqlite:///{tmp_path}/jobs.db", tmp_path, [free_port()], extra)
        names = ("service killed", "service stopped", "service paused past the lease")
        faults = {
            "cluster's worker killed": cluster_worker_killed(dask),
            "cluster's scheduler killed": scheduler_killed(dask),
            **{name: COMMON[name] for name in names},
        }
        undergo(site, faults, number, seed=number)
