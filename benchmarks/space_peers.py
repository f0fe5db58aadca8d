"""Responses under loads that move beside tmdsimpy in one run: the same masses over the same band."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

import solver
from benchmarks.harness import expect, table, timed
from benchmarks.modes_peers import SAMPLES, by_tmdsimpy
from benchmarks.space import masses
from solver import Scene
from solver.linear.assembly import linear_model

HARMONICS = 11
STEP = 0.1  # arc length of tmdsimpy
PEAK_OFF = 1e-3  # relative: it has the points of its branch, and samples the force


def space_peers() -> None:
    """One and four masses in space that rub under a load they move, H = 11, beside tmdsimpy."""
    rows: list[tuple[str, ...]] = []
    for count in (1, 4):
        scene = masses(count, "elastic-normal")
        branch, timing = timed(partial(solver.sweep, scene, harmonics=HARMONICS), runs=5)
        expect(f"{scene.name}: {branch.status.value}", branch.reached)
        assert branch.peak is not None
        ours = f"{branch.peak.value:.6g}"
        rows.append((scene.name, "stickslip", str(len(branch.values)), f"{1e3 * timing.cpu:.1f}", "", ours))
        rows.append((scene.name, "tmdsimpy", *_beside(scene, branch.peak.value, timing.cpu)))
    header = ("branch", "code", "points", "ms (process)", "times slower", "peak, m")
    table(f"Moving loads, H = {HARMONICS}; tmdsimpy at {SAMPLES} instants a period", header, rows)


def _beside(scene: Scene, peak: float, ours: float) -> tuple[str, ...]:
    told = by_tmdsimpy(_task(scene))
    if isinstance(told, str):
        return told, "", "", ""
    expect(f"{scene.name}: its peak is ours", abs(told["peak"] / peak - 1.0) < PEAK_OFF)
    seconds = told["cpu_seconds"]
    return str(told["points"]), f"{1e3 * seconds:.0f}", f"{seconds / ours:.0f}", f"{told['peak']:.6g}"


def _task(scene: Scene) -> dict[str, Any]:
    """Return the problem of the runner: matrices, contacts with the ground and forces, by numbers of DOFs."""
    model, at = linear_model(scene), {name: i for i, name in enumerate(scene.dofs)}
    cosine, sine = np.zeros((2, len(at)))
    for force in scene.excitation:
        cosine[at[str(force.dof)]] += force.amplitude * math.cos(force.phase)
        sine[at[str(force.dof)]] -= force.amplitude * math.sin(force.phase)
    laws: tuple[Any, ...] = scene.contacts
    contacts = [
        {
            "tangential": at[one.between[0]], "normal": at[one.normal_between[0]],
            "kt": one.kt, "kn": one.kn, "mu": one.mu, "N0": one.N0,
        }
        for one in laws
    ]  # fmt: skip
    return {
        "M": model.M.tolist(), "C": model.C0.tolist(), "K": model.K0.tolist(), "contacts": contacts,
        "cosine": cosine.tolist(), "sine": sine.tolist(), "observed": at[scene.observe.dof],
        "omega": [2.0 * math.pi * f for f in scene.observe.band], "harmonics": HARMONICS, "samples": SAMPLES,
        "step": STEP, "runs": 1, "what": "response",
    }  # fmt: skip
