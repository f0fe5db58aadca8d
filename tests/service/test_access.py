"""Keys, limits, refusals and their audit lines."""

from __future__ import annotations

import hmac
import json
import logging
import re
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from private_kinds import PRIVATE
from service_helpers import ServedClient, is_problem, serving, until
from sqlalchemy import text

from service.auth.allowances import Buckets
from service.auth.authenticator import REMEMBERED_SECONDS, _neighbourhood, caller_of_row, create, id_of
from service.auth.callers import KeyLimits, Scope
from service.cli import main
from service.client.client import Client
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.repositories import owned
from service.db.repositories.owned import KeyRepository
from service.errors import InvalidRequestError

SLOW = {"kind": "iteration", "seconds": 60.0, "fresh": True}


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedClient]:
    folder = tmp_path_factory.mktemp("guarded")
    with serving(folder, PRIVATE, require_keys=True, failed_keys_per_minute=6, https=True) as client:
        yield client


def token_of(client: ServedClient, *scopes: Scope, owner: str = "ann", **limits: Any) -> str:
    chosen = scopes or (Scope.SUBMIT,)
    return create(client.service.keys, owner, chosen, utc_now(), None, KeyLimits(**limits)).token


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def test_only_a_digest_is_kept(database: Database) -> None:
    repository = KeyRepository(database)
    made = create(repository, "ann", [Scope.READ], utc_now(), None, KeyLimits(waiting=3))
    with database.reading() as connection:
        [row] = connection.execute(text("SELECT * FROM api_key")).all()
    assert made.token.rpartition("_")[2] not in str(row)
    assert owned.digest_of(made.token) in row
    assert made.token not in repr(made)
    assert owned.matches(made.token, repository.get(made.row.id))
    other = repository.rotate(made.row.id)
    assert not owned.matches(made.token, repository.get(made.row.id)), "the old secret ends"
    assert owned.matches(other.token, repository.get(made.row.id))
    assert caller_of_row(other.row).limits.waiting == 3
    assert repository.usable(utc_now())
    repository.revoke(made.row.id)
    assert not repository.usable(utc_now())


def test_an_unknown_key_is_compared_too(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    real = hmac.compare_digest

    def watched(a: str, b: str) -> bool:
        compared.append((len(a), len(b)))
        return real(a, b)

    monkeypatch.setattr(hmac, "compare_digest", watched)
    assert not owned.matches("stickslip_000000000000_" + "0" * 64, None)
    assert compared == [(64, 64)]


@pytest.mark.parametrize("owner", ["", " ", "-x", "a\nb", "a" * 101])
def test_an_owner_is_a_name(database: Database, owner: str) -> None:
    with pytest.raises(InvalidRequestError, match="`owner` must be"):
        create(KeyRepository(database), owner, [Scope.READ], utc_now())


def test_a_key_expires_and_must_not_have_expired(database: Database) -> None:
    with pytest.raises(InvalidRequestError, match="in the future"):
        create(KeyRepository(database), "ann", [Scope.READ], utc_now(), utc_now() - timedelta(seconds=1))


def test_the_command_works_beside_a_service_and_a_revoked_key_ends(
    guarded: ServedClient, capsys: pytest.CaptureFixture[str]
) -> None:
    at = ["--database", guarded.service.settings.database]
    assert main(["keys", "create", "--owner", "eve", "--limit", "waiting=2", "--expires", "1d", *at]) == 0
    token = capsys.readouterr().out.strip()
    assert guarded.get("/v1/jobs", headers=bearer(token)).status_code == 200
    assert guarded.get("/v1/jobs", headers={"X-API-Key": token}).status_code == 200
    assert main(["keys", "list", "--json", *at]) == 0
    printed = capsys.readouterr().out
    [shown] = [key for key in json.loads(printed)["items"] if key["owner"] == "eve"]
    assert (shown["scopes"], shown["limits"]) == (["submit"], {"waiting": 2})
    assert shown["last_used"] is not None
    assert token not in printed
    assert owned.digest_of(token) not in printed
    assert main(["keys", "rotate", shown["id"], *at]) == 0
    rotated = capsys.readouterr().out.strip()
    assert REMEMBERED_SECONDS <= 1.0, "what a key may is looked up again after that"
    until(lambda: guarded.get("/v1/jobs", headers=bearer(rotated)).status_code == 200)
    assert main(["keys", "revoke", shown["id"], *at]) == 0
    until(lambda: guarded.get("/v1/jobs", headers=bearer(rotated)).status_code in (401, 429))
    assert main(["keys", "revoke", shown["id"], *at]) == 2
    assert "no key" in capsys.readouterr().err


def test_a_stream_ends_with_its_key(guarded: ServedClient) -> None:
    token = token_of(guarded)
    job = guarded.post("/v1/jobs", json=SLOW, headers=bearer(token)).json()
    with guarded.stream("GET", f"{job['links']['self']}/events", headers=bearer(token)) as stream:
        lines = stream.iter_lines()
        next(lines)
        guarded.service.keys.revoke(str(id_of(token)))
        rest = list(lines)
    assert not any(line.startswith("event: end") for line in rest)
    admin = bearer(token_of(guarded, Scope.ADMIN))
    assert guarded.delete(job["links"]["self"], headers=admin).json()["status"] == "dismissed"


def test_limits_of_a_key(guarded: ServedClient) -> None:
    few = bearer(token_of(guarded, requests_per_minute=3))
    assert [guarded.get("/v1/jobs", headers=few).status_code for _ in range(3)] == [200] * 3
    refused = guarded.get("/v1/jobs", headers=few)
    assert "3 requests a minute" in is_problem(refused, 429)["detail"]
    assert 1 <= int(refused.headers["retry-after"]) <= 20
    assert refused.elapsed >= timedelta(seconds=0.2), "a loop that asks again at once waits first"
    monitor = bearer(token_of(guarded, Scope.MONITOR))
    told = guarded.get("/metrics", headers=monitor).text
    assert re.search(r'\nstickslip_refused_total\{owner="[^"]+",status="429"\} [1-9]', told)
    admin = bearer(token_of(guarded, Scope.ADMIN))
    queue = bearer(token_of(guarded, owner="queue", waiting=1, seconds=5.0))
    made = [guarded.post("/v1/jobs", json=SLOW, headers=queue) for _ in range(3)]
    assert made[0].status_code == 202
    row = guarded.service.jobs.get(made[0].json()["id"])
    assert row is not None
    assert row.seconds_limit == 5.0
    assert "wait already, the key allows 1" in is_problem(made[-1], 429)["detail"]
    longer = guarded.post("/v1/jobs", json={**SLOW, "max_seconds": 9.0}, headers=queue)
    assert "the key's limit" in is_problem(longer, 422)["detail"]
    for job in guarded.get("/v1/jobs", params={"limit": 10}, headers=admin).json()["items"]:
        if job["status"] in ("accepted", "running"):
            guarded.delete(job["links"]["self"], headers=admin)


def test_previews_keep_to_the_work_of_a_key(guarded: ServedClient) -> None:
    # Of two-dof with 11 harmonics a sweep counts as 20 points × 11 × 2 DOFs = 440, as a job does.
    short = bearer(token_of(guarded, owner="work", work=439))
    body = {"scene": "two-dof", "kind": "sweep"}
    problem = is_problem(guarded.post("/v1/previews", json=body, headers=short), 422)
    assert [issue["pointer"] for issue in problem["errors"]] == ["/harmonics"]
    assert "must be at most 439, got 440" in problem["detail"]
    few = bearer(token_of(guarded, owner="work", work=21))
    point = {**body, "kind": "point", "frequency_hz": 1.05}
    assert "got 22" in is_problem(guarded.post("/v1/previews", json=point, headers=few), 422)["detail"]
    limits = {**body, "kind": "limits", "contact": "none"}
    assert "got 80" in is_problem(guarded.post("/v1/previews", json=limits, headers=few), 422)["detail"]
    fitting = is_problem(guarded.post("/v1/previews", json=limits, headers=short), 422)
    assert [issue["pointer"] for issue in fitting["errors"]] == ["/contact"]


def test_wrong_keys_are_limited_and_working_ones_are_not(
    guarded: ServedClient, caplog: pytest.LogCaptureFixture
) -> None:
    good = token_of(guarded)
    wrong = good[:-1] + ("0" if good[-1] != "0" else "1")
    with caplog.at_level(logging.DEBUG):
        got = [guarded.get("/v1/jobs%1b[31m", headers=bearer(wrong)) for _ in range(12)]
        assert guarded.get("/v1/jobs", headers=bearer(good)).status_code == 200
    assert got[-1].status_code == 429
    assert int(got[-1].headers["retry-after"]) >= 1
    audited = [json.loads(r.message) for r in caplog.records if r.name == "stickslip.audit"]
    assert len(audited) == 12, "every refusal has its line"
    line = audited[-1]
    assert (line["status"], line["reason"], line["method"]) == (429, "too-many-requests", "GET")
    assert line["address"] == "127.0.0.1"
    assert line["key"] == id_of(good)
    assert "\x1b" not in caplog.text
    assert good not in caplog.text
    assert wrong not in caplog.text


def test_what_answers_with_a_key_carry(guarded: ServedClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guarded.application.state.authenticator, "_failures", Buckets())
    answer = guarded.get("/v1/jobs", headers=bearer(token_of(guarded)))
    assert answer.headers["cache-control"] == "private, no-store"
    assert "Authorization" in answer.headers["vary"]
    assert answer.headers["strict-transport-security"].startswith("max-age=")
    refused = is_problem(guarded.get("/v1/jobs"), 401)
    assert "Bearer" in refused["detail"]
    basic = guarded.get("/v1/jobs", headers={"Authorization": "Basic YTpi"})
    assert basic.headers["www-authenticate"].startswith('Bearer realm="stickslip"')


def test_strangers_learn_whether_it_is_ready_and_no_more(guarded: ServedClient) -> None:
    assert guarded.get("/health/ready").json().keys() == {"ready", "parts"}
    watch = token_of(guarded, Scope.MONITOR)
    assert "workers" in guarded.get("/health/ready", headers=bearer(watch)).json()
    with Client(str(guarded.base_url), key=watch) as client:
        assert "stickslip_jobs" in client.metrics()


@pytest.mark.parametrize(
    "headers",
    [{"Sec-Fetch-Site": "cross-site"}, {"Origin": "http://evil.example"}, {"Origin": "null"}],
)
def test_a_web_page_elsewhere_may_not_change_anything(http: httpx.Client, headers: dict[str, str]) -> None:
    refused = is_problem(http.post("/v1/jobs", json=SLOW, headers=headers), 403)
    assert refused["type"].endswith("origin-refused")
    assert http.get("/v1/jobs", headers=headers).status_code == 200
    own = {"Origin": str(http.base_url).rstrip("/")}
    assert http.post("/v1/jobs", json={"kind": "none"}, headers=own).status_code == 422


def test_a_link_ends_with_the_last_key_of_its_owner(
    guarded: ServedClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guarded.application.state.authenticator, "_failures", Buckets())
    first, second = (token_of(guarded, owner="leaver") for _ in "ab")
    job = guarded.post("/v1/jobs", json={"kind": "iteration", "fresh": True}, headers=bearer(first)).json()
    link = guarded.post(f"/v1/runs/{job['id']}/shares", json={}, headers=bearer(first)).json()["link"]

    def revoke(token: str) -> None:
        guarded.service.keys.revoke(str(id_of(token)))

    revoke(first)
    assert guarded.get(link).status_code == 200
    revoke(second)
    is_problem(guarded.get(link), 404)
    held = guarded.application.state.authenticator
    with monkeypatch.context() as patched:
        patched.setattr(held, "_settings", held._settings.model_copy(update={"links_outlive_keys": True}))
        assert guarded.get(link).status_code == 200
    short = create(
        guarded.service.keys, "leaver", [Scope.READ], utc_now(), utc_now() + timedelta(minutes=1), KeyLimits()
    )
    assert guarded.get(link).status_code == 200, "it was given another one"
    with monkeypatch.context() as patched:
        patched.setattr(held, "_now", lambda: utc_now() + timedelta(minutes=2))
        is_problem(guarded.get(link), 404)
        login = {"oidc_issuer": "https://login.example.org"}  # who logs in has keys that end every day
        patched.setattr(held, "_settings", held._settings.model_copy(update=login))
        assert guarded.get(link).status_code == 200
        revoke(short.token)
        is_problem(guarded.get(link), 404)


def test_a_bucket_fills_again_in_bounded_memory() -> None:
    now = [0.0]
    buckets = Buckets(most=100, steady=lambda: now[0])
    assert [buckets.take("a", 2) for _ in range(3)] == [0.0, 0.0, 30.0]
    now[0] = 30.0
    assert [buckets.take("a", 2) for _ in range(2)] == [0.0, 30.0]
    for number in range(1000):
        buckets.take(str(number), 2)
    assert len(buckets) == 100


def test_addresses_of_one_customer_are_one() -> None:
    assert _neighbourhood("2001:db8::1") == _neighbourhood("2001:db8::ffff") == "2001:db8::"
    assert _neighbourhood("::ffff:10.0.0.1") == _neighbourhood("10.0.0.1") == "10.0.0.1"
    assert _neighbourhood("unknown") == "unknown"


def test_the_command_sends_the_key_of_a_file_or_of_the_environment(
    guarded: ServedClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ask = ["results", "--json", "--url", str(guarded.base_url)]
    monkeypatch.delenv("STICKSLIP_KEY", raising=False)
    assert main(ask) != 0
    assert "needs a key" in capsys.readouterr().err
    file = tmp_path / "key"
    file.write_text(token_of(guarded) + "\n")
    assert main([*ask, "--key-file", str(file)]) == 0
    monkeypatch.setenv("STICKSLIP_KEY", token_of(guarded))
    assert main(ask) == 0
    monkeypatch.setenv("STICKSLIP_KEY", "secret-of-another-kind")
    assert main(ask) == 2
    assert "secret-of" not in capsys.readouterr().err
    assert main([*ask, "--key-file", str(tmp_path / "none")]) == 2
