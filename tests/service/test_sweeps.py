"""Stored sweeps are there to be queried."""

import random
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from each import each
from private_kinds import A_SWEEP
from service_helpers import analyse, promptly

from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import NOBODY
from service.db.repositories import JobRepository, NewJob, ResultRepository
from service.db.repositories.result_repository import insert_results
from service.errors import InvalidRequestError
from service.jobs.outputs import JobOutput
from service.jobs.stored_figures import SWEEP, ContactValues, StoredArray, SweepRecord
from service.jobs.strict_json import validated
from service.schemas.answers import SweepDetail
from service.schemas.result_queries import SweepQuery, sweep_page
from service.settings.settings import load_settings

ONE = replace(A_SWEEP, scene_name="disk", harmonics=11, points=100, limit=0.5, band_hz=0.1, status="done")

NEW = NewJob(kind="sweep", request={}, spec={}, spec_hash="", request_hash="", max_attempts=1, fresh=True)


def contact(name: str, load: float | None) -> ContactValues:
    return ContactValues(name=name, kt=1e6, mu=0.3, N0=load, N1=0.0, N1_phase=0.0)


def random_sweep(generator: random.Random) -> SweepRecord:
    names = generator.choice((("damper",), ("shroud", "root")))
    return replace(
        ONE,
        scene_name=generator.choice(("disk", "two", "three")),
        parameter=generator.choice(("frequency", "frequency", "damper.N0")),
        harmonics=generator.choice((5, 7, 11)),
        points=generator.randint(50, 500),
        peak=generator.choice((generator.lognormvariate(0.0, 1.0), 1.0, None)),
        peak_at=generator.uniform(1.0, 2.0),
        band_hz=generator.choice((None, generator.uniform(0.0, 1.0))),
        seconds=generator.uniform(0.0, 1.0),
        completed=generator.random() < 0.9,
        contacts=tuple(contact(name, generator.uniform(0.0, 1000.0)) for name in names),
    )


def test_a_range_is_met_by_one_contact_alone(database: Database) -> None:
    jobs, repository = JobRepository(database), ResultRepository(database)
    new = NewJob(kind="sweep", request={}, spec={}, spec_hash="", request_hash="", max_attempts=1, fresh=True)
    jobs.submit(new, queue_limit=10)
    attempt = jobs.claim("me", utc_now())
    assert attempt is not None
    two = replace(ONE, contacts=(contact("shroud", 10.0), contact("root", 1000.0)))
    mean = StoredArray.of(np.array([1.0, np.nan]))
    swept = replace(ONE, contacts=(contact("shroud", None),), arrays={"mean": mean})
    assert jobs.succeed(attempt, JobOutput(result={}, sweeps=(two, swept)))

    def found(**query: Any) -> int:
        return len(sweep_page(repository, SweepQuery(**query), load_settings()).items)

    assert found(N0_min=5, N0_max=20) == 1
    assert found(N0_min=20, N0_max=900) == 0, "10 and 1000 do not make one contact in between"
    assert found(N0_min=900, contact="shroud") == 0
    assert found(N0_min=900, contact="root", kt_min=1e6, mu_max=0.3) == 1
    assert found(N0_max=1e9) == 1, "a load that was swept has no single value"
    assert found() == 2
    [whole] = [
        row for row, _ in repository.page(SweepQuery().to_filter(SWEEP), 10) if repository.arrays(row.id)
    ]
    assert SweepDetail.load(whole, repository).arrays == {"mean": [1.0, None]}


@each(
    "cursor", ["", "x", "eA", "W10", "WzEsMl0", "W3RydWUsICJhIl0", "W051bGwsICJhIl0", "é", "WyJhIiwgImEiXQ"]
)
def test_a_cursor_that_is_none(module_database: Database, cursor: str) -> None:
    with pytest.raises(InvalidRequestError, match="must come from the `next` link"):
        sweep_page(ResultRepository(module_database), SweepQuery(cursor=cursor), load_settings())


def test_an_unknown_filter_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="`colour` is not a known key"):
        validated(SweepQuery, {"colour": "red"})


QUERIES: tuple[dict[str, Any], ...] = (
    {},
    {"scene": "disk", "peak_max": 0.05},
    {"peak_max": 0.02},
    {"peak_min": 1e9},
    {"points_min": 100},
    {"N0_min": 100.0, "N0_max": 101.0},
    {"N0_min": 100.0, "N0_max": 700.0, "contact": "root", "sort": "peak"},
    {"N0_min": 500.0, "N0_max": 540.0, "contact": "shroud", "sort": "peak"},
    {"band_hz_max": 0.001, "sort": "band_hz"},
    {"harmonics": 7, "sort": "-peak"},
)
OWNERS = {"old": 3000, "few": 500, NOBODY: 90_000, "one": 1, "others": 6499}


@pytest.mark.long
def test_a_hundred_thousand_sweeps_are_listed_within_50_ms(database: Database) -> None:
    generator = random.Random(1)
    for owner, count in OWNERS.items():
        job, _ = JobRepository(database).submit(replace(NEW, owner=owner), queue_limit=10)
        for begin in range(0, count, 2000):
            records = [random_sweep(generator) for _ in range(min(2000, count - begin))]
            with database.writing() as connection:
                insert_results(connection, job.id, records, utc_now(), owner)
    analyse(database)
    for owner in (*OWNERS, "nothing", None):
        for query in QUERIES:
            promptly(partial(listing_seconds, database, owner, query), 0.05)


def listing_seconds(database: Database, owner: str | None, query: dict[str, Any]) -> float:
    repository, settings = ResultRepository(database), load_settings()
    begin = time.perf_counter()
    found = sweep_page(repository, SweepQuery(**query), settings, owner)
    took = time.perf_counter() - begin
    assert owner is None or all(one.owner == owner for one in found.items)
    return took
