"""The faults that may happen to a site."""

import contextlib
import os
import random
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import psutil
import psycopg
from dask_cluster import DaskCluster
from fault_site import LEASE, Program, Site
from postgresql_cluster import Cluster

Fault = Callable[[Site, random.Random], None]


def _one(site: Site, generator: random.Random) -> Program:
    return generator.choice(site.programs)


def child_killed(site: Site, generator: random.Random) -> None:
    """Kill -9 of a worker process."""
    children = site.children(_one(site, generator))
    if children:
        with contextlib.suppress(ProcessLookupError):
            os.kill(generator.choice(children), signal.SIGKILL)


def source_killed(site: Site, generator: random.Random) -> None:
    """Kill -9 of the process that workers are forked off."""
    for source in site.forked_off(_one(site, generator)):
        with contextlib.suppress(ProcessLookupError):
            os.kill(source, signal.SIGKILL)


def child_paused(site: Site, generator: random.Random) -> None:
    """A worker process stands still for longer than a lease."""
    for child in site.children(_one(site, generator))[:1]:
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGSTOP)
            time.sleep(1.2 * LEASE)
            os.kill(child, signal.SIGCONT)


def program_killed(site: Site, generator: random.Random) -> None:
    """Kill -9 of a service or dispatcher; it is started again."""
    program = _one(site, generator)
    program.process.kill()
    program.process.wait()
    site.again(program)


def program_stopped(site: Site, generator: random.Random) -> None:
    """SIGTERM to a service or dispatcher; it ends with status 0 and is started again."""
    program = _one(site, generator)
    program.process.terminate()
    status = program.process.wait(60.0)
    if status != 0:
        site.wrong.append(f"a program ended with status {status} after SIGTERM")
    site.again(program)


def program_paused(site: Site, generator: random.Random) -> None:
    """A service or dispatcher stands still past its leases and comes back."""
    program = _one(site, generator)
    program.process.send_signal(signal.SIGSTOP)
    time.sleep(1.3 * LEASE)
    program.process.send_signal(signal.SIGCONT)


def queue_full(site: Site, generator: random.Random) -> None:
    """More jobs at once than the queue takes: refused with Retry-After, or accepted and done."""
    full = threading.Event()

    def burst(number: int) -> None:
        with httpx.Client(timeout=60.0) as client:
            for index in range(20):
                seed = generator.randrange(10**12) + 1000 * number + index
                body = {"kind": "iteration", "seed": seed, "sweeps": 0}
                with contextlib.suppress(httpx.TransportError):
                    answer = client.post(f"{site.base()}/v1/jobs", json=body)
                    if answer.is_success:
                        site.accepted[answer.json()["id"]] = body
                    elif answer.status_code == 503:
                        full.set()
                        if "retry-after" not in answer.headers:
                            site.wrong.append("503 without Retry-After")

    threads = [threading.Thread(target=burst, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def disk_full(folder: Path) -> Fault:
    """The disk of the database has no room for a while."""

    def happen(_site: Site, generator: random.Random) -> None:
        filler = folder / "filler"
        try:
            with filler.open("wb", buffering=0) as file:
                block = b"\0" * 4096
                while True:
                    file.write(block)
        except OSError:
            time.sleep(generator.uniform(0.3, 1.2))
        finally:
            filler.unlink()

    return happen


def server_restarted(cluster: Cluster) -> Fault:
    """PostgreSQL is stopped, connections are cut, and started again."""

    def happen(_site: Site, generator: random.Random) -> None:
        cluster.stop()
        time.sleep(generator.uniform(0.0, 1.5))
        cluster.start()

    return happen


def connections_cut(cluster: Cluster, url: str) -> Fault:
    """PostgreSQL ends every session of the database."""

    def happen(_site: Site, _generator: random.Random) -> None:
        query = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s"
        with psycopg.connect(cluster.conninfo("postgres"), autocommit=True) as connection:
            connection.execute(query, (url.rsplit("/", 1)[1],))

    return happen


def cluster_worker_killed(dask: DaskCluster) -> Fault:
    """Kill -9 of a worker's computing process, or of all of it; a worker is there again afterwards."""

    def happen(_site: Site, generator: random.Random) -> None:
        nanny = generator.choice(dask.workers)
        family = dask.family(nanny)
        whole = generator.random() < 0.5
        for process in family if whole else family[1:]:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        if whole:
            nanny.wait(60)
            dask.workers.remove(nanny)
            dask.add_worker()

    return happen


def scheduler_killed(dask: DaskCluster) -> Fault:
    """Kill -9 of the scheduler; its workers end too, and all are started again."""

    def happen(_site: Site, generator: random.Random) -> None:
        dask.kill_scheduler()
        time.sleep(generator.uniform(0.0, 1.0))
        for nanny in dask.workers:
            for process in dask.family(nanny):
                with contextlib.suppress(psutil.NoSuchProcess):
                    process.kill()
            nanny.wait(60)
        number = len(dask.workers)
        dask.workers.clear()
        dask.start_scheduler()
        for _ in range(number):
            dask.add_worker()

    return happen
