"""A service in a process of its own that tests stop and start, and a real browser that is watched."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from launch import COMMAND, answers, free_port

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page

READY_SECONDS = 180.0


class Site:
    """A service on a port of its own; it keeps port and database from one start to the next."""

    def __init__(self, folder: Path, **environment: str) -> None:
        self._folder = folder
        # The first preview of a kind may take longer than the usual limit where the machine has other work.
        self._environment = {**os.environ, "STICKSLIP_PREVIEW_SECONDS": "60", **environment}
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.database = f"sqlite:///{folder}/jobs.db"
        self._process: subprocess.Popen[bytes] | None = None

    def set_environment(self, **environment: str) -> None:
        """Set variables for the starts to come."""
        self._environment.update(environment)

    def start(self) -> None:
        where = ("--port", str(self.port), "--database", self.database, "--workers", "1")
        with (self._folder / "log").open("a") as log:
            command = [*COMMAND, "serve", *where]
            self._process = subprocess.Popen(command, stderr=log, stdout=log, env=self._environment)
        end = time.monotonic() + READY_SECONDS
        while time.monotonic() < end and self._process.poll() is None:
            if answers(self.port, "/health/ready"):
                return
            time.sleep(0.05)
        self._process.kill()
        self._process.wait()
        pytest.fail((self._folder / "log").read_text())

    def kill(self) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.wait()
        self._process = None

    def stop(self) -> None:
        if self._process is not None:
            self._process.terminate()
            assert self._process.wait(timeout=120) == 0, (self._folder / "log").read_text()
            self._process = None


class Address(NamedTuple):
    """A service that the test itself runs."""

    url: str


@dataclass
class Watch:
    """What a browser said while a test used it."""

    url: str
    said: list[str] = field(default_factory=list)
    elsewhere: list[str] = field(default_factory=list)
    allowed: tuple[str, ...] = ()

    def listen(self, page: Page) -> None:
        page.on("console", self._spoken)
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self._requested(request.url))

    def _spoken(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.said.append(f"{message.text} ({message.location['url']})")

    def _requested(self, url: str) -> None:
        if not url.startswith((f"{self.url}/", f"blob:{self.url}/")):
            self.elsewhere.append(url)

    def check(self) -> None:
        said = [text for text in self.said if not any(word in text for word in self.allowed)]
        assert said == []
        assert self.elsewhere == []


@contextmanager
def opened(browser: Browser, site: Site | Address, **options: Any) -> Iterator[tuple[BrowserContext, Watch]]:
    """A fresh profile of the browser whose pages must not complain nor ask elsewhere."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, **options)
    context.set_default_timeout(90_000)
    watch = Watch(site.url)
    context.on("page", watch.listen)
    try:
        yield context, watch
    finally:
        context.close()
    watch.check()
