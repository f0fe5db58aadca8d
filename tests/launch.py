"""How tests start the command in a process of its own."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

COMMAND = (sys.executable, "-c", "import sys; from service.cli import main; sys.exit(main())")


@contextmanager
def served(folder: Path, environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """The address of a service started with `stickslip serve`; it must end cleanly when it is told to."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    arguments = ("serve", "--port", str(port), "--database", f"sqlite:///{folder}/jobs.db", "--workers", "1")
    with (folder / "log").open("w") as log:
        process = subprocess.Popen([*COMMAND, *arguments], stderr=log, stdout=log, env=environment)
        try:
            url = f"http://127.0.0.1:{port}"
            _wait_until_ready(url, process)
            yield url
        finally:
            process.terminate()
            status = process.wait(timeout=30)
    assert status == 0, (folder / "log").read_text()


def _wait_until_ready(url: str, process: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        if process.poll() is not None:
            pytest.fail(f"the service ended with status {process.returncode}")
        try:
            if httpx.get(f"{url}/health/ready").status_code == 200:
                return
        except httpx.TransportError:
            pass
        time.sleep(0.05)
    pytest.fail("the service did not get ready")
