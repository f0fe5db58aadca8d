"""Time of a point in space: masses with a contact each, a damper of many points, many nodes on modes."""

from __future__ import annotations

import math
import resource
import time
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from benchmarks.harness import expect, table, timed
from solver import ContinuationSettings, Scene, load_scene
from solver.balance.balance import build
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.residual import evaluate
from solver.balance.workspace import Workspace
from solver.continuation.branches.sweep import walk_branch
from solver.linear.kernels.receptance import receptance

K0 = 4.0 * math.pi**2  # N/m: 1 Hz with 1 kg
SOLVES = 50  # of 23 × 23 in one run of the clock
RUNS, LONG = 3, 5.0  # times a branch is followed; seconds of one that is not followed again
GIB = 1024.0**2  # ru_maxrss is in KiB


class Case(NamedTuple):
    """What is timed: a scene, its highest harmonic and the milliseconds that a point may take."""

    name: str
    scene: Scene
    harmonics: int
    wanted: float


def masses(count: int, law: str) -> Scene:
    """Points of 1 kg with x, y and z in a row, each rubbing on the ground.

    `elastic-normal` rubs along x alone, `coulomb-3d` along x and y; z moves the load of both.
    """
    names = [f"p{i + 1}" for i in range(count)]
    springs: list[dict[str, Any]] = []
    for axis, k in (("x", 1.0), ("y", 1.3), ("z", 2.0)):
        springs += [{"between": [f"{name}{axis}", "ground"], "k": k * K0, "c": 0.4} for name in names]
        pairs = pairwise(names)
        springs += [{"between": [f"{a}{axis}", f"{b}{axis}"], "k": 0.5 * K0, "c": 0.1} for a, b in pairs]
    second = {"between_second": "y"} if law == "coulomb-3d" else {}
    ends = {"between": "x", **second, "normal_between": "z"}
    return Scene.from_dict(
        {
            "name": f"{law}-{count}",
            "structure": {
                "kind": "lumped",
                "masses": {f"{name}{axis}": 1.0 for name in names for axis in "xyz"},
                "springs": springs,
            },
            "contacts": [
                {
                    "name": f"on_{name}", "law": law, "kt": 0.7 * K0, "kn": K0, "mu": 0.3,
                    "N0": 60.0 + 40.0 * i / count,
                    **{key: [name + axis, "ground"] for key, axis in ends.items()},
                }
                for i, name in enumerate(names)
            ],
            "excitation": [
                {"dof": f"{name}{axis}", "amplitude": amplitude, "phase": phase + 0.1 * i}
                for i, name in enumerate(names)
                for axis, amplitude, phase in (("x", 20.0, 0.0), ("y", 12.0, 1.2), ("z", 12.0, 0.5))
            ],
            "observe": {"dof": f"{names[-1]}x", "band": [0.7, 1.7]},
        }
    )  # fmt: skip


def damper(points: int = 25) -> Scene:
    """The shipped wedge with many points a face, each blade with a row of masses that gives it 20 modes."""
    raw = load_scene("platform-wedge").to_dict()
    structure, rows = raw["structure"], {blade: [f"{blade}{i}" for i in range(17)] for blade in "ab"}
    for blade, row in rows.items():
        structure["masses"].update(dict.fromkeys(row, 0.004))
        ends = pairwise([f"{blade}x", *row])
        structure["springs"] += [{"between": [*pair], "k": 4.0e6, "c": 0.5} for pair in ends]
    return Scene.from_dict({**raw, "name": f"damper-2x{points}"}).with_values({"wedge.points": points})


def plate(nodes: int = 100, modes: int = 40) -> Scene:
    """Many nodes of a plate given by its modes, each rubbing on the ground in space."""
    rng = np.random.default_rng(5)
    side = math.isqrt(nodes)
    x, y = np.stack(np.meshgrid(*2 * [np.linspace(0.05, 0.95, side)])).reshape(2, -1)
    shapes = np.zeros((3 * nodes, modes))
    frequencies = np.zeros(modes)
    for m in range(modes):
        i, j = m // 3 % 4, m // 12
        field = np.cos(math.pi * i * x) * np.cos(math.pi * j * y) * (1.0 + 0.05 * rng.normal())
        for axis in range(3):
            shapes[axis::3, m] = (1.0 if axis == m % 3 else 0.15) * field / math.sqrt(side)
        frequencies[m] = (1.0, 1.15, 1.4)[m % 3] * (1.0 + 0.6 * (i + j))
    return Scene.from_dict(
        {
            "name": "plate",
            "structure": {
                "kind": "matrices",
                "modes": {
                    "frequencies_hz": frequencies.tolist(), "modes": shapes.tolist(), "damping_ratio": 0.02,
                },
                "dofs": [f"n{i}{axis}" for i in range(nodes) for axis in "xyz"],
            },
            "contacts": [
                {
                    "name": f"on_{i}", "law": "coulomb-3d", "between": [f"n{i}x", "ground"],
                    "between_second": [f"n{i}y", "ground"], "normal_between": [f"n{i}z", "ground"],
                    "kt": 0.08 * K0, "kn": 0.1 * K0, "mu": 0.3, "N0": 3.0 + 3.0 * i / nodes,
                }
                for i in range(nodes)
            ],
            "excitation": [
                {"dof": f"n{i}{axis}", "amplitude": amplitude, "phase": phase}
                for i in range(0, nodes, 7)
                for axis, amplitude, phase in (("x", 40.0, 0.0), ("y", 30.0, 1.2), ("z", 10.0, 0.5))
            ],
            "observe": {"dof": "n0x", "band": [0.8, 1.6]},
        }
    )  # fmt: skip


def cases() -> tuple[Case, ...]:
    """Return what the table shows, with the milliseconds wanted."""
    return (
        *(
            Case(f"{count} masses, moving load", masses(count, "elastic-normal"), 11, wanted)
            for count, wanted in ((1, 0.12), (4, 0.6), (16, 4.0))
        ),
        *(
            Case(f"{count} masses, circle", masses(count, "coulomb-3d"), 11, wanted)
            for count, wanted in ((1, 0.5), (4, 2.5), (16, 10.0))
        ),
        Case("rigid damper, 2 x 25 points", damper(), 7, 10.0),
        Case("100 nodes on 40 modes", plate(), 5, 50.0),
    )


class Cost(NamedTuple):
    """What a branch took: its points, process seconds of each, of an evaluation, and of factors and solve."""

    points: int
    point: float
    evaluation: float
    factors: float


def cost(case: Case) -> Cost:
    """Follow the response over the band, as `sweep` does, and time a point and what it is made of."""
    balance = build(case.scene, harmonics=case.harmonics)
    low, high = case.scene.observe.band
    best, points, last = math.inf, 0, np.zeros(0)
    for _ in range(RUNS):
        workspace = Workspace.of(balance)
        start = workspace.solve(balance.parameter.inside(low))
        expect(f"{case.name}: the start converges", start.converged)
        begun = time.process_time()
        stretches = list(walk_branch(workspace, low, high, ContinuationSettings(), start.u))
        seconds = time.process_time() - begun
        expect(
            f"{case.name}: the branch ends {stretches[-1].status}", stretches[-1].status.name == "COMPLETED"
        )
        points = sum(len(stretch.solutions) for stretch in stretches)
        best, last = min(best, seconds / points), stretches[len(stretches) // 2].solutions[-1]
        if seconds > LONG:
            break
    u, p = last[:-1].copy(), float(last[-1])
    system, linear, point = workspace.system, workspace.linear, workspace.point

    def once() -> None:
        receptance(system, p, linear)
        expect("it is a solution", evaluate(system, linear, u, p, 0.0, point) < 1e-8)

    right = np.zeros(u.size)

    def solved() -> None:
        expect("it is regular", factorise(system, linear, point, right, 0.0, 0.0) != 0.0)
        step_back(system, point, right)

    runs = max(3, int(0.05 / best))
    return Cost(points, best, timed(once, runs=runs)[1].cpu, timed(solved, runs=runs)[1].cpu)


def space() -> None:
    """Print the milliseconds of an accepted point of a branch beside those wanted."""
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=(23, 23)), rng.normal(size=23)
    solve = timed(lambda: [np.linalg.solve(matrix, right) for _ in range(SOLVES)], runs=200)[1].cpu / SOLVES
    rows = []
    for case in cases():
        found = cost(case)
        rows.append(
            (case.name, str(build(case.scene, harmonics=case.harmonics).n_unknowns), str(found.points),
             f"{1e3 * found.point:.3g}", f"{case.wanted:g}", f"{1e3 * found.evaluation:.3g}",
             f"{1e3 * found.factors:.3g}")
        )  # fmt: skip
    table(
        "an accepted point of a branch over the frequency, all that it costs, one thread; "
        f"a 23 × 23 solve takes {1e6 * solve:.1f} µs",
        ("case", "unknowns", "points", "ms a point", "wanted", "ms an evaluation", "ms factors and a solve"),
        rows,
    )
    print(f"largest memory of the process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / GIB:.2f} GiB")
