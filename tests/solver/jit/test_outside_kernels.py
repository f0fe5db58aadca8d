"""A kernel from outside the package is kept on disk, and compiled anew after its file changed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNEL = """
from solver.jit.decorators import compiled


@compiled
def outside(x: float) -> float:
    return {} * x
"""
CALL = "from kernels_of_mine import outside; print(outside(3.0), sum(outside.stats.cache_hits.values()))"


@pytest.mark.long
def test_it_is_compiled_anew_after_its_file_changed(tmp_path: Path) -> None:
    module = tmp_path / "kernels_of_mine.py"
    root = Path(__file__).resolve().parents[3]
    paths = os.pathsep.join((str(tmp_path), str(root)))
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")

    def called(factor: float) -> str:
        module.write_text(KERNEL.format(factor))
        done = subprocess.run(
            [sys.executable, "-c", CALL], env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert called(2.0) == "6.0 0"
    assert called(2.0) == "6.0 1"
    assert called(5.0) == "15.0 0"
