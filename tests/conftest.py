from __future__ import annotations

import gc
import os
from collections import Counter
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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of the cases of a function marked `few(n)` every n-th runs by default, the others are long."""
    seen: Counter[str] = Counter()
    for item in items:
        few = item.get_closest_marker("few")
        if few is None:
            continue
        function = item.nodeid.partition("[")[0]
        if seen[function] % few.args[0]:
            item.add_marker(pytest.mark.long)
        seen[function] += 1


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
