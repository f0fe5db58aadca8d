from __future__ import annotations

from collections.abc import Iterator

import pytest
from attack_site import Site, attacked


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A service that all attacks share; what a key may have computed in a minute has a test of its own."""
    with attacked(tmp_path_factory.mktemp("attacks"), answer_budget_seconds=10_000) as running:
        yield running
