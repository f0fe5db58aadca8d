from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from private_kinds import PRIVATE

from service.app import create_app
from service.core import Service
from service.embedded import EmbeddedService
from service.jobs import Registry
from service.kinds import SHIPPED
from service.server import _bind, _config, _Server
from service.settings import Settings, load_settings

MakeSettings = Callable[..., Settings]


@pytest.fixture
def make_settings(tmp_path: Path) -> MakeSettings:
    def make(**values: object) -> Settings:
        defaults = {
            "database": f"sqlite:///{tmp_path}/jobs.db",
            "workers": 1,
            "port": 0,
            "grace_seconds": 0.3,
            "poll_seconds": 1.0,
        }
        return load_settings(**{**defaults, **values})

    return make


@pytest.fixture
def embedded(make_settings: MakeSettings) -> Iterator[EmbeddedService]:
    with EmbeddedService(make_settings(), PRIVATE) as service:
        yield service


@contextmanager
def serving(folder: Path, registry: Registry) -> Iterator[httpx.Client]:
    """A client of a real server on loopback."""
    settings = load_settings(
        database=f"sqlite:///{folder}/jobs.db", workers=1, port=0, max_body_bytes=20_000, page_limit=50
    )
    app = create_app(settings, registry)
    service: Service = app.state.service
    listener = _bind(settings)
    service.open()
    server = _Server(_config(app, settings), service)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{listener.getsockname()[1]}", timeout=60.0) as client:
            until(lambda: server.started)
            until(lambda: client.get("/health/ready").status_code == 200, seconds=600.0)
            yield client
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The private kinds, shared by the tests of a module."""
    with serving(tmp_path_factory.mktemp("http"), PRIVATE) as client:
        yield client


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The kinds that come with the service, shared by the tests of a module."""
    with serving(tmp_path_factory.mktemp("shipped"), SHIPPED) as client:
        yield client


def until(condition: Callable[[], object], seconds: float = 20.0) -> None:
    """Wait for something; fail loudly if it does not happen."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f"{condition} did not come true within {seconds} s")
        time.sleep(0.005)


def pids(file: Path) -> list[int]:
    """Process numbers that the private kinds wrote, one for each attempt."""
    return [int(line) for line in file.read_text().split()] if file.exists() else []
