"""The memory that dense matrices are said to take, against that of real solves in processes of their own."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import solver
from solver.studies.memory import dense_bytes, march_bytes

ROOT = Path(__file__).parents[3]
TWO: dict[str, Any] = solver.load_scene("two-dof").to_dict()
DISK: dict[str, Any] = solver.load_scene("bladed-disk").to_dict()

# What is loaded and compiled is loaded before, by small scenes of the same kinds.
MEASURED = """
import json, sys
from pathlib import Path
import solver

def peak(key):
    return 1024 * int(Path("/proc/self/status").read_text().partition(key + ":")[2].split()[0])

asked = json.load(sys.stdin)
few = solver.ContinuationSettings(most_points=8)
for what in ("small", "scene"):
    scene = solver.Scene.from_dict(asked[what])
    before = peak("VmSize")
    low, high = scene.observe.band
    if asked["do"] == "solve":
        solver.solve(scene, frequency_hz=0.5 * (low + high), harmonics=asked["harmonics"])
    else:
        solver.sweep(scene, start=low, stop=1.02 * low, harmonics=asked["harmonics"], settings=few)
print(peak("VmPeak") - before)
"""


def contacts(count: int) -> dict[str, Any]:
    return {**TWO, "contacts": [{**TWO["contacts"][0], "name": f"c{n}"} for n in range(count)]}


def masses(count: int, damper: bool) -> dict[str, Any]:
    names = [f"m{n}" for n in range(1, count + 1)]
    pairs = zip(names, [*names[1:], "ground"], strict=True)
    springs = [{"between": pair, "k": 1.0, "c": 0.01} for pair in pairs]
    structure = {"kind": "lumped", "masses": dict.fromkeys(names, 1.0), "springs": springs}
    if damper:
        structure["dampers"] = [{"between": ["m1", "ground"], "c": 0.3}]
    return {**TWO, "structure": structure}


def disk(sectors: int) -> dict[str, Any]:
    observe = {**DISK["observe"], "dof": f"{DISK['observe']['dof']}@0"}
    return {**DISK, "structure": {**DISK["structure"], "sectors": sectors}, "observe": observe}


def rubbing(count: int) -> dict[str, Any]:
    """A contact on each mass: no motion follows from others."""
    raw = masses(count, damper=False)
    rows = [
        {**TWO["contacts"][0], "name": f"c{n}", "between": [f"m{n}", "ground"]} for n in range(1, count + 1)
    ]
    return {**raw, "contacts": rows}


CASES: dict[str, tuple[dict[str, Any], dict[str, Any], str, int]] = {
    "contacts and harmonics": (rubbing(50), rubbing(8), "solve", 20),
    "contacts of two masses": (contacts(50), contacts(8), "solve", 20),
    "masses": (masses(700, damper=False), masses(20, damper=False), "solve", 1),
    "masses with a damper": (masses(400, damper=True), masses(20, damper=True), "solve", 1),
    "sectors": (disk(50), disk(3), "sweep", 2),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_a_solve_takes_about_the_memory_that_is_said(name: str) -> None:
    scene, small, do, harmonics = CASES[name]
    asked = {"scene": scene, "small": small, "do": do, "harmonics": harmonics}
    done = subprocess.run(
        [sys.executable, "-c", MEASURED], input=json.dumps(asked), capture_output=True, text=True, cwd=ROOT,
        check=True,
    )  # fmt: skip
    measured = int(done.stdout)
    told = dense_bytes(solver.Scene.from_dict(scene), harmonics).total
    assert 0.8 * measured < told < 3.0 * measured, (measured, told)


def test_memory_grows_with_each_size() -> None:
    def of(scene: dict[str, Any], harmonics: int = 3, every_sector: bool = False) -> int:
        return dense_bytes(solver.Scene.from_dict(scene), harmonics, every_sector=every_sector).total

    assert of(contacts(10), 20) < of(contacts(10), 40) < of(contacts(20), 40)
    assert of(masses(100, damper=False)) < of(masses(200, damper=False)) < of(masses(200, damper=True))
    assert of(DISK) < of(DISK, every_sector=True) < of(disk(100))
    assert march_bytes(solver.Scene.from_dict(disk(100))) == 4 * march_bytes(solver.Scene.from_dict(disk(50)))


def test_the_plan_says_it() -> None:
    scene = solver.load_scene("bladed-disk")
    assert solver.plan(scene, harmonics=5).to_json()["estimated_dense_bytes"] == dense_bytes(scene, 5).total
