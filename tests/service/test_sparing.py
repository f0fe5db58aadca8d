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
    assert gc.get_freeze_count() > 10_000
    # What is frozen may be freed at any time: an object is asked, not their number.
    fresh: list[None] = []
    sparing("stop", {"generation": 2})
    assert _is_collected(fresh), "objects of requests are collected as ever"
    monkeypatch.setitem(sys.modules, "loaded_later", types.ModuleType("loaded_later"))
    sparing("stop", {"generation": 2})
    assert not _is_collected(fresh)


def _is_collected(one: object) -> bool:
    """Whether the collector of cycles looks at it: what is frozen is left out of `get_objects`."""
    return any(known is one for known in gc.get_objects())
