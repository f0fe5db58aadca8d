from __future__ import annotations

from collections.abc import Iterator

import pytest
from launch import served


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
