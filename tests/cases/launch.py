"""How tests start the command in a process of its own."""

import http.client
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

COMMAND = (sys.executable, "-c", "import sys; from service.cli import process; sys.exit(process())")


def free_port() -> int:
    """A port of this machine that nobody has."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def answers(port: int, path: str = "/health/live") -> bool:
    """Whether a service of this machine answers 200; cheap, as it is asked many times while one starts."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20.0)
    try:
        connection.request("GET", path)
        return connection.getresponse().status == 200
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


@contextmanager
def served(folder: Path, environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """The address of a service started with `stickslip serve`; it must end cleanly when it is told to."""
    port = free_port()
    arguments = ("serve", "--port", str(port), "--database", f"sqlite:///{folder}/jobs.db", "--workers", "1")
    with (folder / "log").open("w") as log:
        process = subprocess.Popen([*COMMAND, *arguments], stderr=log, stdout=log, env=environment)
        try:
            _wait_until_ready(port, process)
            yield f"http://127.0.0.1:{port}"
        finally:
            process.terminate()
            status = process.wait(timeout=120)
    assert status == 0, (folder / "log").read_text()


def _wait_until_ready(port: int, process: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + 180.0
    while time.monotonic() < end:
        if process.poll() is not None:
            pytest.fail(f"the service ended with status {process.returncode}")
        if answers(port, "/health/ready"):
            return
        time.sleep(0.05)
    pytest.fail("the service did not get ready")
