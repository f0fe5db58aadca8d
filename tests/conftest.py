from __future__ import annotations

import gc
import os
from collections import Counter
from collections.abc import Collection, Generator, Iterator

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
    """Of the cases of a function marked `few` every n-th runs and those to keep; the others are long."""
    seen: Counter[str] = Counter()
    for item in items:
        few = item.get_closest_marker("few")
        if few is None:
            continue
        function = item.nodeid.partition("[")[0]
        kept = bool(few.args) and seen[function] % few.args[0] == 0
        seen[function] += 1
        if not kept and not _named(item, few.kwargs.get("keep", ())):
            item.add_marker(pytest.mark.long)


def _named(item: pytest.Item, keep: Collection[object]) -> bool:
    """Whether a value that a case has is one of those to keep."""
    values = item.callspec.params.values() if isinstance(item, pytest.Function) else ()
    return any(value in keep for value in values if isinstance(value, str | int | float))


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
