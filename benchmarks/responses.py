"""Responses, single solves and designs of the shipped scenes, beside what the first release may take."""

from __future__ import annotations

import optim
import solver
from benchmarks.harness import table, timed

# scene, changed values, most milliseconds a response may take
RESPONSES = (
    ("two-dof", {"damper.N1": 0.0}, 50.0),
    ("two-dof", {}, 50.0),
    ("two-dof", {"damper.N1": 200.0}, 50.0),
    ("bladed-disk", {}, 150.0),
    ("bladed-disk", {"shroud.N0": 100.0}, 150.0),
    ("bladed-disk", {"shroud.N1": 400.0}, 150.0),
)
SOLVES = (
    ("two-dof", 1.198, 11),
    ("two-dof", 1.198, 61),
    ("bladed-disk", 755.0, 11),
    ("bladed-disk", 755.0, 61),
)


def responses() -> None:
    """Time the frequency response over the scene's band at 11 harmonics."""
    rows = []
    for name, values, allowed in RESPONSES:
        scene = solver.load_scene(name).with_values(values)
        branch, timing = timed(lambda scene=scene: solver.sweep(scene))
        points = len(branch.values)
        changed = ", ".join(f"{path} = {value:g}" for path, value in values.items())
        rows.append(
            (
                name, changed or "as shipped", str(points), str(branch.newton_iterations),
                f"{1e3 * timing.median:.1f}", f"{1e3 * timing.least:.1f}",
                f"{1e3 * timing.median / points:.3f}", f"{allowed:g}", f"{branch.peak.value:.6g} m",
            )
        )  # fmt: skip
    header = ("scene", "values", "points", "iterations", "ms", "least ms", "ms a point", "allowed ms", "peak")
    table("Frequency response, H = 11, warm, one thread", header, rows)


def solves() -> None:
    """Time single responses, their error estimate included."""
    rows = []
    for name, frequency, harmonics in SOLVES:
        scene = solver.load_scene(name)
        answer, timing = timed(
            lambda s=scene, f=frequency, h=harmonics: solver.solve(s, frequency_hz=f, harmonics=h)
        )
        rows.append(
            (name, f"{frequency:g} Hz", str(harmonics), f"{1e3 * timing.median:.2f}",
             f"{answer.max_abs:.9g} m",
             f"{answer.error_estimate:.1e} m", f"{answer.residual:.0e}")
        )  # fmt: skip
    table("One response", ("scene", "at", "H", "ms", "max|x|", "error estimate", "residual"), rows)


def designs() -> None:
    """Time the choice of one normal load between 20 and 3000 N."""
    rows = []
    for name, path in (("two-dof", "damper.N0"), ("bladed-disk", "shroud.N0")):
        scene = solver.load_scene(name)
        result, timing = timed(lambda s=scene, p=path: optim.design(s, variables={p: (20.0, 3000.0)}), runs=3)
        rows.append(
            (name, f"{result.optimum[path]:.4f} N", f"{result.peak.value:.8g} m", str(result.evaluations),
             f"{1e3 * timing.median:.0f}", f"{result.optimality:.0e}")
        )  # fmt: skip
    table("Design of the normal load", ("scene", "optimum", "peak", "responses", "ms", "optimality"), rows)
