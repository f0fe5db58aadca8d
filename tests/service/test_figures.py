"""Every stored result is listed by any of its figures, as a plain filter over all of them would."""

import random
from dataclasses import fields, replace
from typing import Any, get_args

import pytest
from each import each
from private_kinds import A_SWEEP, PRIVATE
from pydantic import BaseModel, Field
from service_helpers import ServedClient, is_problem, listed, within

from service.auth.callers import KEYLESS
from service.client.embedded import EmbeddedService
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.repositories import JobRepository, NewJob, ResultRepository
from service.db.repositories.result_repository import insert_results
from service.errors import InvalidRequestError
from service.jobs.kinds import SHIPPED
from service.jobs.stored_figures import (
    ContactValues,
    FigureValue,
    SweepRecord,
    figures,
    quantities_of_model,
    quantities_of_record,
)
from service.schemas.answers import StoredResult
from service.schemas.result_queries import ResultQuery, SweepQuery, result_page, sweep_page
from service.settings.settings import load_settings

NEW = NewJob(kind="sweep", request={}, spec={}, spec_hash="", request_hash="", max_attempts=1, fresh=True)
OWNERS = ("", "alice", "bob")
PARTS = ("kt", "mu", "N0", "N1", "N1_phase")
NUMBERS = [name for name, one in quantities_of_record(SweepRecord).items() if one.kind in (int, float)]
TRUTHS = [name for name, one in quantities_of_record(SweepRecord).items() if one.kind is bool]

# What `/v1/sweeps` knows of them, beside `/v1/results`.
OF_SWEEPS = [name for name in (*NUMBERS, *PARTS) if f"{name}_max" in SweepQuery.model_fields]
SORTS = get_args(SweepQuery.model_fields["sort"].annotation)

Owned = tuple[str, SweepRecord]


def number(chance: random.Random) -> float | None:
    """Few values, so that many are equal; sometimes none."""
    return chance.choice((None, float(chance.randint(0, 9)), chance.uniform(0.0, 10.0)))


def random_sweep(chance: random.Random) -> SweepRecord:
    values: dict[str, Any] = {}
    for name, quantity in quantities_of_record(SweepRecord).items():
        if quantity.kind is float:
            values[name] = number(chance)
        elif quantity.kind is int:
            values[name] = chance.randint(0, 9)
        elif quantity.kind is bool:
            values[name] = chance.choice((True, False, None) if name == "peaks_known" else (True, False))
    for name in ("from_value", "to_value", "seconds"):
        values[name] = chance.uniform(0.0, 10.0)
    names = chance.sample(("damper", "shroud", "root"), chance.randint(0, 3))
    return replace(
        A_SWEEP,
        scene_name=chance.choice(("disk", "two", "three")),
        parameter=chance.choice(("frequency", "damper.N0", "speed")),
        contacts=tuple(ContactValues(name=n, **{key: number(chance) for key in PARTS}) for n in names),
        **values,
    )


@pytest.fixture(scope="module")
def filled(module_database: Database) -> tuple[Database, list[Owned]]:
    chance, known = random.Random(3), []
    for owner in (*OWNERS, ""):
        job, _ = JobRepository(module_database).submit(replace(NEW, owner=owner), queue_limit=99)
        records = [random_sweep(chance) for _ in range(100)]
        with module_database.writing() as connection:
            insert_results(connection, job.id, records, utc_now(), owner)
        known += [(owner, record) for record in records]
    return module_database, known


def random_query(chance: random.Random, of_sweeps: bool) -> dict[str, Any]:
    query: dict[str, Any] = {}
    for name in chance.sample(OF_SWEEPS if of_sweeps else (*NUMBERS, *PARTS), chance.choice((0, 1, 1, 2, 3))):
        low, high = sorted((chance.uniform(-1.0, 11.0), chance.choice((5.0, chance.uniform(0.0, 11.0)))))
        if of_sweeps and name == "points":
            low, high = (float(max(1, round(end))) for end in (low, high))
        query |= chance.choice(
            ({f"{name}_min": low}, {f"{name}_max": high}, {f"{name}_min": low, f"{name}_max": high})
        )
    words = {
        "scene": ("disk", "two", "nothing"), "parameter": ("frequency", "speed", "nothing"),
        "contact": ("damper", "root", "nothing"), **dict.fromkeys(TRUTHS, (True, False)),
    }  # fmt: skip
    if of_sweeps:
        words = {name: found for name, found in words.items() if name in SweepQuery.model_fields}
        words["harmonics"] = tuple(range(1, 10))
    query |= {name: chance.choice(words[name]) for name in words if chance.random() < 0.1}
    if chance.random() < 0.7:
        sorts = SORTS if of_sweeps else ("created", *NUMBERS, *TRUTHS)
        query["sort"] = chance.choice(("", "-")) + chance.choice(sorts).removeprefix("-")
    return query


def meets(record: SweepRecord, query: dict[str, Any]) -> bool:
    """The same conditions in plain Python, over all that is known of a sweep."""
    columns = {"scene": record.scene_name, "parameter": record.parameter}
    columns |= {name: getattr(record, name) for name in (*TRUTHS, "harmonics")}
    if any(query[name] != value for name, value in columns.items() if name in query):
        return False
    if not all(within(getattr(record, name), query, name) for name in NUMBERS):
        return False
    asked = [name for name in PARTS if {f"{name}_min", f"{name}_max"} & query.keys()]
    if not asked and "contact" not in query:
        return True
    there = [one for one in record.contacts if query.get("contact") in (None, one.name)]
    return any(all(within(getattr(one, name), query, name) for name in asked) for one in there)


@pytest.mark.parametrize("of_sweeps", [False, True], ids=["results", "sweeps"])
@pytest.mark.parametrize("queries", [15, pytest.param(500, marks=pytest.mark.long)])
def test_random_queries_are_answered_as_by_a_plain_filter(
    filled: tuple[Database, list[Owned]], queries: int, of_sweeps: bool
) -> None:
    database, known = filled
    repository, chance, answers = ResultRepository(database), random.Random(11), 0
    places = {record.from_value: index for index, (_, record) in enumerate(known)}
    for _ in range(queries):
        query, sees = random_query(chance, of_sweeps), chance.choice((None, *OWNERS, "nobody"))
        sort = query.get("sort", "-created")
        name = sort.removeprefix("-")
        values = [0 if name == "created" else getattr(record, name) for _, record in known]
        wanted = [
            index for index, (owner, record) in enumerate(known)
            if sees in (None, owner) and meets(record, query) and values[index] is not None
        ]  # fmt: skip
        wanted.sort(key=lambda index: (values[index], index), reverse=sort.startswith("-"))

        def page(held: ResultRepository, asked: Any, settings: Any, sees: Any = sees) -> Any:
            if of_sweeps:
                return sweep_page(held, asked, settings, sees)
            return result_page(held, asked, SHIPPED, settings, sees)

        query["limit"] = chance.choice((7, 100, 1000))
        asked = SweepQuery(**query) if of_sweeps else ResultQuery(of="sweep", **query)
        found = listed(page, repository, asked)
        got = [places[one.from_] if of_sweeps else place(one, places, known) for one in found]
        assert got == wanted, (query, sees)
        answers += bool(found)
    assert queries // 4 < answers < queries, "some are met and some are not"


def place(item: StoredResult, places: dict[float, int], known: list[Owned]) -> int:
    """Which of the known sweeps an answer is: by its bounds, which no two share. All of it must be told."""
    index = places[float(item.figures["from_value"])]
    told = {name: getattr(known[index][1], name) for name in quantities_of_record(SweepRecord)}
    assert item.figures == {name: value for name, value in told.items() if value is not None}
    assert all(type(value) is type(told[name]) for name, value in item.figures.items())
    return index


def test_what_is_stored_is_read_again(filled: tuple[Database, list[Owned]]) -> None:
    database, known = filled
    jobs = JobRepository(database).page(limit=10, owner=None)[::-1]
    stored = [row for job in jobs for row in ResultRepository(database).of_job(job.id)]
    own = [one.name for one in fields(SweepRecord) if one.name not in ("arrays", *WHERE)]
    for row, (owner, record) in zip(stored, known, strict=True):
        assert {name: getattr(row, name) for name in own} == {name: getattr(record, name) for name in own}
        assert row.owner == owner


WHERE = ("number", "id", "job_id", "position", "owner", "created")


@each(
    ("query", "pointer", "words"),
    [
        ({"of": "sweeep"}, "/of", "did you mean `sweep`?"),
        ({"of": "sweep", "paek_max": 1.0}, "/paek_max", "did you mean `peak_max`?"),
        ({"of": "sweep", "sort": "-paek"}, "/sort", "did you mean `peak`?"),
        ({"of": "sweep", "sort": "parameter"}, "/sort", "a number of these results"),
        ({"of": "sweep", "peak_max": "high"}, "/peak_max", "must be a valid number"),
        ({"of": "sweep", "variable": "damper.N0"}, "/variable", "is not a known key"),
        ({"of": "sweep", "cursor": "WzEsIjEyYSJd"}, "/cursor", "must come from the `next` link"),
        ({"of": "solve", "status": "x"}, "/status", "is not a known key"),
    ],
)
def test_what_no_result_has_is_refused_by_name(
    filled: tuple[Database, list[Owned]], query: dict[str, Any], pointer: str, words: str
) -> None:
    repository = ResultRepository(filled[0])
    with pytest.raises(InvalidRequestError) as refused:
        result_page(repository, ResultQuery(**query), SHIPPED, load_settings())
    [issue] = refused.value.issues
    assert (issue.pointer, refused.value.source) == (pointer, "query")
    assert words in issue.message


class At(BaseModel):
    value: float
    at: float


class Told(BaseModel):
    peak: At | None = Field(description="Highest peak [m].")
    count: int
    rough: bool
    word: str
    curve: list[float]


def test_what_a_model_of_results_declares_are_the_figures_of_its_json() -> None:
    declared = quantities_of_model(Told)
    assert {name: one.kind for name, one in declared.items()} == {
        "peak": float, "peak_at": float, "count": int, "rough": bool, "word": str
    }  # fmt: skip
    assert declared["peak"].unit == "m"
    body = Told(peak=At(value=1.5, at=2.0), count=3, rough=True, word="so", curve=[1.0]).model_dump()
    stored = list(figures(body))
    assert {one.name for one in stored} == declared.keys()
    assert FigureValue("peak_at", "", 2.0) in stored
    assert FigureValue("word", "so", 0.0) in stored
    assert not list(figures({"peak": None, "word": "two words", "no": float("nan"), "rows": [{}]}))


def test_the_results_of_any_kind_are_listed_by_their_figures(lasting: EmbeddedService) -> None:
    service = lasting._service
    jobs = [lasting.submit("told-iteration", {"size": size, "sweeps": 1}) for size in (2, 3, 4)]
    values = {job: lasting.wait(job) and lasting.results(job).result["eigenvalue"] for job in jobs}
    found = lasting.stored("told-iteration", sort="-eigenvalue", eigenvalue_min=min(values.values()))
    wanted = sorted(values, key=lambda job: -values[job])
    assert [one.id for one in found if one.id in values] == wanted
    assert all(one.figures["eigenvalue"] == values[one.id] for one in found if one.id in values)
    assert found[0].links["self"] == f"/v1/jobs/{found[0].id}/results"
    service.runs.put_in_bin(wanted[0], KEYLESS.sees)
    left = [one.id for one in lasting.stored("told-iteration", sort="-eigenvalue")]
    assert wanted[0] not in left
    assert [one.id for one in lasting.stored("told-iteration", run=wanted[0])] == [wanted[0]]
    with pytest.raises(InvalidRequestError, match="is not a known key"):
        lasting.stored("iteration", eigenvalue_min=1.0)


def test_results_are_listed_over_http(http: ServedClient) -> None:
    assert "told-iteration" in PRIVATE
    body = {"kind": "told-iteration", "size": 3, "sweeps": 2}
    job = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    mine = {"of": "told-iteration", "job": job["id"]}
    page = http.get("/v1/results", params={**mine, "steps_min": 1, "sort": "steps"}).json()
    assert [one["id"] for one in page["items"]] == [job["id"]]
    assert page["quantities"]["eigenvalue"] == {"unit": "1/s", "description": "The largest [1/s]."}
    assert http.get("/v1/results", params={**mine, "steps_max": 0}).json()["items"] == []
    sweeps = http.get("/v1/results", params={"of": "sweep", "job": job["id"], "limit": 1}).json()
    again = http.get(sweeps["next"]).json()
    listed_so = [sweeps["items"][0]["id"], again["items"][0]["id"]]
    assert listed_so == [
        one["id"] for one in http.get("/v1/sweeps", params={"job": job["id"]}).json()["items"]
    ]
    problem = is_problem(http.get("/v1/results", params={"of": "sweep", "peek_max": 1}), 422)
    assert problem["errors"][0]["pointer"] == "/peek_max"
    assert "`peak_max`" in problem["errors"][0]["detail"]
    table = http.get("/v1/results", params=mine, headers={"Accept": "text/csv"}).text
    assert table.splitlines()[0].endswith("figures.eigenvalue,figures.steps")
