"""Every route against everybody who should not get in, and those who should."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from private_kinds import PRIVATE
from service_helpers import ServedClient, is_problem, serving
from sqlalchemy import insert

from service.auth import authenticator
from service.auth.allowances import Buckets
from service.auth.callers import Scope
from service.db.clock import new_id, utc_now
from service.db.models import Job, JobResult, JobState
from service.db.repositories.result_repository import insert_results
from service.http.routes import page
from service.jobs.stored_figures import DesignRecord
from solver.scene.scene import load_scene

ROLES = ("none", "wrong", "another", "revoked", "expired", "read", "submit", "admin")
REFUSED = ("none", "wrong", "revoked", "expired")
# What each of them is answered; `another` is a key of another owner, `read` and `submit` are the owner's.
OPEN = (200, 401, 200, 401, 401, 200, 200, 200)
MONITOR = (401, 401, 403, 401, 401, 403, 403, 200)
LISTED = (401, 401, 200, 401, 401, 200, 200, 200)
OWNED = (401, 401, 404, 401, 401, 200, 200, 200)
ENDED = (401, 401, 404, 401, 401, 403, 409, 409)
MADE = (401, 401, 202, 401, 401, 403, 202, 202)
STORED = (401, 401, 201, 401, 401, 403, 201, 201)
CHANGED = (401, 401, 404, 401, 401, 403, 200, 200)
PLANNED = (401, 401, 200, 401, 401, 403, 200, 200)
MINE = {**load_scene("two-dof").to_dict(), "name": "mine"}
NEW = {**MINE, "name": "another-scene"}
FILE = np.eye(2)

TABLE: dict[str, tuple[tuple[int, ...], Any]] = {
    "GET /openapi.json": (OPEN, None),
    "GET /docs": (OPEN, None),
    "GET /docs/style.css": (OPEN, None),
    "GET /v1/login": (OPEN, None),
    "GET /health/live": (OPEN, None),
    "GET /health/ready": (OPEN, None),
    "GET /metrics": (MONITOR, None),
    "GET /v1/jobs": (LISTED, None),
    "POST /v1/jobs": (MADE, {"kind": "iteration", "fresh": True, "seconds": 0.1}),
    "GET /v1/jobs/{job_id}": (OWNED, None),
    "GET /v1/jobs/{job_id}/results": (OWNED, None),
    "GET /v1/jobs/{job_id}/told": (OWNED, None),
    # They have no results that a report tells either.
    "GET /v1/jobs/{job_id}/report": ((401, 401, 404, 401, 401, 403, 409, 409), None),
    # The jobs of these tests have no scene, as is said to those who may see them.
    "GET /v1/jobs/{job_id}/scene": ((401, 401, 404, 401, 401, 404, 404, 404), None),
    "GET /v1/jobs/{job_id}/events": (OWNED, None),
    "DELETE /v1/jobs/{job_id}": (ENDED, None),
    "GET /v1/projects": (LISTED, None),
    "POST /v1/projects": (STORED, {"name": "shroud"}),
    "GET /v1/projects/{project_id}": (OWNED, None),
    "PATCH /v1/projects/{project_id}": (CHANGED, {"notes": "of May"}),
    "DELETE /v1/projects/{project_id}": (CHANGED, None),
    "POST /v1/projects/{project_id}/restore": (CHANGED, None),
    "GET /v1/runs": (LISTED, None),
    "GET /v1/runs/events": (LISTED, None),
    "GET /v1/runs/compare": (OWNED, None),
    "GET /v1/runs/{job_id}/summary": (OWNED, None),
    "GET /v1/runs/{job_id}": (OWNED, None),
    "PATCH /v1/runs/{job_id}": (CHANGED, {"name": "softer"}),
    "DELETE /v1/runs/{job_id}": (CHANGED, None),
    "POST /v1/runs/{job_id}/restore": (CHANGED, None),
    "GET /v1/runs/{job_id}/shares": (OWNED, None),
    "POST /v1/runs/{job_id}/shares": ((401, 401, 404, 401, 401, 403, 201, 201), {"days": 1.0}),
    "GET /v1/shares": (LISTED, None),
    # Whoever may end it does so, and it is gone.
    "DELETE /v1/runs/{job_id}/shares/{share_id}": ((401, 401, 404, 401, 401, 403, 204, 404), None),
    # A link needs no key; one that does not work is refused all the same.
    "GET /v1/shared": (OPEN, None),
    "GET /v1/shared/results": (OPEN, None),
    "GET /v1/shared/scene": ((404, 401, 404, 401, 401, 404, 404, 404), None),
    "GET /v1/shared/sweeps/{sweep_id}": (OPEN, None),
    "GET /v1/designs": (LISTED, None),
    # Its kind is not among those of these tests, which says so to whoever gets that far.
    "POST /v1/designs": ((401, 401, 422, 401, 401, 403, 422, 422), {}),
    "GET /v1/designs/{design_id}": (OWNED, None),
    # Of what is not said here: who may ask hears so.
    "GET /v1/results": ((401, 401, 422, 401, 401, 422, 422, 422), None),
    "GET /v1/sweeps": (LISTED, None),
    "GET /v1/sweeps/{sweep_id}": (OWNED, None),
    "GET /v1/sweeps/{sweep_id}/plot.svg": (OWNED, None),
    "GET /v1/sweeps/{sweep_id}/plot.png": (OWNED, None),
    "GET /v1/scenes": (LISTED, None),
    "POST /v1/scenes": (STORED, NEW),
    # A name is one owner's: an admin has no scene of this name.
    "GET /v1/scenes/{name}": ((401, 401, 404, 401, 401, 200, 200, 404), None),
    "GET /v1/uploads": (LISTED, None),
    "POST /v1/uploads": (STORED, FILE),
    "GET /v1/uploads/{upload_id}": (OWNED, None),
    "GET /v1/matrices/formats": (LISTED, None),
    "GET /v1/kinds": (LISTED, None),
    "GET /v1/laws": (LISTED, None),
    # Of another's upload it is said that there is none.
    "POST /v1/matrices": (
        (401, 401, 422, 401, 401, 403, 200, 200),
        {"structure": {"M": "upload:MASS", "K": "upload:UPLOAD"}},
    ),
    # Whoever may delete it does so, and it is gone.
    "DELETE /v1/uploads/{upload_id}": ((401, 401, 404, 401, 401, 403, 204, 404), None),
    "POST /v1/plan": (PLANNED, {"scene": "two-dof"}),
    "POST /v1/previews": (
        PLANNED,
        {"kind": "point", "scene": "two-dof", "frequency_hz": 1.0, "harmonics": 1},
    ),
    # A scene's name is one owner's.
    "POST /v1/scenes/parameters": ((401, 401, 422, 401, 401, 403, 200, 422), {"scene": "mine"}),
    "POST /v1/scenes/text": ((401, 401, 422, 401, 401, 403, 200, 422), {"scene": "mine"}),
    "POST /v1/scenes/read": (PLANNED, {"text": "name = 'mine'"}),
    "POST /v1/scenes/edit": (PLANNED, {"text": "name = 'mine'"}),
    "GET /v1/scenes-schema": (LISTED, None),
    "POST /v1/measurements/read": (
        PLANNED,
        {"scene": "two-dof", "files": [{"name": "rig.csv", "text": "frequency [Hz],amplitude [m]\n1,2\n"}]},
    ),
    "POST /v1/measurements/look": (
        PLANNED,
        {"scene": "two-dof", "files": [{"name": "rig.csv", "text": "Frequenz [Hz];Weg [m]\n1,0;2\n"}]},
    ),
    "GET /v1/templates": (LISTED, None),
    "POST /v1/templates": (PLANNED, {"template": "shroud"}),
    # The page itself, which asks for a key.
    "GET /": (OPEN, None),
    "GET /page/{hashed}/{path:path}": (OPEN, None),
}
QUERIES = {
    "/v1/runs/compare": "?a={job_id}&b={design_id}",
    **dict.fromkeys(
        ("/v1/shared", "/v1/shared/results", "/v1/shared/scene", "/v1/shared/sweeps/"), "?token={token}"
    ),
}
ENDLESS = ("GET /v1/runs/events",)
PAGE = ("GET /", "GET /page/{hashed}/{path:path}")


@dataclass(frozen=True)
class House:
    """A service that needs keys, and what one owner has there."""

    client: ServedClient
    tokens: dict[str, str | None]
    ids: dict[str, str]

    def ask(self, role: str, method: str, path: str, **arguments: Any) -> httpx.Response:
        token = self.tokens[role]
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        return self.client.request(
            method, path, headers={**headers, **arguments.pop("headers", {})}, **arguments
        )

    def begun(self, role: str, method: str, path: str) -> httpx.Response:
        """The beginning of an answer that does not end by itself; the whole of a refusal."""
        token = self.tokens[role]
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        with self.client.stream(method, path, headers=headers) as answer:
            if answer.status_code >= 400:
                answer.read()
            return answer

    def filled(self, body: Any) -> Any:
        """A body with the ids of the owner's uploads."""
        if not isinstance(body, dict):
            return body
        words = json.dumps(body).replace("UPLOAD", self.ids["upload_id"])
        return json.loads(words.replace("MASS", self.ids["mass_id"]))


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    folder, many = tmp_path_factory.mktemp("strangers"), 100_000
    with serving(folder, PRIVATE, require_keys=True, failed_keys_per_minute=many) as client:
        tokens = make_tokens(client)
        made = House(client, tokens, {})
        waiting = {"Prefer": "wait=60"}
        body = {"kind": "iteration", "sweeps": 1}
        job = made.ask("submit", "POST", "/v1/jobs", json=body, headers=waiting).json()
        assert job["status"] == "successful"
        assert made.ask("submit", "POST", "/v1/scenes", json=MINE).status_code == 201
        upload = made.ask("submit", "POST", "/v1/uploads", **arguments_of(FILE, -1)).json()
        mass = made.ask("submit", "POST", "/v1/uploads", **arguments_of(2.0 * FILE, -1)).json()
        made.ids.update(mass_id=mass["id"])
        made.ids.update(job_id=job["id"], sweep_id=job["sweeps"][0]["id"], upload_id=upload["id"])
        made.ids.update(design_id=add_design(client, "ann"), name="mine")
        project = made.ask("submit", "POST", "/v1/projects", json={"name": "mine"}).json()
        made.ids.update(project_id=project["id"])
        links = [made.ask("submit", "POST", f"/v1/runs/{job['id']}/shares", json={}).json() for _ in "ab"]
        made.ids.update(share_id=links[0]["id"], token=links[1]["token"])
        made.ids.update(hashed=page.version(), path="icon.svg")
        yield made


def arguments_of(body: Any, number: int) -> dict[str, Any]:
    """The body of a request; a file is never the same twice."""
    if not isinstance(body, np.ndarray):
        return {"json": body}
    file = io.BytesIO()
    np.save(file, (2.0 + number) * body)
    return {"content": file.getvalue(), "params": {"name": "K.npy"}}


def add_design(client: ServedClient, owner: str) -> str:
    """A stored design, without the seconds a cold worker takes to find one."""
    name, now = new_id(), utc_now()
    record = DesignRecord(
        **dict.fromkeys(("scene_name", "scene_hash", "method", "status"), "x"),
        **dict.fromkeys(("objective", "peak", "peak_at", "limit", "band_hz", "work"), 1.0),
        **dict.fromkeys(("robust", "reached", "feasible"), True),
        **dict.fromkeys(("harmonics", "evaluations"), 1),
        seconds=1.0,
    )
    job = {
        "id": name, "owner": owner, "kind": "design", "state": JobState.SUCCESSFUL, "spec_hash": "",
        "request_hash": "", "max_attempts": 1, "created": now, "request": {}, "spec": {},
    }  # fmt: skip
    with client.service.database.writing() as connection:
        connection.execute(insert(Job).values(**job))
        connection.execute(insert(JobResult).values(job_id=name, body={}))
        insert_results(connection, name, [record], now, owner)
    return name


def make_tokens(client: ServedClient) -> dict[str, str | None]:
    repository, now = client.service.keys, utc_now()

    def token(owner: str, *scopes: Scope, **more: Any) -> str:
        return authenticator.create(repository, owner, scopes, now, **more).token

    tokens = {
        "none": None,
        "wrong": f"stickslip_{'0' * 12}_{'0' * 64}",
        "another": token("ben", Scope.SUBMIT),
        "revoked": token("ann", Scope.ADMIN),
        "expired": token("ann", Scope.ADMIN, expires=now + timedelta(microseconds=1)),
        "read": token("ann", Scope.READ),
        "submit": token("ann", Scope.SUBMIT),
        "admin": token("chief", Scope.ADMIN),
        "monitor": token("watch", Scope.MONITOR),
    }
    repository.revoke(str(authenticator.id_of(str(tokens["revoked"]))))
    return tokens


def routes_of(routes: Any) -> Iterator[str]:
    """Every method and path that an application answers."""
    for route in routes:
        inner = getattr(route, "original_router", None) or getattr(route, "app", None)
        if hasattr(route, "methods"):
            yield from (f"{method} {route.path}" for method in route.methods - {"HEAD"})
        elif hasattr(inner, "routes"):
            yield from routes_of(inner.routes)
        else:
            yield f"GET {route.path}"


def test_the_table_knows_every_route(house: House) -> None:
    app: FastAPI = house.client.application
    assert sorted(set(routes_of(app.routes))) == sorted(TABLE)


@pytest.mark.parametrize("role", ["none", "wrong", "submit", "admin", "link"])
def test_every_route_is_counted(house: House, role: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an owner or an address may do is used up: whatever the route, nothing is done for it any more."""
    app: FastAPI = house.client.application
    held = app.state.authenticator
    few = held._settings.model_copy(
        update=dict.fromkeys(("requests_per_minute", "failed_keys_per_minute"), 1)
    )
    monkeypatch.setattr(held, "_settings", few)
    for buckets in ("_requests", "_failures"):
        monkeypatch.setattr(held, buckets, Buckets(steady=lambda: 0.0))
    token = house.ids["token"] if role == "link" else "share_no"

    def status(route: str) -> int:
        method, path = route.split()
        params = {"token": token} if path.startswith("/v1/shared") else {}
        address = path.replace(":path", "").format(**house.ids)
        asker = "none" if role == "link" else role
        return int(house.ask(asker, method, address, params=params).status_code)

    every = sorted(set(routes_of(app.routes)) | {"GET /nowhere", "GET /v1/shared/nowhere"})
    first, *others = [route for route in every if role != "link" or "/v1/shared" in route]
    answered = {first: status(first)}
    # A refusal comes late; many are waited for together.
    with ThreadPoolExecutor(32) as askers:
        answered.update(zip(others, askers.map(status, others), strict=True))
    let_in = {route: status for route, status in answered.items() if status != 429}
    # The first one, and the first wrong link where links are not what is used up.
    assert len(let_in) == (1 if role in ("wrong", "link") else 2), let_in


def answer_of(house: House, route: str, role: str) -> httpx.Response:
    """What somebody is answered, as all answers are: without what a browser might make of it."""
    method, path = route.split()
    address = path.replace(":path", "").format(**house.ids)
    address += QUERIES.get(path.removesuffix("{sweep_id}"), "").format(**house.ids)
    if route in ENDLESS:
        answer = house.begun(role, method, address)
    else:
        body = house.filled(TABLE[route][1])
        answer = house.ask(role, method, address, **arguments_of(body, ROLES.index(role)))
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["referrer-policy"] == "no-referrer"
    allowed = "'self'" if answer.status_code == 200 and route in PAGE else "'none'"
    policy = answer.headers["content-security-policy"].split("; ")
    assert f"default-src {allowed}" in policy
    # A picture has a style sheet inside, and is shut up in a sandbox for it.
    assert not any("unsafe" in word for word in policy if "sandbox" not in policy)
    assert "access-control-allow-origin" not in answer.headers
    assert ("www-authenticate" in answer.headers) == (answer.status_code == 401)
    if answer.status_code >= 400:
        is_problem(answer, answer.status_code)
    return answer


def test_everybody_gets_what_is_theirs(house: House) -> None:
    def status(asked: tuple[str, str]) -> int:
        return answer_of(house, *asked).status_code

    strangers = [(route, role) for route in TABLE for role in ROLES if role in REFUSED]
    # A refusal comes late; many are waited for together.
    with ThreadPoolExecutor(32) as askers:
        got = dict(zip(strangers, askers.map(status, strangers), strict=True))
    got |= {(route, role): status((route, role)) for route in TABLE for role in ROLES if role not in REFUSED}
    expected = {
        (route, role): status
        for route, (statuses, _) in TABLE.items()
        for role, status in zip(ROLES, statuses, strict=True)
    }
    wrong = {asked: (status, expected[asked]) for asked, status in got.items() if status != expected[asked]}
    assert wrong == {}
