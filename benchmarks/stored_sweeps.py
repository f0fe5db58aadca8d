"""A database full of sweeps, for lists: rows as jobs leave them, without the arrays, which no list reads."""

from __future__ import annotations

import random
from datetime import timedelta
from typing import Any

from sqlalchemy import insert

from service.db import revisions
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobState, Sweep, SweepContact
from service.jobs.ids import new_id

_EACH = 10
_CHUNK = 1000
_SCENES = (("two-dof", ("damper",), 0.2, 2.5), ("bladed-disk", ("shroud", "root"), 500.0, 900.0))


def fill(url: str, sweeps: int) -> None:
    """Make the tables and store so many sweeps of two scenes, ten a job; the same ones every time."""
    revisions.upgrade(url)
    database = Database(url)
    chance = random.Random(1)
    try:
        for begun in range(0, sweeps, _CHUNK):
            jobs, rows, contacts = _chunk(chance, min(_CHUNK, sweeps - begun))
            with database.writing() as connection:
                connection.execute(insert(Job.metadata.tables["job"]), jobs)
                connection.execute(insert(Sweep.metadata.tables["sweep"]), rows)
                connection.execute(insert(SweepContact.metadata.tables["sweep_contact"]), contacts)
    finally:
        database.close()


def _chunk(chance: random.Random, sweeps: int) -> tuple[list[dict[str, Any]], ...]:
    jobs: list[dict[str, Any]] = []
    rows, contacts = [], []
    for number in range(sweeps):
        scene, names, low, high = _SCENES[chance.random() < 0.4]
        if number % _EACH == 0:
            jobs.append(_job(scene))
        row = _sweep(chance, scene, low, high) | {"job_id": jobs[-1]["id"], "position": number % _EACH}
        rows.append(row)
        for position, name in enumerate(names):
            load = chance.lognormvariate(5.0, 1.0)
            contacts.append({"sweep_id": row["id"], "name": name, "position": position, "kt": 1.0, "mu": 0.3,
                             "N0": load, "N1": 0.3 * load, "N1_phase": 0.0})  # fmt: skip
    return jobs, rows, contacts


def _job(scene: str) -> dict[str, Any]:
    now = utc_now() - timedelta(days=1.0)
    return {"id": new_id(), "kind": "map", "state": JobState.SUCCESSFUL, "scene_name": scene,
            "scene_hash": "0" * 64, "spec_hash": new_id(), "request_hash": "0" * 64, "attempt": 1,
            "max_attempts": 3, "progress": 1.0, "created": now, "started": now, "finished": now,
            "request": {}, "spec": {}}  # fmt: skip


def _sweep(chance: random.Random, scene: str, low: float, high: float) -> dict[str, Any]:
    peak = chance.lognormvariate(1.0, 0.6)
    return {"id": new_id(), "scene_name": scene, "scene_hash": "0" * 64, "parameter": "frequency",
            "from_value": low, "to_value": high, "excitation_amplitude": 1.0, "frequency_hz": None,
            "harmonics": chance.choice((5, 11, 21)), "points": chance.randint(80, 300), "peak": peak,
            "peak_at": chance.uniform(low, high), "limit": peak / 2.0, "band_hz": chance.expovariate(5.0),
            "newton_iterations": 300, "rejected_steps": 0, "seconds": chance.expovariate(50.0),
            "completed": True, "status": "complete", "created": utc_now()}  # fmt: skip
