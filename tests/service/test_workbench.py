"""Projects, runs and links to them: named, found, changed, put in the bin, compared, shared."""

from __future__ import annotations

import random
import re
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
from each import each
from service_helpers import ServedClient, is_problem, new_job, until
from sqlalchemy import delete, update

from service.auth.allowances import Buckets
from service.client import Client
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobResult, JobState
from service.db.repositories import JobRepository
from service.db.repositories.owned import Projects
from service.db.repositories.run_repository import RunFilter, Runs, RunWords, _containing
from service.errors import (
    ChangedMeanwhileError,
    ConflictError,
    InvalidRequestError,
    ServiceProblem,
    StorageFullError,
)
from service.jobs.stored_figures import alone
from service.jobs.strict_json import JsonText
from service.schemas.run_figures import differences
from solver.scene.scene import load_scene

WAITED = {"Prefer": "wait=60"}


def run_of(http: httpx.Client, **body: Any) -> dict[str, Any]:
    answer = http.post("/v1/jobs", json={"kind": "iteration", **body}, headers=WAITED)
    assert answer.status_code in (200, 202), answer.text
    return answer.json()


def project_of(http: httpx.Client, name: str = "shroud") -> dict[str, Any]:
    answer = http.post("/v1/projects", json={"name": name})
    assert answer.status_code == 201
    assert answer.headers["location"] == f"/v1/projects/{answer.json()['id']}"
    return answer.json()


def ids(http: httpx.Client, path: str, **query: Any) -> list[str]:
    answer = http.get(path, params=query)
    assert answer.status_code == 200, answer.text
    return [one["id"] for one in answer.json()["items"]]


def test_what_is_said_at_submission_is_found_again(http: ServedClient) -> None:
    project = project_of(http)["id"]
    words = {"project": project, "name": "softer", "notes": "after 100 % of May", "tags": ["b", "a", "a"]}
    said = run_of(http, seed=1, **words)["id"]
    other = run_of(http, seed=2, tags=["a"], notes="100 of May")["id"]
    silent = run_of(http, seed=3)["id"]
    run = http.get(f"/v1/runs/{said}").json()
    assert {key: run[key] for key in words} == {**words, "tags": ["a", "b"]}
    assert http.get(f"/v1/runs/{silent}").json()["revision"] == 0
    assert ids(http, "/v1/runs", project=project) == [said]
    assert ids(http, "/v1/runs", tag="a") == [other, said]
    assert ids(http, "/v1/runs", tag=["a", "b"]) == [said]
    assert ids(http, "/v1/runs", text="SOFT") == [said]
    assert ids(http, "/v1/runs", text="0 % of") == [said], "a percent sign means itself"
    assert ids(http, "/v1/runs", created_after=run["created"], created_before=run["finished"]) == [said]
    assert silent in ids(http, "/v1/runs", kind="iteration", scene="matrix", status="successful")
    assert ids(http, "/v1/runs", status=["failed", "dismissed"]) == []
    first = http.get("/v1/runs", params={"tag": "a", "status": ["successful", "failed"], "limit": 1}).json()
    assert [one["id"] for one in http.get(first["next"]).json()["items"]] == [said]
    table = http.get("/v1/runs", params={"tag": "b"}, headers={"Accept": "text/csv"}).text.splitlines()
    assert len(table) == 2
    assert "a; b" in table[1]


def test_names_are_no_part_of_what_is_computed(http: ServedClient) -> None:
    plain = run_of(http, seed=11)
    named = run_of(http, seed=11, name="again")
    assert named["result_of"] == plain["id"]
    assert http.get(f"/v1/runs/{named['id']}").json()["name"] == "again"
    assert "name" not in http.service.jobs.spec(plain["id"])


@each(
    ("words", "pointer", "detail"),
    [
        (
            {"name": "a\x07b"},
            "/name",
            "must hold no control characters and be one line, it has U+0007",
        ),
        ({"name": "a\nb"}, "/name", "it has U+000A"),
        ({"name": "x" * 201}, "/name", "`name` must have at most 200 characters"),
        ({"notes": "a\x00"}, "/notes", "besides tabs and ends of lines, it has U+0000"),
        ({"notes": "\u202eevil"}, "/notes", "it has U+202E"),
        ({"name": "sh\u200broud"}, "/name", "it has U+200B"),
        ({"tags": ["\U000e0041"]}, "/tags/0", "it has U+E0041"),
        ({"notes": "x" * 10_001}, "/notes", "must have at most 10000 characters"),
        ({"tags": [" "]}, "/tags/0", "must hold more than spaces"),
        ({"tags": [str(n) for n in range(21)]}, "/tags", "must have at most 20 items"),
        ({"project": "none"}, "/project", "`project` must be the id of a project of the same owner"),
    ],
)
def test_words_that_cannot_be_are_refused(
    http: ServedClient, words: dict[str, Any], pointer: str, detail: str
) -> None:
    run = run_of(http, seed=21)["id"]
    told = [http.patch(f"/v1/runs/{run}", json=words)]
    told.append(http.post("/v1/jobs", json={"kind": "iteration", **words}))
    for answer in told:
        [error] = is_problem(answer, 422)["errors"]
        assert error["pointer"] == pointer
        assert detail in error["detail"]
    assert http.get(f"/v1/runs/{run}").json()["revision"] == 0


def test_a_change_is_of_what_was_seen(http: ServedClient) -> None:
    run = run_of(http, seed=31, name="first")["id"]
    for path in (f"/v1/runs/{run}", f"/v1/projects/{project_of(http, 'first')['id']}"):
        tag = http.get(path).headers["etag"]
        changed = http.patch(path, json={"notes": "one\ntwo"}, headers={"If-Match": tag})
        assert (changed.status_code, changed.json()["notes"]) == (200, "one\ntwo")
        assert changed.json()["name"] == "first", "what is left out stays"
        assert changed.headers["etag"] != tag
        late = http.patch(path, json={"notes": "three"}, headers={"If-Match": tag})
        is_problem(late, 412)
        assert http.get(path).json()["notes"] == "one\ntwo"
        both = f"{tag}, {changed.headers['etag']}"
        assert http.patch(path, json={"name": "x"}, headers={"If-Match": both}).status_code == 200
        assert http.patch(path, json={"name": "y"}).json()["name"] == "y"
    is_problem(http.patch("/v1/runs/none", json={}), 404)


def test_the_bin_gives_back_what_was_put_there(http: ServedClient) -> None:
    run = run_of(http, seed=41, sweeps=1, name="mine", fresh=True)
    path = f"/v1/runs/{run['id']}"
    [sweep] = ids(http, "/v1/sweeps", of=run["id"])
    stored = http.service.storage._repository.of("")
    assert http.delete(path).json()["deleted"]
    since = http.delete(path).json()["deleted"]
    assert run["id"] not in ids(http, "/v1/runs") + ids(http, "/v1/jobs")
    assert sweep not in ids(http, "/v1/sweeps")
    assert ids(http, "/v1/sweeps", of=run["id"]) == ids(http, "/v1/sweeps", job=run["id"]) == [sweep]
    assert ids(http, "/v1/runs", deleted=True, text="mine") == [run["id"]]
    assert http.get(path).json()["deleted"] == since
    assert http.service.storage._repository.of("") == stored, "it is kept until it is deleted for good"
    is_problem(http.patch(path, json={"name": "x"}), 409)
    is_problem(http.post(f"{path}/shares", json={}), 409)
    assert run_of(http, seed=41, sweeps=1)["result_of"] is None, "what is in the bin answers nobody"
    assert http.post(f"{path}/restore").json()["deleted"] is None
    assert run["id"] in ids(http, "/v1/runs")
    assert http.get(path).json()["name"] == "mine"


def test_a_run_under_way_is_dismissed_first(http: ServedClient) -> None:
    job = http.post("/v1/jobs", json={"kind": "iteration", "seconds": 60.0, "fresh": True}).json()["id"]
    assert ids(http, "/v1/runs", status=["accepted", "running"]) == [job]
    is_problem(http.delete(f"/v1/runs/{job}"), 409)
    http.delete(f"/v1/jobs/{job}")
    until(lambda: http.get(f"/v1/runs/{job}").json()["status"] == "dismissed")
    assert http.delete(f"/v1/runs/{job}").status_code == 200


def test_a_project_in_the_bin_keeps_its_runs(http: ServedClient) -> None:
    project = project_of(http, "to be thrown away")
    run = run_of(http, seed=51, project=project["id"])["id"]
    path = f"/v1/projects/{project['id']}"
    assert http.get(path).json()["runs"] == 1
    assert http.delete(path).json()["deleted"]
    assert project["id"] not in ids(http, "/v1/projects")
    assert ids(http, "/v1/projects", deleted=True, text="THROWN") == [project["id"]]
    assert http.get(f"/v1/runs/{run}").json()["project"] == project["id"]
    refused = http.post("/v1/jobs", json={"kind": "iteration", "project": project["id"]})
    assert is_problem(refused, 422)["errors"][0]["pointer"] == "/project"
    assert http.post(f"{path}/restore").json()["deleted"] is None
    http.delete(f"/v1/runs/{run}")
    assert http.get(path).json()["runs"] == 0


def test_two_runs_are_compared(http: ServedClient) -> None:
    a, b = (run_of(http, seed=61, size=size, name=str(size))["id"] for size in (20, 30))
    found = http.get("/v1/runs/compare", params={"a": a, "b": b}).json()
    assert (found["a"]["id"], found["b"]["id"]) == (a, b)
    assert found["inputs"] == [{"path": "size", "part": "settings", "a": 20, "b": 30}]
    values = [http.get(f"/v1/jobs/{one}/results").json()["result"]["eigenvalue"] for one in (a, b)]
    assert {"name": "eigenvalue", "a": values[0], "b": values[1]} in found["results"]
    with http.service.database.writing() as connection:  # results are not read, their figures are
        texts = {one: http.service.jobs.result_text(one) for one in (a, b)}
        connection.execute(update(JobResult).where(JobResult.job_id.in_((a, b))).values(body={}))
    assert http.get("/v1/runs/compare", params={"a": a, "b": b}).json()["results"] == found["results"]
    with http.service.database.writing() as connection:  # an earlier version stored none
        for one, body in texts.items():
            values = {"body": JsonText(body), "figures": None}
            connection.execute(update(JobResult).where(JobResult.job_id == one).values(**values))
    assert http.get("/v1/runs/compare", params={"a": a, "b": b}).json()["results"] == found["results"]
    same = http.get("/v1/runs/compare", params={"a": a, "b": a}).json()
    assert (same["inputs"], same["more_inputs"]) == ([], 0)
    is_problem(http.get("/v1/runs/compare", params={"a": a, "b": "none"}), 404)
    is_problem(http.get("/v1/runs/compare", params={"a": a}), 422)


def test_differences_have_the_paths_of_parameters() -> None:
    scene = load_scene("two-dof")
    other = scene.with_values({"damper.N0": 150.0, "excitation.amplitude": 7.0}).to_dict()
    other["structure"]["springs"].reverse()
    long = [[float(row == column) for column in range(40)] for row in range(40)]
    found = differences(
        {"scene": scene.to_dict(), "harmonics": 5, "limit": None, "M": long},
        {"scene": other, "harmonics": 7, "M": long[:20]},
    )
    told = {one.path: (one.part, one.a, one.b) for one in found}
    assert told.pop("M")[1].startswith("list of 40 x 40, sha256 ")
    assert told == {
        "damper.N0": ("scene", 100.0, 150.0),
        "excitation.amplitude": ("scene", 100.0, 7.0),
        "harmonics": ("settings", 5, 7),
    }
    result = {"peak": {"value": 1.0, "at": 2.0, "deep": {"x": 1, "deeper": {"y": 2}}}, "curve": [1.0]}
    result |= {"peaks": [{}, {}], "points": [{"peak": 3.0, "at": 1.0}, {"peak": 2.0, "at": 4.0}]}
    of_lists = {"peaks.count": 2, "points.count": 2, "points.peak": 2.0, "points.at": 4.0}
    assert alone(result) == {"peak.value": 1.0, "peak.at": 2.0, "peak.deep.x": 1, **of_lists}


def test_a_link_shows_its_run_and_nothing_else(http: ServedClient, monkeypatch: pytest.MonkeyPatch) -> None:
    run, other = (run_of(http, seed=seed, sweeps=1, notes="secret", fresh=True) for seed in (1, 2))
    http.patch(f"/v1/runs/{run['id']}", json={"notes": "why"})
    path = f"/v1/runs/{run['id']}/shares"
    link = http.post(path, json={"days": 1.0}).json()
    short = http.post(path, json={"days": 0.001}).json()
    assert "token" not in http.get(path).text
    with http.service.database.reading() as connection:
        kept = connection.exec_driver_sql("SELECT * FROM share").all()
    assert not any(link["token"] in str(row) for row in kept)

    def ask(what: str = "", token: str = link["token"]) -> httpx.Response:
        return http.get(f"/v1/shared{what}", params={"token": token})

    shown = http.get(link["link"]).json()
    assert (shown["id"], shown["notes"], shown["request"]["seed"]) == (run["id"], "why", 1)
    assert "secret" not in str(shown), "what was said of it once is not shown"
    assert all(ask(what).headers["cache-control"] == "private, no-store" for what in ("", "/results"))
    with Client(str(http.base_url)) as client:
        assert [one.id for one in client.all_shares(limit=1)][:2] == [short["id"], link["id"]]
    assert ask("/results").json()["result"] == run["result"]
    browser = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}
    page = http.get(link["link"], headers=browser)
    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in page.headers["content-security-policy"]
    assert "<th scope='row'>notes</th><td>why</td>" in page.text
    assert "<button" not in page.text
    files = [address.replace("&amp;", "&") for address in re.findall(r'href="([^"]+)"', page.text)]
    assert len(files) == ("scene" in run["request"]) + 1 + len(run["sweeps"])
    assert all(http.get(address).status_code == 200 for address in files)
    assert other["id"] not in page.text
    assert ask(f"/sweeps/{run['sweeps'][0]['id']}").json()["arrays"]
    is_problem(ask(f"/sweeps/{other['sweeps'][0]['id']}"), 404)
    is_problem(ask(token=link["token"][:-1] + "x"), 404)
    is_problem(http.post("/v1/shared", params={"token": link["token"]}), 405)
    http.delete(f"/v1/runs/{run['id']}")
    is_problem(ask(), 404)
    http.post(f"/v1/runs/{run['id']}/restore")
    assert ask().status_code == 200
    with monkeypatch.context() as patched:
        tomorrow = utc_now() + timedelta(days=0.5)
        patched.setattr(http.service.shares, "_now", lambda: tomorrow)
        is_problem(ask(token=short["token"]), 404)
        assert ask().status_code == 200
    assert ask(token=short["token"]).status_code == 200
    assert http.delete(f"{path}/{link['id']}").status_code == 204
    is_problem(ask(), 404)
    few = http.service.settings.model_copy(update={"requests_per_minute": 5, "failed_keys_per_minute": 3})
    authenticator = http.application.state.authenticator
    monkeypatch.setattr(authenticator, "_settings", few)
    for buckets in ("_requests", "_failures"):  # the tests after it have theirs
        monkeypatch.setattr(authenticator, buckets, Buckets())
    wrong = [ask() for _ in range(4)]
    assert [one.status_code for one in wrong] == [404, 404, 404, 429]
    assert "Retry-After" in wrong[-1].headers
    assert http.get("/v1/runs").status_code == 200, "who has no link is not shut out"
    right = http.post(path, json={}).json()["token"]
    assert [ask(token=right).status_code for _ in range(6)] == 5 * [200] + [429], "nor is a right one"
    assert ask(token=http.post(path, json={}).json()["token"]).status_code == 200, "each pays for itself"


def test_the_client_has_a_method_for_each(http: ServedClient) -> None:
    with Client(str(http.base_url)) as client:
        project = client.make_project("by the client", "notes")
        assert client.change_project(project.id, revision=1, name="renamed").revision == 2
        assert [one.id for one in client.projects(text="renamed")] == [project.id]
        body = {"kind": "iteration", "seed": 71, "sweeps": 1, "project": project.id, "tags": ["x"]}
        run, other = (client.submit({**body, "size": size}, wait=60.0).id for size in (5, 6))
        with pytest.raises(ServiceProblem) as refused:
            client.change_run(run, revision=7, name="late")
        assert refused.value.status == 412
        assert client.change_run(run, name="one", tags=[]).tags == []
        assert [one.id for one in client.runs(project=project.id, status=["successful"], limit=1)] == [
            other,
            run,
        ]
        assert [one.path for one in client.compare(run, other).inputs] == ["size"]
        link = client.share_run(run, days=2.0)
        assert [one.id for one in client.shares(run)] == [link.id]
        results = client.shared_results(link.token)
        assert client.shared_run(link.token).name == "one"
        assert client.shared_sweep(link.token, results.sweeps[0].id).points == 5
        with pytest.raises(ServiceProblem, match="has no scene"):
            client.shared_scene(link.token)
        client.end_share(run, link.id)
        with pytest.raises(ServiceProblem, match="no such link"):
            client.shared_run(link.token)
        assert client.delete_run(run).deleted
        assert client.restore_run(run).deleted is None
        assert client.run(run).sweeps == 1
        assert client.delete_project(project.id).deleted
        assert client.restore_project(project.id).deleted is None
        assert client.project(project.id).runs == 2


def test_every_filter_holds_on_both_databases(database: Database) -> None:
    jobs, runs = JobRepository(database), Runs(database, utc_now, bin_days=7.0)
    projects = Projects(database, utc_now, bin_days=7.0)
    project = projects.add("ann", "shroud", "", most=1).id
    with pytest.raises(StorageFullError):
        projects.add("ann", "one too many", "", most=1)

    def made(owner: str, **words: Any) -> str:
        return jobs.submit(new_job(owner=owner, words=RunWords(**words)), queue_limit=100)[0].id

    soft = made("ann", project=project, name="Softer", notes="a_b", tags=("x", "y"))
    hard = made("ann", name="harder", tags=("y",))
    other = made("ben", name="softer", tags=("x", "y"))
    with pytest.raises(InvalidRequestError, match="`project` must be the id of a project of the same owner"):
        made("ben", project=project)
    assert len(jobs.page(owner=None)) == 3, "what was refused is not there"

    def found(**wanted: Any) -> list[str]:
        return [row.job.id for row in runs.page(RunFilter(**{"sees": "ann", **wanted}), 10)]

    assert found() == [hard, soft]
    assert found(sees=None) == [other, hard, soft]
    assert found(sees=None, owner="ben") == [other]
    assert found(project=project) == found(tag=("x", "y")) == found(text="SOFTER") == [soft]
    assert found(text="a_b") == [soft]
    assert found(text="aXb") == found(text="%") == []
    assert found(status=[JobState.RUNNING]) == []
    assert found(status=[JobState.RUNNING, JobState.ACCEPTED], kind="iteration") == [hard, soft]
    created = {row.id: row.created for row in jobs.page(owner="ann")}
    assert found(created_after=created[soft], created_before=created[hard]) == [soft]
    assert [row.job.id for row in runs.page(RunFilter(sees="ann"), 10, before=hard)] == [soft]
    runs.change(soft, {"tags": ("z",), "project": None}, {1}, None)
    with pytest.raises(ChangedMeanwhileError):
        runs.change(soft, {"name": "late"}, {1}, None)
    changed = runs.get(soft)
    assert changed is not None
    assert (changed.words, changed.revision) == (RunWords(name="Softer", notes="a_b", tags=("z",)), 2)
    with pytest.raises(ConflictError, match="dismiss it first"):
        runs.put_in_bin(hard, None)
    jobs.cancel(hard)
    runs.put_in_bin(hard, None)
    assert found() == [row.id for row in jobs.page(owner="ann")] == [soft]
    assert found(deleted=True) == [hard]
    runs.restore(hard, None)
    assert found() == [hard, soft]


@pytest.mark.parametrize(
    ("text", "index"),
    [
        ("turbofan", ("run_text VIRTUAL TABLE", "ix_run_text")),
        ("rb", ("run_text_letters VIRTUAL TABLE", "ix_run_letters")),
    ],
)
def test_texts_are_found_by_the_index_of_texts(database: Database, text: str, index: tuple[str, str]) -> None:
    sqlite = database.backend == "sqlite"
    with database.reading() as connection:
        found = _containing(text, sqlite=sqlite).ids
        asked = str(found.compile(connection, compile_kwargs={"literal_binds": True}))
        if not sqlite:
            # Of so few rows all are read sooner.
            connection.exec_driver_sql("SET LOCAL enable_seqscan = off")
        plan = connection.exec_driver_sql(f"{'EXPLAIN QUERY PLAN' if sqlite else 'EXPLAIN'} {asked}").all()
    assert index[0 if sqlite else 1] in str(plan)


def test_runs_of_a_time_are_found_where_the_clocks_of_machines_differ(database: Database) -> None:
    jobs, runs, chance = JobRepository(database), Runs(database, utc_now, bin_days=7.0), random.Random(3)
    made = [jobs.submit(new_job(owner="ann"), queue_limit=100)[0].id for _ in range(12)]
    created = {one: utc_now() + timedelta(hours=chance.uniform(-23.0, 23.0)) for one in made}
    with database.writing() as connection:
        for one, when in created.items():
            connection.execute(update(Job).where(Job.id == one).values(created=when))
    for _ in range(40):
        after, before = sorted(utc_now() + timedelta(hours=chance.uniform(-60.0, 60.0)) for _ in range(2))
        wanted = {one for one, when in created.items() if after <= when < before}
        between = RunFilter(sees="ann", created_after=after, created_before=before)
        assert {row.id for row in runs.page(between, 100)} == wanted
    ever = RunFilter(
        sees="ann",
        created_after=datetime.min.replace(tzinfo=UTC),
        created_before=datetime.max.replace(tzinfo=UTC),
    )
    assert {row.id for row in runs.page(ever, 100)} == set(made)


@pytest.mark.few(4)
@pytest.mark.parametrize("counted", [0, 5000], ids=["looked at one by one", "by the index"])
def test_texts_are_found_as_by_looking_at_every_one(
    database: Database, counted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.db.repositories.run_repository._FEW_TEXTS", counted)
    jobs, runs = JobRepository(database), Runs(database, utc_now, bin_days=7.0)
    chance = random.Random(5)

    def words() -> RunWords:
        name, notes = ("".join(chance.choices("aBÜüé%_\"'/* -\n", k=chance.randrange(12))) for _ in range(2))
        return RunWords(name=name, notes=notes)

    made = [jobs.submit(new_job(owner="ann", words=words()), queue_limit=1000)[0].id for _ in range(36)]
    said = {one: runs.seen(one, "ann").words for one in made}
    for one in list(said)[::7]:
        said[one] = runs.change(one, {"name": f"{said[one].name}new", "notes": "other"}, None, "ann").words
    deleted = made[3::11]
    gone = [said.pop(one) for one in deleted]
    with database.writing() as connection:
        connection.execute(delete(Job).where(Job.id.in_(deleted)))
    pieces = {text[i : i + n] for one in said.values() for text in (one.name, one.notes)
              for n in (1, 2, 3, 6) for i in range(0, len(text) - n + 1, 4)}  # fmt: skip
    hit = 0
    for text in sorted(pieces | {one.name for one in gone if one.name}):
        if len(text) < 3 and not text.isascii() and database.backend == "postgresql":
            continue  # a piece of one or two letters is folded as the database's locale folds
        wanted = {one for one, words in said.items()
                  if text.lower() in words.name.lower() or text.lower() in words.notes.lower()}  # fmt: skip
        found = {row.id for row in runs.page(RunFilter(sees="ann", text=text), 100)}
        assert found == wanted, repr(text)
        hit += bool(wanted)
    assert hit > 60
