from collections.abc import Iterator

import pytest
from attack_site import Site, attacked
from besieged import Besieged, besieged
from matrix_texts import FILE

from service.auth.callers import KeyLimits

LIMITED = {
    "few": KeyLimits(waiting=2, priority=3),
    "small": KeyLimits(storage_bytes=len(FILE) + 100),
    "two": KeyLimits(requests=2),
    "three": KeyLimits(streams=3),
}


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A service that all attacks share; what a key may have computed in a minute has a test of its own."""
    limits = {"answer_budget_seconds": 10_000, "job_seconds": 0.5}
    with attacked(tmp_path_factory.mktemp("attacks"), **limits) as site:
        yield site


@pytest.fixture(scope="module")
def site(running: Site) -> Site:
    """The same, quiet when the first attack of a module begins."""
    running.rest()
    return running


@pytest.fixture(scope="session")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Besieged]:
    """A service with keys of several owners, some of them limited."""
    folder = tmp_path_factory.mktemp("besieged")
    settings = dict.fromkeys(("owner_waiting", "owner_requests", "owner_streams", "streams"), 0)
    owners = ("ann", "bob", *LIMITED)
    with besieged(folder, *owners, limits=LIMITED, queue_limit=30_000, **settings) as service:
        yield service


@pytest.fixture
def service(started: Besieged) -> Iterator[Besieged]:
    """The same for one more test, which may leave jobs and connections behind."""
    started.idle = started.memory()
    yield started
    started.hang_up()
    started.dismiss_all("ann", "bob", *LIMITED)
