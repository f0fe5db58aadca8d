"""Distributions: built from what is tracked, and used where no repository is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from solver.jit.folder import target

ROOT = Path(__file__).parents[2]
COMMAND = "import sys; from service.cli import process; sys.exit(process())"


def tracked_sources(place: Path) -> Path:
    """Copy what a distribution is made of into a folder."""
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in tracked.splitlines():
        if not name.startswith(("tests/", "docs/", "benchmarks/")) and (ROOT / name).is_file():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, place / name)
    return place


def built(sources: Path, kind: str, place: Path, **settings: str) -> Path:
    """Build a distribution of one kind, wheel or sdist; return its file."""
    place.mkdir()
    here = {name: value for name, value in os.environ.items() if not name.startswith("STICKSLIP_KERNELS")}
    program = f"import build_backend, sys; build_backend.build_{kind}(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", program, str(place)], cwd=sources, check=True,
        env={**here, **settings, "PYTHONPATH": f"{sources / 'deploy'}:{sources}"},
    )  # fmt: skip
    (made,) = place.iterdir()
    return made


def test_a_wheel_made_of_the_sdist_runs_the_demonstration_without_the_repository(tmp_path: Path) -> None:
    sdist = built(tracked_sources(tmp_path / "sources"), "sdist", tmp_path / "sdist")
    with tarfile.open(sdist) as packed:
        packed.extractall(tmp_path / "unpacked", filter="data")
    (sources,) = (tmp_path / "unpacked").iterdir()
    wheel = built(sources, "wheel", tmp_path / "wheel")
    for gone in ("sources", "unpacked"):
        shutil.rmtree(tmp_path / gone)

    home = tmp_path / "environment"
    venv.create(home, with_pip=True)
    python = home / "bin" / "python"
    subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", str(wheel)], check=True
    )
    # What it depends on is not installed once more: it is found where this process has it.
    packages = sysconfig.get_paths(vars={"base": str(home), "platbase": str(home)})["purelib"]
    Path(packages, "dependencies.pth").write_text(sysconfig.get_paths()["purelib"], encoding="utf-8")
    alone = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    used = tmp_path / "used"
    used.mkdir()

    def said(*command: str | Path) -> str:
        done = subprocess.run(
            command, cwd=used, check=False, capture_output=True, text=True, env=alone, timeout=600
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert version in said(home / "bin" / "stickslip", "--version")
    where = said(
        python, "-c", "import optim, service, solver, stickslip as s; print(s.__file__, solver.__file__)"
    )
    assert all(one.startswith(str(home)) for one in where.split())
    assert "N" in said(home / "bin" / "stickslip", "demo")
    assert list(used.rglob("*.png")), "the demonstration drew nothing"


@pytest.mark.long
@pytest.mark.skipif(target() is None, reason="this kind of processor has no wheels with kernels")
def test_a_wheel_with_kernels_compiles_nothing_for_shipped_scenes(tmp_path: Path) -> None:
    sources, installed = tracked_sources(tmp_path / "sources"), tmp_path / "installed"
    wheel = built(sources, "wheel", tmp_path / "wheels", STICKSLIP_WHEEL_KERNELS="1")
    here = {name: value for name, value in os.environ.items() if not name.startswith("STICKSLIP_KERNELS")}
    assert "-none-linux_" in wheel.name
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(installed)

    def compiled() -> int:
        return len(list((tmp_path / "cache").rglob("*.nb?")))

    came: set[int] = set()
    for asked in (
        ("solve", "two-dof", "--frequency", "1"), ("design", "two-dof"), ("design", "bladed-disk"),
        ("solve", "platform-wedge", "--frequency", "420"), ("solve", "fe-disk", "--frequency", "1000"),
    ):  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", COMMAND, *asked], cwd=tmp_path, check=False, capture_output=True,
            text=True, env={**here, "XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(installed)},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert "stickslip: " not in done.stderr, "it waits for a compiler, or does without"
        came.add(compiled())
    assert len(came) == 1, "more was compiled"
