"""What one request costs: a look at a job beside a route of FastAPI that does nothing, in turns."""

from __future__ import annotations

import asyncio
import itertools
import multiprocessing as mp
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.harness import expect, table
from benchmarks.service_load import small_job
from benchmarks.service_process import LightClient, ServiceProcess, serving
from service.auth.authenticator import create
from service.auth.callers import KeyLimits, Scope
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.repositories.owned import KeyRepository

_BARE = """
import sys, uvicorn
from fastapi import FastAPI
app = FastAPI()
@app.get("/v1/jobs/{job_id}")
def bare(job_id: str) -> dict[str, str]:
    return {"id": job_id}
uvicorn.run(app, port=int(sys.argv[1]), http="h11", loop="auto", log_level="warning", access_log=False)
"""
_ROUNDS, _REQUESTS = 30, 50
_START_SECONDS = 60.0


def _bare_route(port: int) -> subprocess.Popen[bytes]:
    process = subprocess.Popen([sys.executable, "-c", _BARE, str(port)])
    end = time.monotonic() + _START_SECONDS
    while True:
        try:
            LightClient(port).__exit__()
        except OSError:
            expect("the bare route does not answer", time.monotonic() < end and process.poll() is None)
            time.sleep(0.05)
        else:
            return process


def _seconds(client: LightClient, path: str) -> float:
    begun = time.perf_counter()
    for _ in range(_REQUESTS):
        expect("not answered 200", client.get(path).status == 200)
    return (time.perf_counter() - begun) / _REQUESTS


def requests() -> None:
    """`GET /v1/jobs/{id}` beside a bare synchronous route of FastAPI, in turns on the same machine."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        database = f"sqlite:///{folder}/jobs.db"
        with serving(database, workers=1, log=folder / "log", log_level="WARNING") as service:
            process = _bare_route(port)
            try:
                with service.client() as ours, LightClient(port) as bare:
                    done = ours.post("/v1/jobs", small_job(0), "Prefer: wait=60\r\n").json()
                    path = f"/v1/jobs/{done['id']}"
                    pairs = [(_seconds(ours, path), _seconds(bare, path)) for _ in range(_ROUNDS)]
            finally:
                process.terminate()
                process.wait()
    ms = [statistics.median(one) * 1e3 for one in zip(*pairs, strict=True)]
    ratio = statistics.median(a / b for a, b in pairs)
    table(
        f"One request, {_ROUNDS} times {_REQUESTS} of each in turns, {os.cpu_count()} cores",
        ("GET /v1/jobs/{id}", "a bare route", "ratio", "wanted"),
        [(f"{ms[0]:.2f} ms", f"{ms[1]:.2f} ms", f"{ratio:.2f}", "3")],
    )


_CONSTANT = (
    "/openapi.json", "/docs", "/docs/style.css", "/", "/page/0/js/page.js", "/v1/login", "/health/live",
    "/v1/kinds", "/v1/laws", "/v1/templates", "/v1/scenes-schema",
)  # fmt: skip
_FLOODS, _STREAMS = 16, 95
_SECONDS = float(os.environ.get("SECONDS", "5"))
_GZIP = "Accept-Encoding: gzip\r\n"
_NUMBERS = itertools.count()


def doors() -> None:
    """What a constant answer costs; another owner beside floods of each, and beside 95 streams of runs."""
    with tempfile.TemporaryDirectory() as name:
        log, database = Path(name) / "log", f"sqlite:///{name}/jobs.db"
        with serving(database, workers=1, log=log, require_keys="true") as service:
            ann, bob = (key_of(database, owner) for owner in ("ann", "bob"))
            with service.client() as client:
                for path in _CONSTANT:
                    client.get(path, ann)  # the first time, for which it is made
                costs = [(path, *(_cost(service, client, path, ann + more) for more in ("", _GZIP)))
                         for path in _CONSTANT]  # fmt: skip
            rows = [beside(service, bob, f"{_FLOODS} × {path}", (_FLOODS, (path,), "")) for path in _CONSTANT]
            rows.append(beside(service, bob, f"{_STREAMS} streams", (_STREAMS, ("/v1/runs/events",), ann)))
        logged = log.stat().st_size
    table(
        "Processor time of the service for a constant answer, wanted 2 ms",
        ("route", "plain", "compressed"),
        costs,
    )
    table_of(rows)
    print(f"The log of all that has {logged / 1e6:.1f} MB.")


def key_of(database: str, owner: str) -> str:
    """A new key of an owner, as the header that has it."""
    opened, limits = Database(database), KeyLimits(requests_per_minute=1_000_000)
    try:
        made = create(KeyRepository(opened), owner, [Scope.SUBMIT], utc_now(), None, limits)
        return f"Authorization: Bearer {made.token}\r\n"
    finally:
        opened.close()


def _cost(service: ServiceProcess, client: LightClient, path: str, headers: str, requests: int = 300) -> str:
    before = service.cpu()
    for _ in range(requests):
        answer = client.get(path, headers)
        expect(f"{path}: answered {answer.status}", answer.status == 200)
    return f"{1e3 * service.cpu().since(before).service / requests:.2f} ms"


def beside(
    service: ServiceProcess, key: str, words: str, *others: tuple[int, Sequence[str], str]
) -> tuple[str, ...]:
    """A row of `table_of`: of who looks and who hands in, beside others and alone in the same minute.

    Each of the others is a process with so many connections that ask for these paths with these headers.
    """
    spawn = mp.get_context("spawn")
    attacks = [spawn.Process(target=_ask, args=(service.port, *other), daemon=True) for other in others]
    alone = _at_work(service, key)
    for attack in attacks:
        attack.start()
    time.sleep(2.0)
    found = _at_work(service, key)
    for attack in attacks:
        attack.terminate()
        attack.join()
    time.sleep(1.0)
    ms = [f"{1e3 * one:.0f} ms" for one in (*found[:2], *alone[:2])]
    return (words, *ms, str(found[2]), str(alone[2]))


def table_of(rows: Sequence[tuple[str, ...]]) -> None:
    """Print what another owner met."""
    table(
        f"Another owner's GET /v1/jobs, and the jobs that were accepted, beside others in {_SECONDS:g} s",
        ("beside", "p50", "p99", "control p50", "p99", "jobs", "control"), rows,
    )  # fmt: skip


def _ask(port: int, connections: int, paths: Sequence[str], headers: str) -> None:
    """The process of those who ask again and again, or read what has no end, and of what comes nothing."""
    end = f"HTTP/1.1\r\nHost: 127.0.0.1\r\n{headers}\r\n"
    asked = itertools.cycle([f"GET {path} {end}".encode() for path in paths])

    async def one() -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        while True:
            writer.write(next(asked))
            head = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
            if "content-length:" in head:
                await reader.readexactly(int(head.partition("content-length:")[2].split()[0]))
            while "event-stream" in head and await reader.read(1 << 16):
                pass

    async def all_of_them() -> None:
        await asyncio.gather(*(one() for _ in range(connections)))

    asyncio.run(all_of_them())


def _at_work(service: ServiceProcess, key: str) -> tuple[float, float, int]:
    """Median and 99 % of the times of a GET [s], and how many jobs were accepted beside it."""
    end, accepted = time.monotonic() + _SECONDS, itertools.count()

    def hand_in() -> None:
        with service.client() as http:
            while time.monotonic() < end:
                answer = http.post("/v1/jobs", small_job(next(_NUMBERS)), key)
                expect(f"answered {answer.status}", answer.status == 202)
                next(accepted)

    handing = threading.Thread(target=hand_in)
    handing.start()
    seconds = []
    with service.client() as http:
        while time.monotonic() < end:
            begun = time.perf_counter()
            expect("not answered 200", http.get("/v1/jobs?limit=10", key).status == 200)
            seconds.append(time.perf_counter() - begun)
    handing.join()
    seconds.sort()
    return seconds[len(seconds) // 2], seconds[int(0.99 * len(seconds))], next(accepted)
