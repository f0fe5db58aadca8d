"""What the tests of the service share."""

import functools
import re
import tempfile
import threading
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

import solver
from service.db import revisions
from service.db.engine import Database
from service.db.models import Upload
from service.db.repositories import NewJob, UploadRepository
from service.http.app import create_app
from service.http.server import _bind, _config, _Server
from service.jobs.kind_registry import Registry
from service.queue.core import Service
from service.settings.settings import Settings, load_settings

PATIENCE = 120.0
"""How long to wait for what must happen [s]: far longer than it takes on a busy machine."""

MakeSettings = Callable[..., Settings]


@functools.cache
def _empty() -> bytes:
    """A SQLite file with tables and nothing in them: made once, as it takes a tenth of a second."""
    with tempfile.TemporaryDirectory() as folder:
        revisions.upgrade(f"sqlite:///{folder}/jobs.db")
        return Path(folder, "jobs.db").read_bytes()


def with_tables(folder: Path) -> str:
    """The address of a new database with its tables, a file in `folder`."""
    (folder / "jobs.db").write_bytes(_empty())
    return f"sqlite:///{folder}/jobs.db"


def settings_of(url: str) -> MakeSettings:
    """Makes the settings of a small service on a database."""

    def make(**values: object) -> Settings:
        defaults = {
            "database": url,
            "workers": 1,
            "port": 0,
            "grace_seconds": 0.3,
            "poll_seconds": 1.0,
            "answer_workers": 1,
        }
        return load_settings(**{**defaults, **values})

    return make


class Shipped:
    """The shipped scenes, without a database."""

    def scene_body(self, name: str) -> Mapping[str, object] | None:
        return solver.load_scene(name).to_dict() if name in solver.shipped_scenes() else None

    def with_uploads(self, body: Mapping[str, object]) -> Mapping[str, object]:
        return body


class ServedClient(httpx.Client):
    """A client that knows the application behind it."""

    def __init__(self, app: FastAPI, port: int) -> None:
        super().__init__(base_url=f"http://127.0.0.1:{port}", timeout=PATIENCE)
        self.application = app
        self.service: Service = app.state.service


def new_job(**values: object) -> NewJob:
    """A job to be inserted."""
    defaults = {
        "kind": "iteration",
        "request": {},
        "spec": {},
        "spec_hash": "0" * 64,
        "request_hash": "0" * 64,
        "max_attempts": 3,
        "fresh": True,
    }
    return NewJob(**{**defaults, **values})


@contextmanager
def serving(folder: Path, registry: Registry, **values: object) -> Iterator[ServedClient]:
    """A client of a real server on loopback."""
    defaults = {
        "database": with_tables(folder), "workers": 1, "port": 0, "max_body_bytes": 20_000,
        "page_limit": 50, "answer_workers": 1,
    }  # fmt: skip
    settings = load_settings(**{**defaults, **values})
    app = create_app(settings, registry)
    service: Service = app.state.service
    listener = _bind(settings)
    service.open()
    server = _Server(_config(app, settings), service)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        with ServedClient(app, listener.getsockname()[1]) as client:
            until(lambda: server.started)
            until(lambda: client.get("/health/ready").status_code == 200, seconds=600.0)
            yield client
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


def analyse(database: Database) -> None:
    """What PostgreSQL does by itself within a minute of so many new rows, in the tests at once."""
    if database.backend == "postgresql":
        with closing(database.own_connection()) as connection:
            connection.execute("VACUUM ANALYZE")


def is_problem(response: httpx.Response, status: int) -> dict:
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    body = response.json()
    assert list(body) == ["type", "title", "status", "detail", "instance", "errors"]
    assert body["status"] == status
    assert body["detail"]
    assert body["instance"] == response.request.url.path
    return body


def job_ids(client: httpx.Client) -> list[str]:
    return [job["id"] for job in client.get("/v1/jobs").json()["items"]]


def promptly(trial: Callable[[], float], seconds: float, tries: int = 5) -> None:
    """A trial gives the time that it took [s]; one of some takes less than `seconds`.

    What waits by design does so in every trial, and other work on the machine hardly in all of them.
    """
    took: list[float] = []
    while not took or took[-1] >= seconds:
        assert len(took) < tries, f"took {took} s, never less than {seconds} s"
        took.append(trial())


def until(condition: Callable[[], object], seconds: float = PATIENCE) -> None:
    """Wait for something; fail loudly if it does not happen."""
    end, pause = time.monotonic() + seconds, 0.002
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f"{condition} did not come true within {seconds} s")
        time.sleep(pause)
        pause = min(1.2 * pause, 0.05)  # not to take from what is waited for


def pids(file: Path) -> list[int]:
    """Process numbers that the private kinds wrote, one for each attempt."""
    return [int(line) for line in file.read_text().split()] if file.exists() else []


def pdf_objects(pdf: bytes) -> bytes:
    """What stands in the compressed streams of a PDF."""
    streams = re.findall(rb"stream\r?\n(.*?)\nendstream", pdf, re.DOTALL)
    # What is behind a stream may be the first half of a line end.
    return b"\n".join(zlib.decompressobj().decompress(one) for one in streams if one.startswith(b"x"))


def within(value: float | None, query: dict[str, Any], name: str) -> bool:
    """Whether a value meets the range that a query has for a name."""
    low, high = query.get(f"{name}_min"), query.get(f"{name}_max")
    if low is None and high is None:
        return True
    return value is not None and (low is None or value >= low) and (high is None or value <= high)


def listed(page_of: Callable[..., Any], repository: object, asked: Any) -> list[Any]:
    """The items of all pages of a query."""
    found: list[Any] = []
    while True:
        page = page_of(repository, asked, load_settings())
        found += page.items
        if page.next is None:
            return found
        asked = asked.model_copy(update={"cursor": page.next.rpartition("cursor=")[2]})


def in_order(
    records: dict[Any, Any], sort: str, columns: dict[str, str], meets: Callable[[Any], bool]
) -> list[Any]:
    """The keys of the records that meet a query, sorted as it asks; of what was created first, the least."""
    name = sort.removeprefix("-")

    def value(record: Any) -> Any:
        return 0.0 if name == "created" else getattr(record, columns.get(name, name))

    wanted = [key for key, record in records.items() if meets(record) and value(record) is not None]
    return sorted(wanted, key=lambda key: (value(records[key]), key), reverse=sort.startswith("-"))


def stored_upload(uploads: UploadRepository, data: bytes, **said: Any) -> tuple[Upload, bool]:
    """Store a file, of which `said` has owner, name, format and digest."""
    with uploads.files.work() as folder:
        file = folder / "file"
        file.write_bytes(data)
        return uploads.add(file, Upload(size=len(data), **said))
