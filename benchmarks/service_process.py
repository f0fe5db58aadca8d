"""A real service for the benchmarks: `stickslip serve` in a process of its own, light clients, CPU times."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from benchmarks.harness import WrongResultError

_COMMAND = (sys.executable, "-c", "import sys; from service.cli import process; sys.exit(process())")
_TICKS = os.sysconf("SC_CLK_TCK")
_START_SECONDS = 600.0


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to a request."""

    status: int
    headers: dict[str, str]
    body: bytes

    def json(self) -> Any:
        """Return its body, parsed."""
        return json.loads(self.body)


class LightClient:
    """One kept-alive connection that does little more than HTTP needs: the service is measured, not this."""

    def __init__(self, port: int, timeout: float = 120.0) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._left = b""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._socket.close()

    def get(self, path: str, headers: str = "") -> Answer:
        """Return the answer to a GET; `headers` are whole lines."""
        self._socket.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{headers}\r\n".encode())
        return self._answer()

    def post(self, path: str, body: Mapping[str, Any], headers: str = "") -> Answer:
        """Return the answer to a POST of JSON; `headers` are whole lines."""
        data = json.dumps(body).encode()
        head = (
            f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(data)}\r\n{headers}\r\n"
        )
        self._socket.sendall(head.encode() + data)
        return self._answer()

    def _answer(self) -> Answer:
        while (end := self._left.find(b"\r\n\r\n")) < 0:
            self._receive()
        first, *lines = self._left[:end].decode("latin-1").split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        size = end + 4 + int(headers.get("content-length", "0"))
        while len(self._left) < size:
            self._receive()
        body, self._left = self._left[end + 4 : size], self._left[size:]
        return Answer(int(first.split()[1]), headers, body)

    def _receive(self) -> None:
        data = self._socket.recv(1 << 18)
        if not data:
            raise WrongResultError("the service closed a connection")
        self._left += data


@dataclass(frozen=True, slots=True)
class Cpu:
    """Processor seconds since start: of the service process, its workers, this process, the machine."""

    service: float
    workers: float
    clients: float
    machine: float

    def since(self, before: Cpu) -> Cpu:
        """Return what was used since `before`."""
        return Cpu(
            self.service - before.service,
            self.workers - before.workers,
            self.clients - before.clients,
            self.machine - before.machine,
        )

    @property
    def total(self) -> float:
        """Of all three together."""
        return self.service + self.workers + self.clients


class ServiceProcess:
    """A running service: its port, its database, its processes."""

    def __init__(self, process: subprocess.Popen[bytes], port: int, database: str) -> None:
        self.process = process
        self.port = port
        self.database = database

    def client(self) -> LightClient:
        """Return a new connection."""
        return LightClient(self.port)

    def cpu(self) -> Cpu:
        """Return the processor time used until now; of workers that live."""
        children = sum(_seconds(pid) for pid in _children(self.process.pid))
        return Cpu(_seconds(self.process.pid), children, time.process_time(), _machine_seconds())


Words = Callable[[str, int, int], Sequence[str]]


def _serve_words(database: str, port: int, workers: int) -> Sequence[str]:
    return (*_COMMAND, "serve", "--port", str(port), "--database", database, "--workers", str(workers))


@contextmanager
def serving(
    database: str, *, workers: int, log: Path, command: Words = _serve_words, **settings: object
) -> Iterator[ServiceProcess]:
    """Start `stickslip serve` and wait until its workers are ready; stop it afterwards.

    Parameters
    ----------
    command : callable
        Database, port and number of workers to the words of the process to start.
    settings : object
        Further settings, put into its environment.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    environment = os.environ | {f"STICKSLIP_{name.upper()}": str(value) for name, value in settings.items()}
    with log.open("ab") as stderr:
        process = subprocess.Popen(command(database, port, workers), stderr=stderr, env=environment)
    try:
        service = ServiceProcess(process, port, database)
        _until_ready(service, workers)
        yield service
    finally:
        process.terminate()
        try:
            process.wait(30.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _until_ready(service: ServiceProcess, workers: int) -> None:
    end = time.monotonic() + _START_SECONDS
    while time.monotonic() < end:
        try:
            with service.client() as client:
                answer = client.get("/health/ready")
                # Without a key the answer has no numbers where keys are needed.
                if answer.status == 200 and answer.json().get("workers_ready", workers) == workers:
                    return
        except OSError:
            pass
        if service.process.poll() is not None:
            break
        time.sleep(0.1)
    raise WrongResultError("the service did not get ready, see its log")


def _stat(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()


def _seconds(pid: int) -> float:
    fields = _stat(pid)
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _children(pid: int) -> list[int]:
    """Every process below one."""
    above = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                above[int(folder.name)] = int(_stat(int(folder.name))[1])
    found = [pid]
    for one in found:
        found += [child for child, parent in above.items() if parent == one]
    return found[1:]


def _machine_seconds() -> float:
    """Processor time of everything that runs on the machine."""
    fields = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:]]
    return (sum(fields) - fields[3] - fields[4]) / _TICKS
