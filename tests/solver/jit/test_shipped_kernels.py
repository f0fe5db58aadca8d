"""Kernels that came with the package: used where sources and processor are those they are for."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from solver.jit import compiler_process
from solver.jit import folder as shipped
from solver.jit.folder import folder

KIND = shipped.Target("some-level", "+a,+b", frozenset())


@pytest.fixture
def packed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An archive of what stands for kernels, on a machine that has none compiled."""
    place = tmp_path / "package"
    place.mkdir()
    for name in (compiler_process.SETTING, shipped.CPU_NAME, shipped.CPU_FEATURES):
        monkeypatch.setenv(name, "")  # so that what is set by the test ends with it
        monkeypatch.delenv(name)
    found = shipped.archive
    monkeypatch.setattr(shipped, "archive", lambda _=None: found(place))
    monkeypatch.setattr(shipped, "target", lambda: KIND)
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "builder"))
    folder.cache_clear()
    (folder() / "kernel.py311.nbi").write_bytes(b"index")
    (folder() / "kernel.py311.1.nbc").write_bytes(b"code")
    (folder() / "lock").touch()
    made = shipped.pack()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "user"))
    folder.cache_clear()
    yield made
    folder.cache_clear()


def test_they_are_unpacked_once_and_the_compiler_is_told_for_which_processor(packed: Path) -> None:
    assert compiler_process.on_disk()
    assert not compiler_process.missing()
    names = {file.name for file in folder().iterdir()}
    assert names == {"kernel.py311.nbi", "kernel.py311.1.nbc", "shipped.some-level"}
    assert (folder() / "kernel.py311.1.nbc").read_bytes() == b"code"
    assert (os.environ[shipped.CPU_NAME], os.environ[shipped.CPU_FEATURES]) == ("some-level", "+a,+b")
    packed.unlink()
    assert compiler_process.on_disk()


def test_of_other_sources_they_are_left_alone(packed: Path) -> None:
    packed.rename(packed.with_name(f"0123456789abcdef{packed.name[16:]}"))
    assert not compiler_process.on_disk()
    assert shipped.CPU_NAME not in os.environ


@pytest.mark.usefixtures("packed")
def test_a_processor_without_what_they_need_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipped, "target", lambda: None)
    assert not compiler_process.on_disk()


@pytest.mark.usefixtures("packed")
def test_those_compiled_for_this_very_processor_come_first() -> None:
    compiler_process.compiled(compiler_process.Stage.FIRST)
    assert compiler_process.on_disk()
    assert shipped.CPU_NAME not in os.environ


@pytest.mark.usefixtures("packed")
def test_who_asks_for_another_processor_gets_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(shipped.CPU_NAME, "generic")
    assert not compiler_process.on_disk()


@pytest.mark.usefixtures("packed")
def test_where_numba_has_settings_already_they_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", object())
    assert not shipped.take()
