import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import earlier_revisions
import httpx
import pytest
from postgresql_cluster import Cluster, binaries
from private_kinds import PRIVATE
from service_helpers import MakeSettings, serving, settings_of, with_tables

from service.client.embedded import EmbeddedService
from service.db.engine import Database
from service.jobs.kinds import SHIPPED
from service.workers import processes

BACKENDS = ("sqlite", "postgresql")


@pytest.fixture(scope="session")
def cluster() -> Iterator[Cluster]:
    """A PostgreSQL server for the session."""
    programs = binaries()
    if programs is None:
        pytest.skip("PostgreSQL's server is not installed (Debian's package `postgresql`)")
    with Cluster(programs) as running:
        yield running


@pytest.fixture
def earlier() -> Iterator[None]:
    """Databases go by the revisions of before the first release."""
    with earlier_revisions.known():
        yield


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of a few megabytes."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small disk can be mounted by root only")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.fixture
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are read by a thread of this process: for many refusals, each of which would start a reader."""

    def start(target: Callable[..., None], args: tuple[Any, ...], name: str) -> SimpleNamespace:
        theirs = Connection(os.dup(args[0].fileno()), readable=False)
        thread = threading.Thread(target=target, args=(theirs, *args[1:]), name=name)
        thread.start()
        return SimpleNamespace(kill=int, join=thread.join, close=theirs.close, status=int)

    monkeypatch.setattr(processes, "start", start)
    monkeypatch.setattr(processes, "limit_process", lambda *_: None)
    monkeypatch.chdir(Path.cwd())  # the reader goes to the folder of the files; back afterwards


@pytest.fixture(params=BACKENDS)
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A database without tables, of either kind."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path}/jobs.db"
        return
    with request.getfixturevalue("cluster").database() as made:
        yield made


@pytest.fixture(scope="module", params=BACKENDS)
def lasting(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[EmbeddedService]:
    """A service with the private kinds, shared by the tests of a module that leave no job behind."""
    with ExitStack() as stack:
        if request.param == "sqlite":
            url = with_tables(tmp_path_factory.mktemp("lasting"))
        else:
            url = stack.enter_context(request.getfixturevalue("cluster").database())
        yield stack.enter_context(EmbeddedService(settings_of(url)(), PRIVATE))


@pytest.fixture(params=BACKENDS)
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """A database with its tables, of either kind."""
    with migrated(request, tmp_path) as made:
        yield made


@pytest.fixture(scope="module", params=BACKENDS)
def module_database(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Database]:
    """The same, shared by the tests of a module."""
    with migrated(request, tmp_path_factory.mktemp("database")) as made:
        yield made


@contextmanager
def migrated(request: pytest.FixtureRequest, folder: Path) -> Iterator[Database]:
    if request.param == "sqlite":
        database = Database(with_tables(folder))
        yield database
        database.close()
        return
    with request.getfixturevalue("cluster").database(empty=False) as url:
        database = Database(url)
        yield database
        database.close()


@pytest.fixture
def make_settings(tmp_path: Path) -> MakeSettings:
    """Makes the settings of a service on SQLite."""
    return settings_of(f"sqlite:///{tmp_path}/jobs.db")


@pytest.fixture
def embedded(make_settings: MakeSettings) -> Iterator[EmbeddedService]:
    with EmbeddedService(make_settings(), PRIVATE) as service:
        yield service


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The private kinds, shared by the tests of a module."""
    with serving(tmp_path_factory.mktemp("http"), PRIVATE) as client:
        yield client


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The kinds that come with the service, shared by the tests of a module."""
    # Bodies as large as a service takes by itself: a disk is a megabyte of matrices.
    with serving(tmp_path_factory.mktemp("shipped"), SHIPPED, max_body_bytes=4_000_000) as client:
        yield client
