"""Interpreted kernels give the numbers of compiled ones, without Numba, and a debugger stops in them."""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_kernels import TOLERANCE, kernels_called_by_tests

import solver
from solver.contacts.kernels.coulomb import line_force as force

ROOT = Path(__file__).parent.parent.parent.parent
INTERPRETED = {
    **os.environ, "STICKSLIP_KERNELS": "interpreted",
    "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests" / "cases")]),
}  # fmt: skip
# Whoever asks for Numba fails.
WITHOUT_NUMBA = "import sys; sys.modules['numba'] = sys.modules['llvmlite'] = None"
NUMBERS = f"""
{WITHOUT_NUMBA}
import json
from test_interpreted_kernels import numbers
print(json.dumps(numbers(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4] == "sweep")))
"""
REPLAY = f"""
{WITHOUT_NUMBA}
import json
from recorded_kernels import replayed
print(json.dumps(replayed(sys.argv[1])))
"""
DEBUGGER = f"""
{WITHOUT_NUMBA}
import bdb
import solver

class Stops(bdb.Bdb):
    def user_line(self, frame):
        if frame.f_code.co_name == "contact_force":
            print(f"stopped with kt = {{frame.f_locals['kt']}} N/m")
            self.clear_all_breaks()
        self.set_continue()

scene, stops = solver.load_scene("two-dof"), Stops()
assert stops.set_break(sys.argv[1], int(sys.argv[2])) is None
stops.runcall(solver.solve, scene, frequency_hz=1.0, harmonics=1)
"""


def numbers(name: str, frequency_hz: float, harmonics: int, sweeps: bool) -> list[list[float]]:
    """Figures of one response, and of all of them, of a shipped scene."""
    scene = solver.load_scene(name)
    one = solver.solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    found = [one.observed.tolist()]
    if sweeps:
        branch = solver.sweep(scene, harmonics=harmonics)
        found += [[branch.peak.value, branch.peak.at], branch.values.tolist()]
    return found


def interpreted(*arguments: object, code: str = NUMBERS) -> subprocess.CompletedProcess[str]:
    """Run Python with the kernels interpreted; warnings are errors."""
    path = f"{INTERPRETED['PYTHONPATH']}{os.pathsep}{Path(__file__).parent}"
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code, *map(str, arguments)], cwd=ROOT, check=False,
        env={**INTERPRETED, "PYTHONPATH": path}, capture_output=True, text=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "frequency_hz", "harmonics", "sweeps"),
    [
        ("two-dof", 1.0, 3, True),
        *(pytest.param(*case, marks=pytest.mark.long) for case in [
            ("two-dof", 1.0, 11, True), ("bladed-disk", 755.0, 11, True), ("fe-disk", 300.0, 3, True),
            ("shroud-3d", 400.0, 3, True), ("platform-wedge", 360.0, 3, False),
            ("platform-cylinder", 360.0, 3, False),
        ]),
    ],
)  # fmt: skip
def test_a_shipped_scene_has_the_same_numbers(
    name: str, frequency_hz: float, harmonics: int, sweeps: bool
) -> None:
    ran = interpreted(name, frequency_hz, harmonics, "sweep" if sweeps else "solve")
    assert ran.returncode == 0, ran.stderr
    compiled = numbers(name, frequency_hz, harmonics, sweeps)
    for one, other in zip(json.loads(ran.stdout), compiled, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * np.abs(other).max())


def test_a_debugger_stops_inside_the_friction_law() -> None:
    lines, begin = inspect.getsourcelines(inspect.unwrap(force.contact_force))
    first = next(i for i, line in enumerate(lines) if line.startswith("    n = "))
    file = inspect.getsourcefile(force)
    ran = interpreted(file, begin + first, code=DEBUGGER)
    assert ran.returncode == 0, ran.stderr
    kt = solver.load_scene("two-dof").contacts[0].kt
    assert ran.stdout == f"stopped with kt = {kt} N/m\n"


def test_a_way_that_is_none_is_refused() -> None:
    environment = {**INTERPRETED, "STICKSLIP_KERNELS": "fast"}
    ran = subprocess.run(
        [sys.executable, "-c", "import solver.jit.decorators"], env=environment, cwd=ROOT, check=False,
        capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 1
    assert "STICKSLIP_KERNELS is 'fast', and must be one of compiled, plain, interpreted" in ran.stderr


def replay(tests: list[str], folder: Path) -> dict[str, float]:
    """Run tests compiled, make their calls of kernels again interpreted: how far each kernel is off."""
    calls = folder / "calls"
    environment = {**os.environ, "KERNEL_CALLS": str(calls), "PYTHONPATH": INTERPRETED["PYTHONPATH"]}
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "recorded_kernels", *tests],
        env=environment, cwd=ROOT, check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr[-2000:]
    again = interpreted(calls, code=REPLAY)
    assert again.returncode == 0, again.stderr
    off: dict[str, float] = {}
    for name, difference in json.loads(again.stdout):
        off[name] = max(difference, off.get(name, 0.0))
    return off


def test_kernels_called_by_a_test_are_the_same(tmp_path: Path) -> None:
    off = replay(["tests/solver/jit/test_angles.py", "tests/solver/balance/test_banded.py"], tmp_path)
    assert {
        "solver.jit.trig_polynomial:cosines_and_sines",
        "solver.balance.kernels.banded:solve_band",
    } <= off.keys()
    assert max(off.values()) <= TOLERANCE, off


@pytest.mark.long
def test_every_kernel_called_by_a_test_is_the_same(tmp_path: Path) -> None:
    called = kernels_called_by_tests()
    cases = {path.stem for path in called if path.parent.name == "cases"}
    files = [
        path for path in (*ROOT.glob("tests/solver/**/test_*.py"), *ROOT.glob("stickslip/lab/*/tests/*.py"))
        if path in called or any(f"from {name} import" in path.read_text("utf-8") for name in cases)
        if path != Path(__file__)
    ]  # fmt: skip
    off = replay([str(path) for path in files], tmp_path)
    assert set().union(*called.values()) - off.keys() == set()
    assert max(off.values()) <= TOLERANCE, off
