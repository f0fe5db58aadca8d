"""Performance curves from one nonlinear mode against exact peaks: accuracy and time."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

import solver
from benchmarks.harness import expect, table, timed


class Case(NamedTuple):
    """A scene, its mode, modal amplitudes [√kg m], and factors on the excitation that are compared."""

    scene: str
    mode: int
    amplitudes: tuple[float, float]
    factors: tuple[float, float]
    harmonics: int


CASES = (
    Case("two-dof", 1, (1e-2, 1e3), (0.05, 8.0), 11),
    Case("bladed-disk", 1, (1e-6, 1e-1), (0.1, 3.0), 11),
    Case("shroud-3d", 1, (1e-7, 1e-2), (0.1, 5.0), 5),
    Case("fe-disk", 1, (1e-8, 1.0), (0.2, 5.0), 5),
)
LEVELS = 24  # excitations compared
PATH = "excitation.amplitude"


def modes() -> None:
    """Peaks over the excitation: one nonlinear mode against sweeps and the tracked peak."""
    rows = []
    for case in CASES:
        scene = solver.load_scene(case.scene)
        own = scene.value(PATH)

        def approximate(case: Case = case, scene: solver.Scene = scene) -> solver.PerformanceCurve:
            found = solver.nonlinear_mode(
                scene, case.mode, amplitudes=case.amplitudes, harmonics=case.harmonics, errors=False
            )
            return solver.performance_curve(found)

        curve, quick = timed(approximate, runs=5)
        expect(f"the mode of {case.scene}: {curve.mode.status.value}", curve.mode.reached)
        levels = np.geomspace(*case.factors, LEVELS)
        begun, exact = time.process_time(), []
        for level in levels:
            branch = solver.sweep(scene.with_values({PATH: own * level}), harmonics=case.harmonics)
            exact.append(np.nan if branch.peak is None or not branch.reached else branch.peak.value)
        swept = time.process_time() - begun
        begun = time.process_time()
        track = solver.track_peak(
            scene, PATH, own * case.factors[0], own * case.factors[1], harmonics=case.harmonics
        )
        tracked = time.process_time() - begun
        errors = np.array([curve.at_excitation(float(f))[0] for f in levels]) / np.array(exact) - 1.0
        off = np.abs(errors[np.isfinite(errors)])
        rows.append(
            (
                case.scene, f"{curve.excitation.size}", f"{100.0 * np.median(off):.1f} %",
                f"{100.0 * np.quantile(off, 0.9):.1f} %", f"{100.0 * off.max():.0f} %",
                f"{1e3 * quick.cpu:.0f}", f"{1e3 * swept:.0f}", f"{swept / quick.cpu:.0f}",
                f"{1e3 * tracked:.0f}" + ("" if track.reached else " (not whole)"),
                f"{tracked / quick.cpu:.1f}",
            )
        )  # fmt: skip
    header = (
        "scene", "points", "median error", "90 % below", "largest", "mode [ms]",
        f"{LEVELS} sweeps [ms]", "ratio", "track [ms]", "ratio",
    )  # fmt: skip
    table("Peaks over the excitation from one nonlinear mode (process time)", header, rows)
