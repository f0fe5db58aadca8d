from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from launch import served

# Before anything loads numpy. Workers compute with one thread; who computes the same with several gets other
# last bits, and two processes of pytest have no more than two cores between them.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
