from __future__ import annotations

import gc
import os
from collections.abc import Generator, Iterator

import pytest
from launch import served

# Before anything loads numpy. Workers compute with one thread; who computes the same with several gets other
# last bits, and two processes of pytest have no more than two cores between them.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is collected stays: the garbage collector does not look through it, then or later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
