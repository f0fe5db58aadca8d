"""A site with services, workers and clients as real processes, and the faults that happen to it."""

import contextlib
import os
import random
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import httpx
import psutil
from launch import answers

SCRIPT = Path(__file__).with_name("serve_private.py")
LEASE = 1.0
_MARK = "STICKSLIP_TEST_SITE"
_SETTINGS = {
    "STICKSLIP_LEASE_SECONDS": str(LEASE),
    "STICKSLIP_POLL_SECONDS": "0.5",
    "STICKSLIP_MAX_ATTEMPTS": "100",
    "STICKSLIP_QUEUE_LIMIT": "60",
    "STICKSLIP_GRACE_SECONDS": "0.3",
    "STICKSLIP_ANSWER_WORKERS": "1",
}


@dataclass
class Program:
    """A service, or a dispatcher without HTTP (port None), that is started again after every end."""

    port: int | None
    process: subprocess.Popen[bytes]


@dataclass
class Site:
    """Programs on one database; a context manager that ends them.

    Attributes
    ----------
    faults : Counter
        How many of each kind happened.
    accepted : dict
        Body of every accepted job, by id.
    """

    url: str
    folder: Path
    ports: list[int | None]
    extra: Mapping[str, str] = field(default_factory=dict)
    token: str = field(default_factory=lambda: secrets.token_hex(8))
    programs: list[Program] = field(default_factory=list)
    faults: Counter[str] = field(default_factory=Counter)
    accepted: dict[str, dict[str, Any]] = field(default_factory=dict)
    refused: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    over: threading.Event = field(default_factory=threading.Event)

    def __enter__(self) -> Self:
        for port in self.ports:
            self.programs.append(Program(port=port, process=self._start(port)))
        for program in self.programs:
            self.await_answer(program)
        return self

    def __exit__(self, *_: object) -> None:
        self.over.set()
        for program in self.programs:
            program.process.send_signal(signal.SIGCONT)
            program.process.terminate()
        for program in self.programs:
            try:
                program.process.wait(60.0)
            except subprocess.TimeoutExpired:
                program.process.kill()
                program.process.wait()
                self.wrong.append("a program did not end within 60 s of SIGTERM")

    def _start(self, port: int | None) -> subprocess.Popen[bytes]:
        what = "dispatch" if port is None else str(port)
        environment = {**os.environ, **_SETTINGS, **self.extra, _MARK: self.token}
        with (self.folder / f"log-{what}").open("ab") as log:
            return subprocess.Popen([sys.executable, SCRIPT, self.url, what], env=environment, stderr=log)

    def again(self, program: Program) -> None:
        """Start a program that has ended."""
        program.process = self._start(program.port)
        self.await_answer(program)

    def await_answer(self, program: Program, seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while program.port is None and not self.children(program):
            assert time.monotonic() < end, "the dispatcher starts no worker"
            time.sleep(0.05)
        while program.port is not None:
            if answers(program.port):
                return
            if program.process.poll() is not None or time.monotonic() > end:
                log = (self.folder / f"log-{program.port}").read_text()[-3000:]
                raise AssertionError(f"the service on port {program.port} does not come up:\n{log}")
            time.sleep(0.05)

    def children(self, program: Program) -> list[int]:
        """The worker processes of a program: children of the process that they are forked off."""
        with contextlib.suppress(psutil.NoSuchProcess):
            return [
                child.pid
                for source in psutil.Process(program.process.pid).children()
                for child in source.children()
            ]
        return []

    def forked_off(self, program: Program) -> list[int]:
        """The process that the workers of a program are forked off."""
        with contextlib.suppress(psutil.NoSuchProcess):
            below = psutil.Process(program.process.pid).children()
            return [
                child.pid for child in below if b"forkserver" in _read(Path(f"/proc/{child.pid}/cmdline"))
            ]
        return []

    def alive(self) -> list[int]:
        """Every process of this site."""
        mark = f"{_MARK}={self.token}".encode()
        found = []
        for folder in Path("/proc").iterdir():
            if folder.name.isdigit() and mark in _read(folder / "environ"):
                found.append(int(folder.name))
        return found

    def await_nobody(self, seconds: float = 60.0) -> list[int]:
        """Processes of this site that are left after its end."""
        end = time.monotonic() + seconds
        while (left := self.alive()) and time.monotonic() < end:
            time.sleep(0.05)
        return left

    def base(self) -> str:
        """The address of one of the services."""
        return f"http://127.0.0.1:{random.choice([p.port for p in self.programs if p.port])}"

    def submit(self, client: httpx.Client, body: dict[str, Any]) -> str | None:
        """Submit until it is accepted, with one Idempotency-Key; its id, or None if the site is over."""
        key = {"Idempotency-Key": secrets.token_hex(8)}
        while not self.over.is_set():
            try:
                answer = client.post(f"{self.base()}/v1/jobs", json=body, headers=key)
            except httpx.TransportError:
                self.refused[0] += 1
                time.sleep(0.05)
                continue
            if answer.is_success:
                job = str(answer.json()["id"])
                self.accepted[job] = body
                return job
            self.refused[answer.status_code] += 1
            if answer.status_code not in (503, 507):
                self.wrong.append(f"a good job was answered {answer.status_code}: {answer.text}")
                return None
            time.sleep(0.1)
        return None


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


@contextlib.contextmanager
def clients(site: Site, jobs: int, seed: int) -> Iterator[list[threading.Thread]]:
    """Two clients that submit jobs, and one that looks whether a half result can be seen."""
    threads = [threading.Thread(target=_submitting, args=(site, jobs // 2, seed + n)) for n in range(2)]
    watch = threading.Thread(target=_watching, args=(site, seed))
    for thread in (*threads, watch):
        thread.start()
    try:
        yield threads
    finally:
        site.over.set()
        for thread in (*threads, watch):
            thread.join(60.0)


def _submitting(site: Site, jobs: int, seed: int) -> None:
    generator = random.Random(seed)
    with httpx.Client(timeout=60.0) as client:
        for number in range(jobs):
            if site.over.is_set():
                return
            body = {
                "kind": "iteration",
                "seed": 1_000_000 * seed + number,
                "seconds": round(generator.uniform(0.0, 0.3), 3),
                "sweeps": generator.randint(0, 2),
            }
            site.submit(client, body)
            time.sleep(generator.uniform(0.0, 0.15))


def _watching(site: Site, seed: int) -> None:
    """A successful job has its whole result, one that has not ended has none."""
    generator = random.Random(seed)
    with httpx.Client(timeout=60.0) as client:
        while not site.over.is_set():
            time.sleep(0.02)
            jobs = list(site.accepted)
            if not jobs:
                continue
            job = generator.choice(jobs[-20:])
            with contextlib.suppress(httpx.TransportError):
                fault = _half(client, f"{site.base()}/v1/jobs/{job}", int(site.accepted[job]["sweeps"]))
                if fault is not None:
                    site.wrong.append(f"job {job}: {fault}")


def _half(client: httpx.Client, address: str, sweeps: int) -> str | None:
    before = client.get(address)
    results = client.get(f"{address}/results")
    if max(before.status_code, results.status_code) >= 500:
        return None
    if results.status_code == 200:
        body = results.json()
        if len(body["sweeps"]) != sweeps or "eigenvalue" not in body["result"]:
            return f"half a result can be seen: {body}"
    elif results.status_code != 409:
        return f"results answered {results.status_code}"
    elif before.json()["status"] == "successful":
        return "it was successful and its results are not there"
    return None
