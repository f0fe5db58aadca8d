"""A real service under attack: what one client sends, what it costs, and how another one fares."""

from __future__ import annotations

import http.client
import json
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from benchmarks.service_process import ServiceProcess, serving
from service.auth import authenticator
from service.auth.callers import Scope
from service.db import revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.repositories.owned import KeyRepository

MOST_MEMORY = 300 * 1024**2
"""Bytes above those of the idle service that an attack may take."""
MOST_WAIT = 0.25
"""Seconds in which 99 of 100 requests of another client are answered meanwhile."""
SLOWER = 10.0
"""Or so many times what the slowest of some takes while nobody attacks, on a machine that is slow itself."""
_IDLE_REQUESTS = 30
TRIES = 4
"""Of an attack, one of which keeps the limit of time: the machine may have other work."""
GRACE_SECONDS = 2.0
_LOOK_SECONDS = 0.02
_BEGUN_SECONDS = 0.3
_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICKS = os.sysconf("SC_CLK_TCK")

AskedT = TypeVar("AskedT")


@dataclass(frozen=True, slots=True)
class Attack:
    """One request: POST if there is a body."""

    path: str
    body: bytes | None = None

    @classmethod
    def of(cls, path: str, body: object) -> Attack:
        """A body as JSON."""
        return cls(path, json.dumps(body).encode())


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back, and the processor time that the whole service took meanwhile [s]."""

    status: int
    body: bytes
    seconds: float


@dataclass(slots=True)
class Figures:
    """What an attack did: its answers, bytes above idle at most, how long another client's GETs took [s]."""

    answers: list[Answer]
    memory: int
    processor: float
    waits: list[float] = field(default_factory=list)

    @property
    def p99(self) -> float:
        """The time in which 99 of 100 requests of the other client were answered [s]."""
        return sorted(self.waits)[math.ceil(0.99 * len(self.waits)) - 1]

    def told(self) -> str:
        """For people."""
        slowest = max(answer.seconds for answer in self.answers)
        found = sorted({answer.status for answer in self.answers})
        return (
            f"{self.memory / 1e6:.0f} MB above idle, slowest answer {slowest:.2f} s, processor "
            f"{self.processor:.2f} s, GET p99 {1e3 * self.p99:.0f} ms, status {found}"
        )


class Site:
    """A service with a key for who attacks it and one for somebody else."""

    def __init__(self, process: ServiceProcess, attacker: str, other: str) -> None:
        self.process = process
        self._attacker = attacker
        self.other = other
        self._idle = 0
        self._most_wait = MOST_WAIT

    def send(self, attack: Attack, token: str | None = None, seconds: float = 300.0) -> Answer:
        """Send one request and wait for its answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.process.port, timeout=seconds)
        headers = {"Authorization": f"Bearer {token or self._attacker}"}
        if attack.body is not None:
            headers["Content-Type"] = "application/json"
        before = self._processor()
        begin = time.monotonic()
        try:
            connection.request("GET" if attack.body is None else "POST", attack.path, attack.body, headers)
            found = connection.getresponse()
            body = found.read()
        finally:
            connection.close()
        return Answer(found.status, body, min(self._processor() - before, time.monotonic() - begin))

    def rest(self) -> None:
        """Wait until all is loaded and quiet, and remember how much memory that is."""
        for _ in range(2):
            self.send(Attack.of("/v1/plan", {"scene": "two-dof"}))
            self.send(Attack.of("/v1/previews", {"kind": "point", "scene": "two-dof", "frequency_hz": 1.05}))
        self._most_wait = max(MOST_WAIT, SLOWER * max(self._ask() for _ in range(_IDLE_REQUESTS)))
        self._idle = self._memory()

    def _ask(self) -> float:
        """Time that another client's GET takes [s]."""
        begin = time.monotonic()
        assert self.send(Attack("/v1/jobs?limit=1"), self.other).status == 200
        return time.monotonic() - begin

    def under(self, attacks: Sequence[Attack], at_once: int = 1) -> Figures:
        """Send all of them, some at once, and look at the service meanwhile."""
        over = threading.Event()
        waits: list[float] = []
        peak = [0]

        def watch() -> None:
            while not over.wait(_LOOK_SECONDS):
                peak[0] = max(peak[0], self._memory())

        def ask() -> None:
            while not over.is_set() or len(waits) < 20:
                waits.append(self._ask())
                time.sleep(_LOOK_SECONDS / 2)

        threads = [threading.Thread(target=one) for one in (watch, ask)]
        before = self._processor()
        for thread in threads:
            thread.start()
        try:
            with ThreadPoolExecutor(at_once) as pool:
                answers = list(pool.map(self.send, attacks))
        finally:
            over.set()
            for thread in threads:
                thread.join()
        memory = max(peak[0], self._memory()) - self._idle
        return Figures(answers, memory, self._processor() - before, waits)

    def meanwhile(self, attacks: Sequence[Attack], ask: Callable[[], AskedT], at_once: int = 1) -> AskedT:
        """What `ask` gives while the attacks go on."""
        with ThreadPoolExecutor(at_once) as pool:
            sent = [pool.submit(self.send, attack) for attack in attacks]
            time.sleep(_BEGUN_SECONDS)
            found = ask()
            assert not all(one.done() for one in sent), "the attack was over before"
        return found

    @contextmanager
    def sending(self, attacks: Sequence[Attack]) -> Iterator[None]:
        """While the attacks go on, whose connections may break."""

        def send(attack: Attack) -> None:
            with suppress(OSError, http.client.HTTPException):
                self.send(attack)

        with ThreadPoolExecutor(len(attacks)) as pool:
            for attack in attacks:
                pool.submit(send, attack)
            time.sleep(_BEGUN_SECONDS)
            yield

    def bears(self, attacks: Sequence[Attack], at_once: int = 1) -> Figures:
        """Assert that an attack is refused or answered within the limits; one of some tries is in time."""
        for left in reversed(range(TRIES)):
            figures = self.under(attacks, at_once)
            sys.stdout.write(f"{figures.told()}\n")
            told = [(answer.status, answer.body[:300]) for answer in figures.answers]
            assert all(answer.status < 500 or answer.status == 503 for answer in figures.answers), told
            assert figures.memory <= MOST_MEMORY, figures.told()
            if figures.p99 <= self._most_wait:
                return figures
            assert left, figures.told()
        return figures

    def stops(self) -> float:
        """Tell it to stop; how long it takes [s]."""
        begin = time.monotonic()
        self.process.process.send_signal(signal.SIGTERM)
        assert self.process.process.wait(120.0) == 0
        return time.monotonic() - begin

    def _pids(self) -> list[int]:
        found = [self.process.process.pid]
        for pid in found:
            try:
                for task in Path(f"/proc/{pid}/task").iterdir():
                    found += map(int, (task / "children").read_text().split())
            except (FileNotFoundError, ProcessLookupError):
                continue
        return found

    def _memory(self) -> int:
        """Bytes of memory of the service and of all its processes."""
        total = 0
        for pid in self._pids():
            try:
                total += int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE
            except (FileNotFoundError, ProcessLookupError):
                continue
        return total

    def _processor(self) -> float:
        """Processor time of the service and of its processes, ended ones too [s]."""
        total = 0
        for pid in self._pids():
            try:
                fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
            except (FileNotFoundError, ProcessLookupError):
                continue
            total += sum(map(int, fields[11:15]))
        return total / _TICKS


@contextmanager
def attacked(folder: Path, **settings: object) -> Iterator[Site]:
    """A service as it stands by default, with one worker and keys; `Site.rest` has it load all it needs."""
    url = f"sqlite:///{folder}/jobs.db"
    revisions.upgrade(url)
    database = Database(url)
    tokens = [
        authenticator.create(KeyRepository(database), owner, [Scope.SUBMIT], utc_now()).token
        for owner in ("eve", "ann")
    ]
    database.close()
    limits = {"require_keys": True, "requests_per_minute": 1_000_000, **settings}
    with serving(url, workers=1, log=folder / "log", **limits) as process:
        yield Site(process, *tokens)
