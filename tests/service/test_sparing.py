"""The collector of cycles leaves loaded modules alone, and nothing else."""

import gc
import sys
import types
from collections.abc import Iterator

import pytest

from service.http.server import Sparing


@pytest.fixture(autouse=True)
def _unfrozen() -> Iterator[None]:
    """What the collection of the tests left out of the collector's work counts for it again."""
    gc.unfreeze()
    yield
    gc.unfreeze()


def test_what_is_loaded_is_spared_once(monkeypatch: pytest.MonkeyPatch) -> None:
    sparing = Sparing()
    sparing("start", {"generation": 2})
    sparing("stop", {"generation": 1})
    assert gc.get_freeze_count() == 0
    sparing("stop", {"generation": 2})
    spared = gc.get_freeze_count()
    assert spared > 10_000
    fresh = [[] for _ in range(1000)]
    sparing("stop", {"generation": 2})
    assert gc.get_freeze_count() == spared, "objects of requests are collected as ever"
    monkeypatch.setitem(sys.modules, "loaded_later", types.ModuleType("loaded_later"))
    sparing("stop", {"generation": 2})
    assert gc.get_freeze_count() >= spared + len(fresh)
