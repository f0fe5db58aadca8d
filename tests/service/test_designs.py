"""Stored designs are there to be queried."""

import json
import random
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa
from alembic import command
from service_helpers import analyse, in_order, is_problem, listed, within
from sqlalchemy import Connection, func, insert, inspect, select

import optim
import solver
from service.client.client import Client
from service.db import revisions
from service.db.clock import new_id, utc_now
from service.db.engine import Database, migrating
from service.db.models import Job, JobState, TableBase
from service.db.repositories import ResultRepository
from service.db.repositories.result_repository import insert_results
from service.errors import InvalidRequestError
from service.jobs.common.sweep_records import design_record
from service.jobs.stored_figures import DESIGN, DesignRecord, VariableValues
from service.jobs.strict_json import validated
from service.schemas.answers import DesignDetail
from service.schemas.result_queries import DesignQuery, design_page
from service.settings.settings import load_settings

WAIT = {"Prefer": "wait=60"}
ONE = DesignRecord(
    scene_name="disk", scene_hash="0" * 64, method="minimax", robust=False, reached=True, feasible=True,
    status="done", objective=1.0, peak=1.0, peak_at=750.0, limit=0.5, band_hz=30.0, harmonics=11,
    evaluations=12, work=12.0, seconds=0.3,
)  # fmt: skip


def variable(name: str, value: float | None) -> VariableValues:
    return VariableValues(name=name, value=value, low=0.0, high=1000.0)


def random_design(generator: random.Random) -> DesignRecord:
    names = generator.choice((("damper.N0",), ("shroud.N0", "root.kt"), ("shroud.N0,root.N0",)))
    peak = generator.choice((generator.lognormvariate(0.0, 1.0), 1.0, None))
    return replace(
        ONE,
        scene_name=generator.choice(("disk", "two", "three")),
        method=generator.choice(("minimax", "ipopt", "tracked")),
        robust=generator.random() < 0.1,
        reached=generator.random() < 0.9,
        feasible=generator.random() < 0.95,
        peak=peak,
        objective=peak,
        band_hz=generator.choice((None, generator.uniform(0.0, 100.0))),
        work=generator.uniform(2.0, 60.0),
        seconds=generator.uniform(0.0, 1.0),
        variables=tuple(variable(n, None if peak is None else generator.uniform(0.0, 1000.0)) for n in names),
    )


def fill(database: Database, records: list[DesignRecord]) -> list[str]:
    ids = [new_id() for _ in records]
    with database.writing() as connection:
        for name, record in zip(ids, records, strict=True):
            connection.execute(
                insert(Job).values(
                    id=name, kind="design", state=JobState.SUCCESSFUL, spec_hash="", request_hash="",
                    max_attempts=1, created=utc_now(), request={}, spec={},
                )
            )  # fmt: skip
            insert_results(connection, name, [record], utc_now())
    return ids


Filled = tuple[Database, dict[str, DesignRecord]]


@pytest.fixture(scope="module")
def filled(module_database: Database) -> Filled:
    generator = random.Random(7)
    records = [random_design(generator) for _ in range(400)]
    return module_database, dict(zip(fill(module_database, records), records, strict=True))


def meets(record: DesignRecord, query: dict[str, Any]) -> bool:
    """The same conditions in plain Python."""
    same = {"scene": "scene_name", "method": "method", "reached": "reached", "robust": "robust"}
    ranges = {"peak": "peak", "band": "band_hz", "work": "work"}
    values = [v.value for v in record.variables if query.get("variable") in (None, v.name)]
    return (
        all(getattr(record, column) == query[name] for name, column in same.items() if name in query)
        and all(within(getattr(record, column), query, name) for name, column in ranges.items())
        and any(within(value, query, "value") for value in values)
    )


@pytest.mark.few(3)
@pytest.mark.parametrize(
    "query",
    [
        {},
        {"scene": "two", "reached": True},
        {"scene": "nothing"},
        {"scene": "disk", "peak_max": 0.5, "sort": "peak"},
        {"variable": "damper.N0", "peak_max": 1.0, "sort": "-peak"},
        {"variable": "damper.N0", "value_min": 100.0, "value_max": 200.0},
        {"variable": "shroud.N0,root.N0", "sort": "created"},
        {"variable": "nothing"},
        {"value_min": 900.0, "sort": "work"},
        {"band_max": 20.0, "sort": "band", "reached": False},
        {"peak_min": 1.0, "peak_max": 1.0, "sort": "-seconds"},
        {"method": "ipopt", "robust": True, "sort": "-objective"},
        {"work_min": 50.0, "work_max": 51.0, "sort": "-work"},
    ],
)
def test_filters_sorts_and_pages(filled: Filled, query: dict[str, Any]) -> None:
    database, records = filled
    found = listed(design_page, ResultRepository(database), DesignQuery(**{"limit": 37, **query}))
    sort, columns = query.get("sort", "-created"), {"band": "band_hz"}
    wanted = in_order(records, sort, columns, lambda record: meets(record, query))
    assert [item.id for item in found] == wanted


def test_a_design_is_answered_as_it_was_stored(filled: Filled) -> None:
    database, records = filled
    page = design_page(ResultRepository(database), DesignQuery(limit=50), load_settings())
    for item in page.items:
        record = records[item.id]
        assert (item.scene, item.reached, item.band_hz) == (record.scene_name, record.reached, record.band_hz)
        assert (item.peak is None) == (record.peak is None)
        assert list(item.variables) == [v.name for v in record.variables]
        assert [v.value for v in item.variables.values()] == [v.value for v in record.variables]


@pytest.mark.parametrize("bad", [{"colour": "red"}, {"sort": "colour"}, {"limit": 0}, {"peak_max": "high"}])
def test_an_unknown_filter_is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidRequestError, match=next(iter(bad))):
        validated(DesignQuery, bad)


def test_a_cursor_that_is_none(filled: Filled) -> None:
    with pytest.raises(InvalidRequestError, match="must come from the `next` link"):
        design_page(ResultRepository(filled[0]), DesignQuery(cursor="W10"), load_settings())


PROBLEM: dict[str, Any] = {
    "scene": "two-dof",
    "set": {"damper.mu": 0.28},
    "variables": {"damper.N0": [20, 1000]},
    "cases": [{"name": "all"}, {"name": "low", "band": [0.4, 1.6], "weight": 0.9}],
    "limit": 2.0,
    "max_band_hz": 0.3,
    "contact_states": {"damper": "never-separates"},
    "harmonics": 3,
}


@pytest.fixture(scope="module")
def designed(shipped: httpx.Client) -> dict[str, Any]:
    answer = shipped.post("/v1/designs", json=PROBLEM, headers=WAIT)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_same_problem_has_the_same_optimum_in_python_rest_and_the_command(
    designed: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from service.cli import main

    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    assert main(["design", "--problem", str(tmp_path / "problem.json"), "--json"]) == 0
    by_command = json.loads(capsys.readouterr().out)
    keys = {key: value for key, value in PROBLEM.items() if key not in ("scene", "set")}
    by_python = optim.design(solver.load_scene("two-dof").with_values(PROBLEM["set"]), **keys)
    assert by_python.reached
    for answer in (by_command, designed["result"]):
        assert answer["optimum"]["damper.N0"] == pytest.approx(by_python.optimum["damper.N0"], rel=1e-12)
        assert answer["objective"] == pytest.approx(by_python.to_json()["objective"], rel=1e-12)
        assert [row["case"] for row in answer["rows"] if row["quantity"] == "band"] == ["all", "low"]


def test_a_finished_design_is_stored_whole(shipped: httpx.Client, designed: dict[str, Any]) -> None:
    answer = shipped.get(designed["links"]["design"])
    found, result = answer.json(), designed["result"]
    assert found["result"] == result
    assert found["problem"]["max_band_hz"] == PROBLEM["max_band_hz"]
    assert (found["scene"], found["reached"], found["feasible"]) == ("two-dof", True, True)
    assert found["peak"] == result["peak"]
    assert found["objective"] == result["objective"]
    assert found["work"] == result["work"]
    optimum = result["optimum"]["damper.N0"]
    assert found["variables"] == {"damper.N0": {"value": optimum, "low": 20.0, "high": 1000.0}}
    tag = answer.headers["ETag"]
    assert tag.startswith('"')
    same = shipped.get(designed["links"]["design"], headers={"If-None-Match": f'"other", {tag}'})
    assert (same.status_code, same.content, same.headers["ETag"]) == (304, b"", tag)
    again = shipped.post("/v1/designs", json=PROBLEM).json()
    assert shipped.get(f"/v1/designs/{again['id']}").json() == found, (
        "the same asked again is the same design"
    )


def test_stored_designs_are_listed_over_http(shipped: httpx.Client, designed: dict[str, Any]) -> None:
    query = {"scene": "two-dof", "variable": "damper.N0", "peak_max": 3, "band_max": 1, "reached": "true"}
    items = shipped.get("/v1/designs", params={**query, "sort": "peak"}).json()["items"]
    assert designed["id"] in [item["id"] for item in items]
    assert shipped.get("/v1/designs", params={**query, "peak_max": 1e-3}).json() == {
        "items": [],
        "next": None,
    }
    with Client(str(shipped.base_url)) as client:
        assert [one.id for one in client.designs(**query, limit=1)] == [item["id"] for item in items[::-1]]
        assert isinstance(client.design(designed["id"]), DesignDetail)
    problem = is_problem(shipped.get("/v1/designs", params={"colour": "red"}), 422)
    assert problem["errors"][0]["pointer"] == "/colour"
    is_problem(shipped.get("/v1/designs/nobody"), 404)
    march = shipped.post(
        "/v1/jobs", json={"kind": "solve", "scene": "two-dof", "frequency_hz": 1}, headers=WAIT
    )
    is_problem(shipped.get(f"/v1/designs/{march.json()['id']}"), 404)


def test_a_design_that_breaks_its_limit_is_stored_as_that() -> None:
    result = optim.design(
        solver.load_scene("two-dof"), variables={"damper.N0": (90.0, 110.0)}, limit=1.0, max_band_hz=0.01,
        harmonics=3,
    )  # fmt: skip
    record = design_record(result)
    assert (record.reached, record.feasible) == (False, False)
    assert record.variables[0].value == result.optimum["damper.N0"]


OLD = {
    "scene": "two-dof", "optimum": {"damper.N0": 104.5}, "peak": {"value": 2.35, "at": 1.04},
    "peaks": [{"value": 2.35, "at": 1.04}], "band_hz": 0.2, "limit": 1.66, "evaluations": 9, "seconds": 0.4,
    "active": ["peak at 1.04 Hz"], "multipliers": [1.0], "optimality": 1e-9, "reached": True,
    "status": "The highest peak can not be lowered further within the bounds.",
}  # fmt: skip


_result = TableBase.metadata.tables["job_result"]
_LATER = {"owner", "seconds_limit"}  # columns that the first revision had not
_job = sa.table(
    "job",
    *(sa.column(c.name, c.type) for c in TableBase.metadata.tables["job"].columns if c.name not in _LATER),
)
BEGIN = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
END = BEGIN + timedelta(seconds=1.5)


def old_job(
    connection: Connection, name: str, kind: str, spec: dict[str, Any], body: dict[str, Any] | None,
    finished: datetime | None = END,
) -> None:  # fmt: skip
    state = JobState.SUCCESSFUL if body is not None else JobState.DISMISSED
    connection.execute(
        insert(_job).values(
            id=name, kind=kind, state=state, scene_name="two-dof", scene_hash="abc", spec_hash="",
            request_hash="", attempt=1, max_attempts=3, progress=1.0,
            priority=0, points=0, cancel_requested=False, created=BEGIN, finished=finished,
            request={}, spec=spec,
        )
    )  # fmt: skip
    if body is not None:
        connection.execute(insert(_result).values(job_id=name, body=body))


@pytest.mark.usefixtures("earlier")
@pytest.mark.few(2)
def test_the_designs_of_an_old_database_are_filled_in_and_can_be_taken_back(url: str) -> None:
    revisions.upgrade(url, "0001")
    spec = {"variables": {"damper.N0": [20.0, 1000.0]}, "limit": None, "max_band_hz": None, "harmonics": 7}
    new = {**OLD, "method": "ipopt", "objective": 3.5, "work": 14.0, "conditions": {"violation": 0.0}}
    with migrating(url) as connection:
        old_job(connection, "a", "design", spec, OLD)
        old_job(connection, "b", "design", {**spec, "max_band_hz": 0.1}, {**OLD, "reached": False})
        old_job(connection, "c", "design", spec, {**OLD, "optimum": {}, "peak": None, "reached": False})
        old_job(connection, "d", "design", spec, None)
        old_job(connection, "e", "sweep", {}, {"points": 3})
        old_job(connection, "f", "design", {**spec, "max_band_hz": 0.1}, new)
        for number in range(450):
            old_job(connection, f"g{number:03d}", "design", spec, OLD, None)
    assert revisions.upgrade(url) == revisions.head_revision()
    database = Database(url)
    repository = ResultRepository(database)
    rows = {row.job_id: row for row, _ in repository.page(DesignQuery().to_filter(DESIGN), 1000)}
    variables = {name: list(row.variables) for name, row in rows.items()}
    database.close()
    assert len(rows) == 4 + 450
    first = rows["a"]
    assert (first.method, first.objective, first.peak, first.peak_at) == ("minimax", 2.35, 2.35, 1.04)
    assert (first.harmonics, first.evaluations, first.scene_hash) == (7, 9, "abc")
    assert first.created.isoformat() == "2026-01-02T03:04:06.500000+00:00"
    assert rows["g449"].created.isoformat() == "2026-01-02T03:04:05+00:00"
    assert variables["a"] == [VariableValues(name="damper.N0", value=104.5, low=20.0, high=1000.0)]
    assert [rows[name].feasible for name in "abcf"] == [True, False, False, True]
    assert (rows["c"].peak, variables["c"][0].value) == (None, None)
    assert (rows["f"].method, rows["f"].objective, rows["f"].work) == ("ipopt", 3.5, 14.0)

    config = revisions._config()
    with migrating(url) as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0001")
    with migrating(url) as connection:
        assert not set(inspect(connection).get_table_names()) & {"design", "design_variable"}
        assert connection.execute(select(func.count()).select_from(_result)).scalar_one() == 455
    assert revisions.upgrade(url) == revisions.head_revision()


@pytest.mark.long
def test_twenty_thousand_designs_are_listed_within_50_ms(database: Database) -> None:
    generator = random.Random(1)
    fill(database, [random_design(generator) for _ in range(20_000)])
    analyse(database)
    repository, settings = ResultRepository(database), load_settings()
    for query in (
        {}, {"scene": "disk", "peak_max": 0.05}, {"variable": "damper.N0", "value_max": 1.0},
        {"variable": "damper.N0", "sort": "peak"}, {"reached": False, "sort": "-work"}, {"peak_min": 1e9},
    ):  # fmt: skip
        times = []
        for _ in range(5):
            begin = time.perf_counter()
            design_page(repository, DesignQuery(**query), settings)
            times.append(time.perf_counter() - begin)
        assert min(times) < 0.05, query
