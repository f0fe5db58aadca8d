"""A beam from its matrices with 500 DOFs, against one with 8: the contacts are what a point costs."""

from __future__ import annotations

import numpy as np

import solver
from benchmarks.harness import check, expect, table, timed
from solver import Scene
from solver.balance.balance import build

EI, MASS, LENGTH = 100.0, 1.0, 1.0  # N m², kg, m: a cantilever
SLIDERS = 4
LOST = 1e-4  # of the power: it is found by solving with the matrices, of condition 1e11, not by the modes
MESH = 1e-4  # relative, between the peaks of the two meshes; 4 elements leave 6e-5
ALLOWED = 2.0  # times as long a point


def beam(elements: int) -> Scene:
    """A cantilever of cubic Euler-Bernoulli elements, sliders at the quarters, the force at the tip."""
    length = LENGTH / elements
    n = 2 * (elements + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    a, b = length, length**2
    k = EI / length**3 * np.array(
        [[12, 6 * a, -12, 6 * a], [6 * a, 4 * b, -6 * a, 2 * b],
         [-12, -6 * a, 12, -6 * a], [6 * a, 2 * b, -6 * a, 4 * b]]
    )  # fmt: skip
    m = MASS * length / LENGTH / 420.0 * np.array(
        [[156, 22 * a, 54, -13 * a], [22 * a, 4 * b, 13 * a, -3 * b],
         [54, 13 * a, 156, -22 * a], [-13 * a, -3 * b, -22 * a, 4 * b]]
    )  # fmt: skip
    for element in range(elements):
        here = slice(2 * element, 2 * element + 4)
        K[here, here] += k
        M[here, here] += m
    M, K = M[2:, 2:], K[2:, 2:]
    places = [2 * (elements * (i + 1) // SLIDERS) - 2 for i in range(SLIDERS)]
    names = [f"w{i + 1}" for i in range(SLIDERS)]
    return Scene.from_dict(
        {
            "name": f"beam-{n - 2}",
            "structure": {
                "kind": "matrices",
                "M": M.tolist(),
                "K": K.tolist(),
                "damping_ratio": 0.005,
                "dofs": dict(zip(names, places, strict=True)),
            },
            "contacts": [
                {"name": f"slider{name}", "between": [name, "ground"], "kt": 200.0, "mu": 0.3, "N0": 1.0}
                for name in names
            ],
            "excitation": {"dof": names[-1], "amplitude": 1.0},
            "observe": {"dof": names[-1], "band": [3.0, 9.0]},
        }
    )


def beams() -> None:
    """A beam of 504 DOFs from its matrices and 4 contacts, against 8 DOFs and the same contacts."""
    rows, each, peaks = [], [], []
    for elements in (4, 252):  # a node at each quarter
        scene = beam(elements)
        _, decomposition = timed(lambda scene=scene: build(scene), runs=1, warm_up=0)
        branch, timing = timed(lambda scene=scene: solver.sweep(scene), runs=5)
        expect(f"{scene.name}: {branch.status.value}", branch.reached)
        expect(f"{scene.name}: residuals", bool(branch.residuals.max() <= 1e-9))
        points = len(branch.values)
        each.append(timing.cpu / points)
        peaks.append(branch.peak.value)
        solution = solver.solve(scene, frequency_hz=branch.peak.at)
        lost = solver.power_balance(solution).imbalance
        expect(f"power in is power out, but for {lost:.1e}", lost <= LOST)
        rows.append((scene.name, str(points), f"{1e3 * decomposition.cpu:.0f}", f"{1e3 * timing.cpu:.2f}",
                     f"{1e3 * each[-1]:.4f}", f"{branch.peak.value:.6g} m"))  # fmt: skip
    check("peak of the fine mesh", peaks[1], peaks[0], MESH)
    header = ("beam", "points", "first build ms", "ms (process)", "ms a point", "peak")
    table(f"504 DOFs and 8 DOFs, {SLIDERS} sliders each, H = 11", header, rows)
    print(f"a point with 504 DOFs takes {each[1] / each[0]:.2f} times as long; at most {ALLOWED:g} is wanted")
