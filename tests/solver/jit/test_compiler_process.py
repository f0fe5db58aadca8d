"""Who finds no kernels on disk: small problems interpreted, others wait, one process compiles."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from each import each

import solver
from solver.jit import compiler_process

ROOT = Path(__file__).parent.parent.parent.parent
# Stands for the compiler: it is there, tells how far it is, and marks all as done when a file appears.
COMPILER = """
import sys, time
from pathlib import Path
from solver.jit import compiler_process
with compiler_process.compiling(wait=False) as mine:
    with open(compiler_process.folder() / "began", "a") as began:
        began.write("mine\\n" if mine else "other\\n")
    if mine:
        compiler_process.note(3, 7)
        while not (compiler_process.folder() / "go").exists():
            time.sleep(0.02)
        compiler_process.compiled(compiler_process.Stage.FIRST)
"""
"""What a command does before it computes."""
PREPARES = """
import sys
from solver.jit import compiler_process
compiler_process.COMPILER, compiler_process._LINE, compiler_process._PATIENCE = "compiler", 0.1, 5.0
compiler_process.prepare(lambda: float(sys.argv[1]))
print(compiler_process.interprets(), compiler_process.on_disk())
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the kernels of processes that begin with none, and with a compiler that is none."""
    (tmp_path / "compiler.py").write_text(COMPILER, "utf-8")
    monkeypatch.delenv(compiler_process.SETTING, raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(ROOT)]))
    code = "from solver.jit.folder import folder; print(folder())"
    found = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    yield Path(found.stdout.strip())
    (Path(found.stdout.strip()) / "go").touch()


def started(cost: float) -> subprocess.Popen[str]:
    """A process that prepares its kernels for something that takes so much."""
    return subprocess.Popen(
        [sys.executable, "-c", PREPARES, str(cost)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_small_problems_begin_at_once_and_two_processes_share_one_compiler(folder: Path) -> None:
    both = [started(1.0), started(1.0)]
    ended = [one.communicate(timeout=60) for one in both]
    for told, said in ended:
        assert told == "True False\n"
        assert said.startswith("stickslip: computed without waiting for the compiler")
    deadline = time.monotonic() + 30.0
    while not (folder / "began").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    # It outlives both, and whoever comes now waits for it or not, but begins no other.
    third, said = started(1.0).communicate(timeout=60)
    assert third == "True False\n"
    assert "3 of 7 kernels" in said
    assert (folder / "began").read_text("utf-8").count("mine") == 1


def test_a_large_problem_waits_and_says_how_far_it_is(folder: Path) -> None:
    process = started(1e9)
    deadline = time.monotonic() + 30.0
    while not (folder / "progress").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    assert process.poll() is None
    (folder / "go").touch()
    told, said = process.communicate(timeout=60)
    assert told == "False True\n"
    assert "waits for the compiler, once for this version: 3 of 7 kernels" in said
    # What comes next finds them, and says nothing.
    assert started(1e9).communicate(timeout=60) == ("False True\n", "")


def test_where_the_compiler_fails_nobody_waits_for_ever(folder: Path) -> None:
    (folder.parent.parent.parent / "compiler.py").write_text("raise SystemExit(1)", "utf-8")
    told, said = started(1e9).communicate(timeout=60)
    assert told == "False False\n"
    assert said.count("waits for the compiler") > 1


@each(
    ("kind", "scene", "asked", "small"),
    [
        ("solve", "two-dof", {"frequency_hz": 1.0}, True),
        ("design", "two-dof", {"harmonics": 11, "method": "auto"}, True),
        ("design", "two-dof", {"method": "minimax"}, False),
        ("design", "bladed-disk", {"variables": {"shroud.N0": (20.0, 3000.0)}}, True),
        ("design", "two-dof", {"uncertain": {}}, False),
        ("map", "two-dof", {}, False),
        ("sweep", "shroud-3d", {}, False),
        ("sweep", "two-dof", {"harmonics": 401}, False),
    ],
)
def test_what_is_small(kind: str, scene: str, asked: dict[str, object], small: bool) -> None:
    assert (compiler_process.cost(kind, solver.load_scene(scene), asked) <= compiler_process.SMALL) is small


@pytest.mark.parametrize("arguments", ["solve two-dof --frequency 1", "design two-dof"])
def test_a_command_prepares_before_it_loads_a_kernel(folder: Path, arguments: str) -> None:
    code = (
        "import sys; from solver.jit import compiler_process; compiler_process.COMPILER = 'compiler';"
        "from service.cli.table import run; sys.exit(run(sys.argv[1:]))"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code, *arguments.split(), "--harmonics", "1", "--json"], check=False,
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr.count("\n") == 1
    assert "computed without waiting for the compiler" in ran.stderr
    assert not list(folder.glob("*.nbi")), "nothing was compiled on the way"


def test_a_script_prepares_before_it_loads_a_kernel(folder: Path) -> None:
    code = (
        "import solver; from solver.jit import compiler_process; compiler_process.COMPILER = 'compiler'\n"
        "print(solver.solve('two-dof', frequency_hz=1.0, harmonics=1).max_abs)"
    )
    ran = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert float(ran.stdout) > 0.0
    assert "computed without waiting for the compiler" in ran.stderr
    assert not list(folder.glob("*.nbi"))
