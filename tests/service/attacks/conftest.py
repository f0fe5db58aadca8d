from __future__ import annotations

from collections.abc import Iterator

import pytest
from attack_site import Site, attacked


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
