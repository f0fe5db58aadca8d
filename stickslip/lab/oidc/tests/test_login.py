"""Log-in at an OpenID Connect provider: a whole one lets people in, a forged answer lets nobody in."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from launch import free_port
from oidc import Forger, provider
from private_kinds import PRIVATE
from service_helpers import ServedClient, is_problem, serving

from service.errors import ConfigurationError
from service.settings.settings import load_settings

if importlib.util.find_spec("authlib") is None:
    pytest.skip("Authlib is not installed", allow_module_level=True)
SECRET = "a secret of the client"


def served(folder: Path, issuer: str, **more: Any) -> Any:
    port = free_port()
    return serving(
        folder, PRIVATE, port=port, public_url=f"http://127.0.0.1:{port}", require_keys=True,
        oidc_issuer=issuer, oidc_client_id="stickslip", oidc_client_secret=SECRET,
        failed_keys_per_minute=1000, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def issuer() -> Iterator[str]:
    if importlib.util.find_spec("oidc_provider_mock") is None:
        pytest.skip("oidc-provider-mock is not installed")
    with provider() as url:
        yield url


@pytest.fixture(scope="module")
def open_to_some(tmp_path_factory: pytest.TempPathFactory, issuer: str) -> Iterator[ServedClient]:
    allowed = ("@example.org", "bob@example.com")
    with served(tmp_path_factory.mktemp("some"), issuer, oidc_allowed=allowed, oidc_hours=2.0) as client:
        yield client


@pytest.fixture(scope="module")
def forged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedClient, Forger]]:
    with (
        Forger().serving() as forger,
        served(tmp_path_factory.mktemp("forged"), forger.url, oidc_admins=("root@example.org",)) as client,
    ):
        yield client, forger


@pytest.fixture
def person() -> Iterator[httpx.Client]:
    """A browser without scripts: it keeps cookies."""
    with httpx.Client(timeout=60.0) as client:
        yield client


def ended(answer: httpx.Response) -> str:
    """The word with which a log-in came back to the page."""
    assert answer.status_code == 303
    return parse_qs(urlsplit(answer.headers["location"]).query)["login"][0]


def log_in(person: httpx.Client, client: ServedClient, **form: str) -> httpx.Response:
    url = person.get(f"{client.base_url}/v1/login").json()["url"]
    sent = person.get(client.base_url.join(url))
    assert sent.status_code == 303
    back = person.post(sent.headers["location"], data=form)
    assert back.status_code in (302, 303)
    return person.get(back.headers["location"])


def test_a_person_gets_a_key_of_their_own(open_to_some: ServedClient, person: httpx.Client) -> None:
    answer = log_in(person, open_to_some, sub="ann")
    assert ended(answer) == "done"
    cookie = next(line for line in answer.headers.get_list("set-cookie") if "stickslip-key=" in line)
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    url = f"{open_to_some.base_url}/v1/login/key"
    elsewhere = person.post(url, headers={"Sec-Fetch-Site": "cross-site"})
    assert elsewhere.status_code == 403, "another page cannot take the key"
    given = person.post(url)
    assert given.headers["cache-control"] == "no-store"
    bearer = {"Authorization": f"Bearer {given.json()['key']}"}
    assert open_to_some.get("/v1/jobs").status_code == 401
    assert open_to_some.get("/v1/jobs", headers=bearer).status_code == 200
    is_problem(person.post(url), 401)
    keys = open_to_some.service.keys
    [row] = [row for row in keys.all() if row.owner == "ann@example.org"]
    assert row.scopes == ["submit"]
    assert row.expires is not None
    assert abs((row.expires - row.created).total_seconds() - 7200.0) < 1.0
    keys.revoke(row.id)


@pytest.mark.parametrize(
    ("form", "word"),
    [
        ({"sub": "eve"}, "not-allowed"),
        ({"sub": "bob"}, "not-allowed"),
        ({"sub": "x\ny"}, "not-allowed"),
        ({"action": "deny"}, "refused"),
    ],
)
def test_who_may_not_come_in_is_told(
    open_to_some: ServedClient, person: httpx.Client, form: dict[str, str], word: str
) -> None:
    assert ended(log_in(person, open_to_some, **form)) == word
    is_problem(person.post(f"{open_to_some.base_url}/v1/login/key"), 401)


def test_an_answer_to_another_log_in_is_refused(open_to_some: ServedClient, person: httpx.Client) -> None:
    base = open_to_some.base_url
    assert ended(person.get(f"{base}/v1/login/callback?state=x&code=c")) == "expired"
    for query in ("?state=&code=c", "?state=x&code=c", "?code=c", "?state=%C3%A9&code=c"):
        person.get(f"{base}/v1/login/begin")
        assert ended(person.get(f"{base}/v1/login/callback{query}")) == "expired"
    person.cookies.set("stickslip-login", "e30.e30.e30")
    assert ended(person.get(f"{base}/v1/login/callback?state=x&code=c")) == "expired"


NOW = int(time.time())


@pytest.mark.parametrize(
    ("claims", "signed_by", "word"),
    [
        ({}, "own", "done"),
        ({}, "stranger", "refused"),
        ({}, "secret", "refused"),
        ({"nonce": "another"}, "own", "refused"),
        ({"nonce": None}, "own", "refused"),
        ({"aud": "another"}, "own", "refused"),
        ({"aud": None}, "own", "refused"),
        ({"iss": "https://another.example"}, "own", "refused"),
        ({"exp": NOW - 3600}, "own", "refused"),
        ({"exp": None}, "own", "refused"),
        ({"sub": None}, "own", "refused"),
        ({"email_verified": None}, "own", "not-allowed"),
        ({"email_verified": "true"}, "own", "not-allowed"),
        ({"email": None}, "own", "not-allowed"),
        ({"email": ["ann@example.org"]}, "own", "not-allowed"),
        ({"email": "links to runs"}, "own", "not-allowed"),
    ],
)
def test_only_a_right_answer_lets_in(
    forged: tuple[ServedClient, Forger],
    person: httpx.Client,
    claims: dict[str, Any],
    signed_by: str,
    word: str,
) -> None:
    client, forger = forged
    forger.claims, forger.signed_by = claims, signed_by
    sent = person.get(f"{client.base_url}/v1/login/begin")
    query = forger.sends_back(sent.headers["location"])
    assert ended(person.get(f"{client.base_url}/v1/login/callback", params=query)) == word
    given = person.post(f"{client.base_url}/v1/login/key")
    assert given.status_code == (200 if word == "done" else 401)


def test_an_administrator_has_their_scope(forged: tuple[ServedClient, Forger], person: httpx.Client) -> None:
    client, forger = forged
    forger.claims, forger.signed_by = {"email": "root@example.org"}, "own"
    query = forger.sends_back(person.get(f"{client.base_url}/v1/login/begin").headers["location"])
    person.get(f"{client.base_url}/v1/login/callback", params=query)
    key = person.post(f"{client.base_url}/v1/login/key").json()["key"]
    assert client.get("/metrics", headers={"Authorization": f"Bearer {key}"}).status_code == 200


def test_a_provider_that_is_away_is_named(tmp_path: Path, person: httpx.Client) -> None:
    with served(tmp_path, f"http://127.0.0.1:{free_port()}") as client:
        assert ended(person.get(f"{client.base_url}/v1/login/begin")) == "unreachable"


def test_without_a_provider_nobody_logs_in(tmp_path: Path) -> None:
    with serving(tmp_path, PRIVATE, require_keys=True) as client:
        assert client.get("/v1/login").json() == {"url": None}
        is_problem(client.get("/v1/login/begin"), 404)
        is_problem(client.get("/v1/login/callback?state=a&code=b"), 404)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"oidc_client_id": None}, "oidc_client_id"),
        ({"oidc_client_secret": None}, "oidc_client_secret"),
        ({"public_url": None}, "public_url"),
        ({"public_url": "https://dampers.example/path"}, "public_url"),
        ({"oidc_issuer": "http://accounts.example"}, "https"),
        ({"public_url": "http://dampers.example"}, "https"),
        ({"require_keys": False}, "require_keys"),
    ],
)
def test_half_a_log_in_is_refused_at_the_start(changed: dict[str, Any], words: str) -> None:
    whole = {
        "oidc_issuer": "https://accounts.example", "oidc_client_id": "stickslip",
        "oidc_client_secret": SECRET, "public_url": "https://dampers.example", "require_keys": True,
    }  # fmt: skip
    load_settings(**whole)
    with pytest.raises(ConfigurationError, match=words) as caught:
        load_settings(**{**whole, **changed})
    assert SECRET not in str(caught.value)
