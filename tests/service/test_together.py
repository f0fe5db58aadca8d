"""Limits of owners that hold over all services of one PostgreSQL database."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from postgresql_cluster import Cluster
from service_helpers import until

from benchmarks.service_process import ServiceProcess, serving
from service.auth.allowances import AtATime, Buckets
from service.auth.authenticator import create
from service.auth.callers import LINK_READERS, KeyLimits, Scope
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.repositories.owned import KeyRepository
from service.errors import TooManyRequestsError
from service.queue.lanes import Lane
from service.queue.together import Together

MOST = 300


def meet(*limits: AtATime | Buckets) -> Callable[[], list[str]]:
    """Share limits as if each was at a service of its own; what is called to have all tell all others."""
    sent: list[str] = []
    services = [Together(sent.append) for _ in limits]
    for service, limit in zip(services, limits, strict=True):
        service.add({"limit": limit})

    def tell() -> list[str]:
        sent.clear()
        for service, limit in zip(services, limits, strict=True):
            for text in service._texts("limit", limit.tell()):
                sent.append(text)
                for other in services:
                    if other is not service:
                        other.heard(text)
        return list(sent)

    return tell


def test_what_is_under_way_elsewhere_counts_until_its_service_is_silent() -> None:
    now = [0.0]
    here, there = (AtATime("requests", steady=lambda: now[0]) for _ in "ab")
    tell = meet(here, there)
    with ExitStack() as held:
        held.enter_context(here.taken("ann", 4))
        assert len(tell()) == 1
        for _ in range(2):
            held.enter_context(there.taken("ann", 4))
        tell()
        held.enter_context(here.taken("ann", 4))
        tell()
        for limit in (here, there):
            with pytest.raises(TooManyRequestsError, match="4 requests at a time"), limit.taken("ann", 4):
                pass
            with limit.taken("bob", 4):
                pass
        for _ in range(9):
            now[0] += 1.0
            tell()
        assert (here.elsewhere("ann"), there.elsewhere("ann")) == (2, 2), "what lasts is told again"
    tell()
    tell()
    assert (here.elsewhere("ann"), there.elsewhere("ann")) == (0, 0)
    assert tell() == [], "nothing is left to tell"
    there.add("ann", 4)
    tell()
    assert here.elsewhere("ann") == 1
    now[0] += 6.0
    assert here.elsewhere("ann") == 0, "its service is dead"


def test_a_burst_between_two_notices_is_told() -> None:
    here, there = AtATime("requests"), AtATime("requests")
    tell = meet(here, there)
    with here.taken("ann", 4), here.taken("ann", 4):
        pass
    tell()
    assert there.elsewhere("ann") == 2
    tell()
    assert there.elsewhere("ann") == 0


def test_who_uses_little_costs_no_notice() -> None:
    here, there, used, others = AtATime("requests"), AtATime("requests"), Buckets(), Buckets()
    tell, tell_used = meet(here, there), meet(used, others)
    with here.taken("ann", 100):
        assert tell() == []
    for _ in range(10):
        assert used.take("ann", 100) == 0.0
    assert tell_used() == []


def test_what_was_used_of_a_minute_elsewhere_is_gone_here() -> None:
    now = [0.0]
    here, there = (Buckets(steady=lambda: now[0]) for _ in "ab")
    tell = meet(here, there)
    taken = 0
    for number in range(200):
        taken += (here, there)[number % 2].take("ann", 100) == 0.0
        tell()
    assert taken == 100
    here.spend("bob", 100, 130.0)
    tell()
    assert there.empty("bob", 100) == pytest.approx(18.0)
    assert tell() == [], "what was heard is not told back"


def test_what_fills_a_notice_is_divided() -> None:
    service = Together(lambda _text: None)
    told = {f"owner {number}": number for number in range(2000)}
    texts = list(service._texts("limit", told | {"x" * 8000: 1}))
    assert max(map(len, texts)) <= 7000
    assert {name: count for text in texts for name, count in json.loads(text)[2].items()} == told


def test_links_have_two_places_of_all_and_one_of_each() -> None:
    lane = Lane(16, 1.0)
    owner = LINK_READERS.owner
    assert [lane._most(owner)] == [2]
    for elsewhere, left in ((1, 1), (2, 1), (0, 2)):
        lane.links.hear("another", {owner: elsewhere})
        assert lane._most(owner) == left
    assert lane._most("ann") == 4


@pytest.fixture
def pair(cluster: Cluster, tmp_path: Path) -> Iterator[tuple[str, list[ServiceProcess]]]:
    """Two services as processes on one database."""
    with cluster.database(empty=False) as url, ExitStack() as stack:
        yield (
            url,
            [
                stack.enter_context(serving(url, workers=1, log=tmp_path / f"log {n}", require_keys="true"))
                for n in range(2)
            ],
        )


def key_of(url: str, owner: str, limits: KeyLimits) -> dict[str, str]:
    database = Database(url)
    token = create(KeyRepository(database), owner, [Scope.SUBMIT], utc_now(), limits=limits).token
    database.close()
    return {"Authorization": f"Bearer {token}"}


def test_two_processes_keep_the_limits_of_an_owner_together(pair: tuple[str, list[ServiceProcess]]) -> None:
    url, services = pair
    ann = key_of(url, "ann", KeyLimits(requests_per_minute=MOST))
    bob = key_of(url, "bob", KeyLimits(streams=3))
    with ExitStack() as stack:
        one, other = (
            stack.enter_context(httpx.Client(base_url=f"http://127.0.0.1:{service.port}", timeout=30.0))
            for service in services
        )
        begun, answered, refused = time.monotonic(), 0, 0
        for number in range(3 * MOST):
            status = (one, other)[number % 2].get("/v1/kinds", headers=ann).status_code
            answered, refused = answered + (status == 200), refused + (status == 429)
        filled = (time.monotonic() - begun) * MOST / 60.0
        assert answered + refused == 3 * MOST
        assert 0.9 * MOST < answered < 1.3 * MOST + filled, "of one minute, not of one at each"
        body = {"kind": "mistuning", "scene": "bladed-disk", "of": ["tip"], "samples": 1000}
        job = one.post("/v1/jobs", json=body, headers=bob).raise_for_status().json()["id"]

        def status_of(client: httpx.Client) -> int:
            with client.stream("GET", f"/v1/jobs/{job}/events", headers=bob) as answer:
                return answer.status_code

        assert status_of(other) == 200
        with ExitStack() as streams:
            words = ("GET", f"http://127.0.0.1:{services[0].port}/v1/jobs/{job}/events")
            for _ in range(3):
                until(lambda: streams.enter_context(httpx.stream(*words, headers=bob)).status_code == 200)
            until(lambda: status_of(other) == 429)
        until(lambda: status_of(other) == 200)
        other.delete(f"/v1/jobs/{job}", headers=bob)
