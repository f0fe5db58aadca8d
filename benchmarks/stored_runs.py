"""A database full of runs: every list and filter of them, on SQLite and PostgreSQL."""

from __future__ import annotations

import itertools
import random
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import datetime, timedelta
from functools import partial
from os import environ
from pathlib import Path
from typing import Any

from sqlalchemy import insert, text

from benchmarks.harness import expect, table
from benchmarks.service_process import serving
from benchmarks.service_requests import beside, key_of, table_of
from benchmarks.service_workers import own_postgresql
from service.db import revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobState
from service.db.repositories.run_repository import Runs
from service.schemas.answers import newest
from service.schemas.workbench_answers import RunQuery
from service.settings.settings import load_settings

_CHUNK = 2_000
_DAYS = 300.0
_OWNER, _OTHERS = "most", 20
_KINDS = ("sweep", "design", "solve", "map", "modes", "march", "identify")
_KIND_SHARES = (50.0, 25.0, 15.0, 7.0, 2.0, 0.99, 0.01)
_STATES = (JobState.SUCCESSFUL, JobState.FAILED, JobState.DISMISSED)
_STATE_SHARES = (90.0, 9.9, 0.1)
_SCENES = ("two-dof", "bladed-disk", "platform-wedge", "shroud-3d", "own blade")
_TAGS = {"rig": 0.3, "stage 3": 0.3, "review": 0.03, "accepted": 0.01, "scrap": 0.0001}
_WORDS = (
    "shroud", "root", "wedge", "blade", "stage", "rig", "measured", "nominal", "worst", "hot", "cold",
    "Prüfstand", "May", "June", "load case", "resonance", "second try", "as built", "worn", "coated",
)  # fmt: skip


def fill(url: str, runs: int) -> datetime:
    """Make the tables and store so many runs, the same ones every time; the time of the first."""
    revisions.upgrade(url)
    database, chance, tables = Database(url), random.Random(1), Job.metadata.tables
    first = utc_now() - timedelta(days=_DAYS)
    try:
        for begin in range(0, runs, _CHUNK):
            made = [_run(chance, first + timedelta(days=_DAYS * number / runs)) for number in
                    range(begin, min(begin + _CHUNK, runs))]  # fmt: skip
            with database.writing() as connection:
                for position, name in enumerate(("job", "run", "run_tag")):
                    connection.execute(insert(tables[name]), [row for one in made for row in one[position]])
        if database.backend == "postgresql":
            with database.writing() as connection:
                connection.execute(text("ANALYZE"))
    finally:
        database.close()
    return first


def stored_runs() -> None:
    """Lists of RUNS stored runs (200 000 unless the variable says otherwise), the slowest of them."""
    runs, rows = int(environ.get("RUNS", "200000")), []
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        new_database = stack.enter_context(own_postgresql())
        for backend, url in (("SQLite", f"sqlite:///{folder}/jobs.db"), ("PostgreSQL", new_database())):
            begun = time.perf_counter()
            first = fill(url, runs)
            print(f"{backend}: stored in {time.perf_counter() - begun:.0f} s")
            times = timed(url, first)
            slowest = sorted(times.items(), key=lambda one: -one[1])[:12]
            slowest.append((f"median of {len(times)}", statistics.median(times.values())))
            rows += [(backend, name, f"{1e3 * seconds:.1f} ms") for name, seconds in slowest]
    table(f"A page of 100 of {runs} runs, the slowest lists", ("database", "list", "time"), rows)


_SEARCHES = (
    "/v1/runs?limit=100", "/v1/runs?text=shroud&limit=100", "/v1/runs?text=turbofan", "/v1/runs?text=qq",
    "/v1/runs?tag=review&tag=accepted", "/v1/runs?kind=march&status=failed", "/v1/jobs?limit=100",
    "/v1/runs?scene=own%20blade&kind=march", "/v1/runs?deleted=true",
)  # fmt: skip
_LOOKING = 4


def searches() -> None:
    """Another owner's requests while two keys list and search RUNS stored runs over four connections each."""
    runs, rows = int(environ.get("RUNS", "200000")), []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        new_database = stack.enter_context(own_postgresql())
        for backend, url in (("SQLite", f"sqlite:///{folder}/jobs.db"), ("PostgreSQL", new_database())):
            fill(url, runs)
            most, few, other = (key_of(url, owner) for owner in (_OWNER, "owner-3", "another"))
            with serving(url, workers=1, log=folder / "log", require_keys="true") as service:
                with service.client() as client:
                    for path, key in itertools.product(_SEARCHES, (most, few)):
                        expect(f"{path}: not answered 200", client.get(path, key).status == 200)
                looking = [(_LOOKING, _SEARCHES, key) for key in (most, few)]
                rows.append(beside(service, other, f"two keys at {runs} runs, {backend}", *looking))
            print(*rows[-1], flush=True)
    table_of(rows)


def timed(url: str, first: datetime) -> dict[str, float]:
    """The least time [s] of three of a page, for every list."""
    database, settings, times = Database(url), load_settings(), {}
    runs = Runs(database, utc_now, 30.0)
    try:
        for name, sees, query in _queries(first):
            spent = []
            for _ in range(3):
                begun = time.perf_counter()
                rows, _ = newest(query, settings, partial(runs.page, query.to_filter(sees)))
                spent.append(time.perf_counter() - begun)
            expect(f"{name}: runs of others", sees is None or all(row.owner == sees for row in rows))
            times[name] = min(spent)
    finally:
        database.close()
    return times


def _queries(first: datetime) -> Iterator[tuple[str, str | None, RunQuery]]:
    """Lists, each with its name and whose runs are seen."""
    some = {
        "all": {},
        "text of many": {"text": "shroud"},
        "text of many, 2 letters": {"text": "ro"},
        "text of few": {"text": "Number 1234 "},
        "text nowhere": {"text": "turbofan"},
        "text nowhere, 2 letters": {"text": "qq"},
        "text beyond ASCII": {"text": "prÜF"},
        "two tags of many": {"tag": ["rig", "stage 3"]},
        "two tags of few": {"tag": ["review", "accepted"]},
        "three tags": {"tag": ["rig", "stage 3", "scrap"]},
        "a tag nowhere": {"tag": ["rig", "nowhere"]},
        "a rare tag": {"tag": ["scrap"]},
        "in the bin": {"deleted": True},
    }
    some |= {f"kind {one}": {"kind": one} for one in _KINDS}
    some |= {f"kind {one} that failed": {"kind": one, "status": ["failed"]} for one in _KINDS}
    some |= {f"status {one.value}": {"status": [one.value]} for one in JobState}
    some |= {"scene nowhere": {"scene": "nowhere"}, "scene and kind": {"scene": "own blade", "kind": "march"}}
    for share in (0.001, 0.1, 0.5, 0.9, 0.999):
        when = first + timedelta(days=_DAYS * share)
        some[f"before {share:.1%}"] = {"created_before": when}
        some[f"after {share:.1%}"] = {"created_after": when}
        some[f"an hour from {share:.1%}"] = {
            "created_after": when,
            "created_before": when + timedelta(hours=1),
        }
        some[f"before {share:.1%}, rare kind"] = {"created_before": when, "kind": "identify"}
        some[f"before {share:.1%}, text nowhere"] = {"created_before": when, "text": "turbofan"}
        some[f"before {share:.1%}, two tags"] = {"created_before": when, "tag": ["rig", "stage 3"]}
    for name, words in some.items():
        for sees, whose in ((_OWNER, "most"), ("owner-3", "few"), (None, "all")):
            yield f"{name}, {whose}", sees, RunQuery(**words)  # type: ignore[arg-type]


def _run(chance: random.Random, created: datetime) -> tuple[list[dict[str, Any]], ...]:
    """Rows of the tables of a run."""
    [kind] = chance.choices(_KINDS, _KIND_SHARES)
    [state] = chance.choices(_STATES, _STATE_SHARES)
    owner = _OWNER if chance.random() < 0.6 else f"owner-{chance.randrange(_OTHERS)}"
    row_id = _id(chance, created)
    scene = chance.choice(_SCENES)
    job = {
        "id": row_id, "kind": kind, "state": state, "scene_name": scene, "scene_hash": "0" * 64,
        "spec_hash": row_id, "request_hash": "0" * 64, "owner": owner, "attempt": 1, "max_attempts": 3,
        "progress": 1.0, "request": {}, "spec": {},
        **dict.fromkeys(("created", "started", "finished"), created),
    }  # fmt: skip
    if chance.random() < 0.2:
        return [job], [], []
    said = " ".join(chance.choice(_WORDS) for _ in range(20))
    run = {
        "job_id": row_id, "project_id": None, "changed": created, "revision": 1, "notes": said,
        "name": f"{chance.choice(_WORDS)} number {chance.randrange(100_000)} of {scene}",
        "deleted": created if chance.random() < 0.01 else None,
    }  # fmt: skip
    tags = [{"job_id": row_id, "tag": tag} for tag, share in _TAGS.items() if chance.random() < share]
    return [job], [run], tags


def _id(chance: random.Random, created: datetime) -> str:
    """An id as `service.db.clock.new_id` made it then."""
    stamp, rest = int(created.timestamp() * 1e3), f"{chance.getrandbits(76):019x}"
    digits = f"{stamp:012x}7{rest[:3]}8{rest[4:]}"
    return "-".join(digits[i:j] for i, j in ((0, 8), (8, 12), (12, 16), (16, 20), (20, 32)))
