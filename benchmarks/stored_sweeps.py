"""A database full of sweeps, for lists: rows as jobs leave them, without the arrays, which no list reads."""

from __future__ import annotations

import random
import statistics
import tempfile
import time
from datetime import timedelta
from typing import Any

from sqlalchemy import insert, text

from benchmarks.harness import expect, table
from service.db import revisions
from service.db.clock import new_id, utc_now
from service.db.engine import Database
from service.db.models import Job, JobState
from service.db.repositories import ResultRepository
from service.db.repositories.result_repository import insert_results
from service.jobs.kinds import SHIPPED
from service.jobs.stored_figures import SWEEP, ContactValues, SweepRecord, part_names, quantities_of_record
from service.schemas.result_queries import ResultQuery, result_page
from service.settings.settings import load_settings

_EACH = 10
_CHUNK = 1000
_SCENES = (("two-dof", ("damper",), 0.2, 2.5), ("bladed-disk", ("shroud", "root"), 500.0, 900.0))
_SWEEPS = 100_000
_SHARES = (0.001, 0.03, 0.3, 0.9)


def fill(url: str, sweeps: int) -> None:
    """Make the tables and store so many sweeps of two scenes, ten a job; the same ones every time."""
    revisions.upgrade(url)
    database = Database(url)
    chance = random.Random(1)
    try:
        for _ in range(0, sweeps, _CHUNK):
            with database.writing() as connection:
                for _ in range(0, _CHUNK, _EACH):
                    found = _SCENES[chance.random() < 0.4]
                    job = _job(found[0])
                    connection.execute(insert(Job.metadata.tables["job"]), job)
                    records = [_sweep(chance, *found) for _ in range(_EACH)]
                    insert_results(connection, job["id"], records, utc_now())
        if database.backend == "postgresql":
            with database.writing() as connection:
                connection.execute(text("ANALYZE"))
    finally:
        database.close()


def figures() -> None:
    """Every filter and order of 100 000 stored sweeps, on SQLite."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/jobs.db"
        fill(url, _SWEEPS)
        times = timed(url)
    slowest = sorted(times.items(), key=lambda one: -one[1])[:10]
    table(
        f"A page of 100 of {_SWEEPS} sweeps, the slowest ten of {len(times)} lists",
        ("list", "CPU"),
        [(name, f"{1e3 * seconds:.1f} ms") for name, seconds in slowest],
    )
    print(f"Median {1e3 * statistics.median(times.values()):.1f} ms; wanted 150 ms for each.")


def timed(url: str) -> dict[str, float]:
    """The least CPU time [s] of three of a page, for every figure as a filter, an order, and both."""
    database, settings = Database(url), load_settings()
    repository, times = ResultRepository(database), {}
    with database.reading() as connection:
        held = connection.execute(text(_HELD)).all()
    for name, query in _queries({name: sorted(one.value for one in held if one.name == name)
                                 for name in {one.name for one in held}}):  # fmt: skip
        spent = []
        for _ in range(3):
            begun = time.process_time()
            page = result_page(repository, ResultQuery(of=SWEEP, **query), SHIPPED, settings)
            spent.append(time.process_time() - begun)
        expect("a page of sweeps", all(one.of == SWEEP for one in page.items))
        times[name] = min(spent)
    database.close()
    return times


_HELD = "SELECT name, value FROM figure JOIN quantity ON quantity.id = figure.quantity WHERE result % 20 = 0"


def _queries(values: dict[str, list[float]]) -> list[tuple[str, dict[str, Any]]]:
    """Lists, each with its name: ranges that leave some share of the sweeps, in several orders."""
    own = [name for name, one in quantities_of_record(SweepRecord).items() if one.kind in (int, float)]
    found: list[tuple[str, dict[str, Any]]] = [("all", {}), ("parameter", {"parameter": "frequency"})]
    for name in (one for one in (*own, *part_names(SweepRecord)) if one in values):
        if name in own:
            found += [(f"by {word}{name}", {"sort": f"{word}{name}"}) for word in ("", "-")]
        for share in _SHARES:
            most = {f"{name}_max": values[name][int(share * (len(values[name]) - 1))]}
            for sort in ("-created", "peak", "-points"):
                found.append((f"{share:.1%} by {name}, sort {sort}", {**most, "sort": sort}))
        both = {f"{name}_min": values[name][len(values[name]) // 2], "scene": "two-dof", "completed": True}
        found.append((f"half by {name}, one scene, completed", {**both, "sort": "-peak"}))
    return found


def _job(scene: str) -> dict[str, Any]:
    now = utc_now() - timedelta(days=1.0)
    return {"id": new_id(), "kind": "map", "state": JobState.SUCCESSFUL, "scene_name": scene,
            "scene_hash": "0" * 64, "spec_hash": new_id(), "request_hash": "0" * 64, "attempt": 1,
            "max_attempts": 3, "progress": 1.0, "created": now, "started": now, "finished": now,
            "request": {}, "spec": {}}  # fmt: skip


def _sweep(
    chance: random.Random, scene: str, contacts: tuple[str, ...], low: float, high: float
) -> SweepRecord:
    peak, loads = chance.lognormvariate(1.0, 0.6), [chance.lognormvariate(5.0, 1.0) for _ in contacts]
    return SweepRecord(
        scene_name=scene, scene_hash="0" * 64, parameter="frequency", from_value=low, to_value=high,
        excitation_amplitude=1.0, frequency_hz=None, harmonics=chance.choice((5, 11, 21)),
        points=chance.randint(80, 300), peak=peak, peak_at=chance.uniform(low, high), limit=peak / 2.0,
        band_hz=chance.expovariate(5.0), newton_iterations=300, rejected_steps=0,
        seconds=chance.expovariate(50.0), completed=True, status="complete",
        contacts=tuple(
            ContactValues(name=name, kt=1.0, mu=0.3, N0=load, N1=0.3 * load, N1_phase=0.0)
            for name, load in zip(contacts, loads, strict=True)
        ),
    )  # fmt: skip
