"""A thousand users on two services over one PostgreSQL, behind a small proxy; and what breaks first beyond.

Each user has a key, a connection and an owner's own jobs, and asks ten times a minute at random: lists, runs,
results, and in one of twelve requests a new job. The last rows are more of them, made by asking more often.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import multiprocessing as mp
import os
import random
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlalchemy import func, select

from benchmarks.harness import WrongResultError, expect, table
from benchmarks.service_process import Cpu, ServiceProcess, serving
from benchmarks.service_workers import own_postgresql
from service.db import revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobState
from service.db.repositories.owned import KeyRepository

USERS = int(os.environ.get("USERS", "1000"))
SECONDS = float(os.environ.get("SECONDS", "60"))
_EACH_MINUTE = 10.0
_TIMES = (1.0, 2.0, 4.0, 8.0)
_SERVICES, _WORKERS = 2, 1
_READ_SECONDS = 0.25
_PATIENCE = 120.0
_WARM_SECONDS = 10.0
_TRIES = 3
_READS = (
    "/v1/runs?limit=50", "/v1/jobs?limit=50", "/v1/sweeps?scene=two-dof&sort=peak&limit=20",
    "/v1/runs?text=nominal", "/v1/kinds", "/v1/projects",
)  # fmt: skip
_HEAD = "HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer"


@dataclass
class Seen:
    """What users met: times of reads and of writes [s], statuses, the jobs they were promised."""

    reads: list[float] = field(default_factory=list)
    writes: list[float] = field(default_factory=list)
    statuses: Counter[int] = field(default_factory=Counter)
    jobs: list[str] = field(default_factory=list)


class User:
    """One user with a connection of their own."""

    def __init__(self, number: int, token: str, port: int, seen: Seen) -> None:
        self._chance = random.Random(number)
        self._number, self._token, self._port, self._seen = number, token, port, seen
        self._jobs: list[str] = []
        self._sent = itertools.count()
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def live(self, until: float, pause: float) -> None:
        """Ask now and then, `pause` seconds apart in the mean; the first time too, for an even rate."""
        while True:
            left = max(0.0, until - time.monotonic())
            await asyncio.sleep(min(left, self._chance.expovariate(1.0 / pause)))
            if time.monotonic() >= until:
                break
            if self._chance.random() < 1.0 / 12.0:
                await self._hand_in()
            else:
                await self._read()
        if self._streams is not None:
            self._streams[1].close()

    async def _read(self) -> None:
        path = self._chance.choice(_READS)
        if self._jobs and self._chance.random() < 0.5:
            path = self._chance.choice(("/v1/jobs/{}", "/v1/runs/{}", "/v1/runs/{}/summary"))
            path = path.format(self._chance.choice(self._jobs))
        begun = time.perf_counter()
        await self._answer(f"GET {path} {_HEAD} {self._token}\r\n\r\n".encode())
        self._seen.reads.append(time.perf_counter() - begun)

    async def _hand_in(self) -> None:
        load = 50.0 + self._number + 0.001 * next(self._sent)
        job = {"kind": "sweep", "scene": "two-dof", "set": {"damper.N0": load}, "name": "nominal"}
        body = json.dumps(job).encode()
        kind = f"Content-Type: application/json\r\nContent-Length: {len(body)}"
        key = f"Idempotency-Key: {self._number}-{load}"
        begun = time.perf_counter()
        head = f"POST /v1/jobs {_HEAD} {self._token}\r\n{key}\r\n{kind}\r\n\r\n".encode()
        status, answer = await self._answer(head + body)
        self._seen.writes.append(time.perf_counter() - begun)
        if status == 202:
            self._jobs.append(json.loads(answer)["id"])
            self._seen.jobs.append(self._jobs[-1])

    async def _answer(self, request: bytes) -> tuple[int, bytes]:
        """The answer to a request; on a new connection if the service has closed the one that was idle."""
        for _ in range(_TRIES):
            if self._streams is None or self._streams[0].at_eof():
                self._streams = await asyncio.open_connection("127.0.0.1", self._port)
            try:
                return await self._ask(*self._streams, request)
            except (ConnectionError, asyncio.IncompleteReadError):
                self._streams = None
        raise WrongResultError(f"{_TRIES} connections were closed without an answer")

    async def _ask(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, request: bytes
    ) -> tuple[int, bytes]:
        writer.write(request)
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
        lines = (line.partition(":") for line in head[1:])
        headers = {name.lower(): value.strip() for name, _, value in lines}
        answer = await reader.readexactly(int(headers.get("content-length", "0")))
        status = int(head[0].split()[1])
        self._seen.statuses[status] += 1
        return status, answer


def _users(port: int, tokens: list[str], first: int, times: float, seconds: float, found: Any) -> None:
    """The process of the users."""
    seen = Seen()

    async def all_of_them() -> None:
        pause = 60.0 / _EACH_MINUTE / times
        until = time.monotonic() + seconds
        users = [User(first + k, token, port, seen) for k, token in enumerate(tokens)]
        await asyncio.gather(*(user.live(until, pause) for user in users))

    asyncio.run(all_of_them())
    found.put((seen, time.process_time()))


def _proxy(listening: Any, ports: list[int]) -> None:
    """The process of the proxy: each connection goes to the service that has fewest."""

    async def serve() -> None:
        open_now = Counter(dict.fromkeys(ports, 0))

        async def pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                while data := await reader.read(1 << 16):
                    writer.write(data)
                    await writer.drain()
            except ConnectionError:
                pass  # the other end closed it
            finally:
                writer.close()

        async def handle(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            port = min(ports, key=lambda one: open_now[one])
            open_now[port] += 1
            try:
                theirs, ours = await asyncio.open_connection("127.0.0.1", port)
                await asyncio.gather(pipe(reader, ours), pipe(theirs, writer))
            finally:
                open_now[port] -= 1

        server = await asyncio.start_server(handle, "127.0.0.1", 0, backlog=2048)
        listening.put(server.sockets[0].getsockname()[1])
        await server.serve_forever()

    asyncio.run(serve())


@contextmanager
def _proxied(services: list[ServiceProcess]) -> Iterator[int]:
    """The port of a proxy in front of services."""
    context = mp.get_context("spawn")
    listening = context.Queue()
    process = context.Process(target=_proxy, args=(listening, [one.port for one in services]), daemon=True)
    process.start()
    try:
        yield listening.get(timeout=60.0)
    finally:
        process.terminate()
        process.join()


def _keys(url: str) -> list[str]:
    """A key for each user, and owners of their own."""
    database = Database(url)
    try:
        keys, now = KeyRepository(database), utc_now()
        about = {"scopes": ["read", "submit"], "limits": {}, "created": now}
        about |= dict.fromkeys(("expires", "revoked", "last_used"))
        return [keys.add(owner=f"user {number}", **about).token for number in range(USERS)]
    finally:
        database.close()


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """What one load did: what users met, processor seconds, time, and how long the queue took to empty."""

    times: float
    seen: Seen
    seconds: float
    service: float
    workers: float
    machine: float
    clients: float
    emptied: float


def _round(
    services: list[ServiceProcess], port: int, tokens: list[str], times: float, first: int, seconds: float
) -> Round:
    context = mp.get_context("spawn")
    found = context.Queue()
    process = context.Process(target=_users, args=(port, tokens, first, times, seconds, found))
    before, begun = [one.cpu() for one in services], time.monotonic()
    process.start()
    seen, clients = found.get(timeout=seconds + _PATIENCE)
    took = time.monotonic() - begun
    used: list[Cpu] = [one.cpu().since(old) for one, old in zip(services, before, strict=True)]
    process.join()
    emptied = _emptied(services[0].database)
    return Round(
        times=times, seen=seen, seconds=took, clients=clients, emptied=emptied,
        service=sum(one.service for one in used), workers=sum(one.workers for one in used),
        machine=used[0].machine,
    )  # fmt: skip


def _emptied(url: str) -> float:
    """Wait until no job waits or runs; how long that took [s]."""
    database, begun = Database(url), time.monotonic()
    try:
        while time.monotonic() - begun < _PATIENCE:
            with database.reading() as connection:
                busy = Job.state.in_((JobState.ACCEPTED, JobState.RUNNING))
                if not connection.execute(select(func.count()).where(busy)).scalar_one():
                    return time.monotonic() - begun
            time.sleep(0.1)
    finally:
        database.close()
    raise WrongResultError(f"jobs wait or run {_PATIENCE:g} s after the last one was handed in")


def _lost(url: str, rounds: list[Round]) -> int:
    """How many of the jobs that users were promised did not end successfully in one attempt."""
    promised = {job for one in rounds for job in one.seen.jobs}
    database = Database(url)
    try:
        with database.reading() as connection:
            good = select(Job.id).where(Job.state == JobState.SUCCESSFUL, Job.attempt == 1)
            return len(promised - set(connection.execute(good).scalars()))
    finally:
        database.close()


def _high(times: list[float], share: float) -> str:
    return (
        "" if len(times) < 2 else f"{1e3 * statistics.quantiles(times, n=1000)[round(1000 * share) - 1]:.0f}"
    )


def _row(one: Round) -> tuple[str, ...]:
    statuses, seen = one.seen.statuses, one.seen
    away = sum(count for status, count in statuses.items() if status >= 500)
    return (
        f"{USERS * one.times:.0f}", f"{statuses.total() / one.seconds:.0f}", _high(seen.reads, 0.5),
        _high(seen.reads, 0.99), _high(seen.writes, 0.99), str(statuses[429]), str(away),
        str(len(seen.jobs)), f"{one.emptied:.1f} s",
        f"{one.service / one.seconds:.2f} + {one.workers / one.seconds:.2f}",
        f"{one.machine / one.seconds:.2f}",
    )  # fmt: skip


def scale() -> None:
    """A thousand users on two services over one PostgreSQL behind a proxy; what breaks first beyond."""
    with tempfile.TemporaryDirectory() as folder, own_postgresql() as new_database, ExitStack() as stack:
        url = new_database()
        revisions.upgrade(url)
        tokens = _keys(url)
        log, settings = Path(folder) / "log", {"require_keys": "true", "log_level": "WARNING"}
        services = [
            stack.enter_context(serving(url, workers=_WORKERS, log=log, **settings)) for _ in range(_SERVICES)
        ]
        port = stack.enter_context(_proxied(services))
        # What is loaded by the first requests is no part of it.
        _round(services, port, tokens[:50], 10.0, first=len(_TIMES) * USERS, seconds=_WARM_SECONDS)
        rounds = []
        for number, times in enumerate(_TIMES):
            rounds.append(_round(services, port, tokens, times, number * USERS, SECONDS))
            print(*_row(rounds[-1]), flush=True)
        lost = _lost(url, rounds)
    cores = os.cpu_count()
    table(
        f"{USERS} clients, {_EACH_MINUTE:g} requests a minute and user, {_SERVICES} services, {cores} cores",
        ("users", "requests/s", "reads: p50 [ms]", "p99 [ms]", "handing in: p99 [ms]", "429", "5xx",
         "jobs", "queue empty after", "cores: services + workers", "cores: whole machine"),
        [_row(one) for one in rounds],
    )  # fmt: skip
    print(f"{lost} jobs lost of {sum(len(one.seen.jobs) for one in rounds)}")
    first = rounds[0].seen
    expect("no job is lost", lost == 0)
    expect("no answer 5xx to a thousand users", not any(status >= 500 for status in first.statuses))
    p99 = statistics.quantiles(first.reads, n=100)[98]
    expect(f"99 of 100 reads within {_READ_SECONDS} s: {p99:.3f} s", p99 <= _READ_SECONDS)
