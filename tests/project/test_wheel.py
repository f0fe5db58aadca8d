"""A wheel that brings its kernels: built, unpacked where no repository is, and asked with an empty cache."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from solver.jit.folder import target

ROOT = Path(__file__).parents[2]
BUILD = "import build_backend, sys; print(build_backend.build_wheel(sys.argv[1]))"
COMMAND = "import sys; from service.cli import process; sys.exit(process())"


@pytest.mark.long
@pytest.mark.skipif(target() is None, reason="this kind of processor has no wheels with kernels")
def test_a_wheel_with_kernels_compiles_nothing_for_shipped_scenes(tmp_path: Path) -> None:
    sources, wheels, installed = (tmp_path / name for name in ("sources", "wheels", "installed"))
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in tracked.splitlines():
        if not name.startswith(("tests/", "docs/", "benchmarks/")) and (ROOT / name).is_file():
            (sources / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, sources / name)
    wheels.mkdir()
    here = {name: value for name, value in os.environ.items() if not name.startswith("STICKSLIP_KERNELS")}
    subprocess.run(
        [sys.executable, "-c", BUILD, str(wheels)], cwd=sources, check=True,
        env={**here, "STICKSLIP_WHEEL_KERNELS": "1", "PYTHONPATH": f"{sources / 'deploy'}:{sources}"},
    )  # fmt: skip
    (wheel,) = wheels.glob("*.whl")
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
