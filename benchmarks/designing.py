"""The design layer: what an optimum costs beside brute force with the same solver and beside other codes."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

import optim
import solver
from benchmarks.harness import Timing, check, expect, table, timed
from benchmarks.peers import HOW, pyharm_optimum
from benchmarks.problems import case_a

# scene, path, bounds [N], optimum [N], its peak [m], ms allowed
_ONE = (
    ("two-dof", "damper.N0", 20.0, 500.0, 104.7882563, 2.3461731462, 30.0),
    ("bladed-disk", "shroud.N0", 20.0, 3000.0, 185.4609022, 1.0026156142e-4, 150.0),
    ("case A", "damper.N0", 20.0, 3000.0, 344.947, 6.759579, 50.0),
)
GRID = 101  # loads of the grid that brute force starts with
XATOL = 1e-4  # N, of SciPy's bounded search after it
_BRACKET = (100.0, 1000.0)  # N, where SciPy finds the optimum of case A
RESPONSES = 5.0  # work allowed
FIVE = {
    "bladed-disk": (
        {
            "shroud.N0": (50.0, 2000.0), "shroud.kt": (4e6, 8e6), "shroud.mu": (0.2, 0.4),
            "shroud.N1_ratio": (0.1, 0.5), "root.N0": (3000.0, 8000.0),
        },
        {"limit": 0.8e-4, "max_band_hz": 40.0, "max_friction_work": {"shroud": 0.04}},
    ),
    "two-dof": (
        {
            "damper.N0": (20.0, 500.0), "damper.kt": (20.0, 40.0), "damper.mu": (0.2, 0.4),
            "damper.N1_ratio": (0.0, 0.5), "structure.k2": (35.0, 45.0),
        },
        {"limit": 1.5, "max_band_hz": 0.3, "max_friction_work": {"damper": 101.8}},
    ),
}  # fmt: skip

UNCERTAIN = {
    "uncertain": {"shroud.kt": [4.4e6, 6.6e6], "shroud.mu": [0.2, 0.4]},
    "variables": {"shroud.N0": (20.0, 3000.0)},
}
CASES = {
    "cases": [
        {"name": "as built"},
        {"name": "more force", "set": {"excitation.amplitude": 130.0}, "weight": 0.8},
        {"name": "driven mass", "observe": "m1", "weight": 0.9},
    ],
    "variables": {"damper.N0": (20.0, 3000.0), "damper.kt": (10.0, 60.0)},
    "limit": 4.0, "max_band_hz": 0.45, "harmonics": 5,
}  # fmt: skip


def one_variable() -> None:
    """The best normal load by every method, beside a grid and SciPy's search over the same sweeps."""
    rows = []
    for name, path, low, high, at, peak, wanted in _ONE:
        scene = case_a() if name == "case A" else solver.load_scene(name)
        _, once = timed(lambda scene=scene: solver.sweep(scene))
        for method, runs in (("tracked", 7), ("minimax", 3), ("ipopt", 1)):
            result, spent = timed(
                lambda scene=scene, path=path, low=low, high=high, method=method: optim.design(
                    scene, variables={path: (low, high)}, method=method
                ),
                runs=runs,
            )
            rows.append(_row(name, method, result, path, at, peak, spent, once, wanted))
        rows.append(_brute_force(name, scene, path, (low, high), peak, once))
    header = ("scene", "how", "N0 N", "peak m", "responses", "ms (process)", "ms (wall)", "wanted ms",
              "in responses")  # fmt: skip
    table("One variable: the best normal load", header, rows)
    _beside_pyharm()


def _row(
    name: str, method: str, result: optim.DesignResult, path: str, at: float, peak: float, spent: Timing,
    once: Timing, wanted: float,
) -> tuple[str, ...]:  # fmt: skip
    expect(f"{name}, {method}: {result.status.value}", result.reached)
    check(f"best load of {name}, {method}", result.optimum[path], at, 1e-5)
    ratio = spent.cpu / once.cpu
    return (
        name, method, f"{result.optimum[path]:.6f}", check("peak", result.peak.value, peak, 1e-7),
        str(result.evaluations), f"{1e3 * spent.cpu:.1f}", f"{1e3 * spent.least:.1f}",
        f"{wanted:g}" if method == "tracked" else "",
        f"{ratio:.1f}" + (f" (wanted {RESPONSES:g})" if method == "tracked" else ""),
    )  # fmt: skip


def _brute_force(
    name: str, scene: solver.Scene, path: str, bounds: tuple[float, float], peak: float, once: Timing
) -> tuple[str, ...]:
    """Return the row of a grid of responses with SciPy's bounded search around the best of them."""
    responses = 0

    def height(load: float) -> float:
        nonlocal responses
        responses += 1
        return solver.sweep(scene.with_values({path: float(load)})).peaks[0].value

    def search() -> tuple[float, float]:
        nonlocal responses
        responses = 0
        grid = np.geomspace(*bounds, GRID)
        best = int(np.argmin([height(load) for load in grid]))
        around = (grid[max(best - 1, 0)], grid[min(best + 1, GRID - 1)])
        found = minimize_scalar(height, bounds=around, method="bounded", options={"xatol": XATOL})
        return float(found.x), float(found.fun)

    (at, lowest), spent = timed(search, runs=1, warm_up=0)
    return (
        name, f"grid of {GRID} and SciPy", f"{at:.6f}", check("peak by brute force", lowest, peak, 1e-6),
        str(responses), f"{1e3 * spent.cpu:.0f}", f"{1e3 * spent.least:.0f}", "",
        f"{spent.cpu / once.cpu:.0f}",
    )  # fmt: skip


def _beside_pyharm() -> None:
    """Print the same optimum of case A by pyHarm's responses under SciPy's bounded search.

    The search is given a narrow bracket: from 20 to 3000 N it ends at 2999.5 N, where the contact sticks and
    the peak is flat.
    """
    scene, (_, path, low, high, _, peak, _) = case_a(), _ONE[2]
    other = pyharm_optimum(scene, *_BRACKET, step=0.3, accuracy=1.0)
    if other is None:
        print(f"\n{HOW}")
        return
    ours, spent = timed(lambda: optim.design(scene, variables={path: (low, high)}), runs=7)
    rows = [
        (f"stickslip, {low:g} to {high:g} N", f"{ours.optimum[path]:.4f}", f"{ours.peak.value:.6f}",
         str(ours.evaluations),
         f"{spent.cpu:.4f}", "1"),
        (f"pyHarm and SciPy, {_BRACKET[0]:g} to {_BRACKET[1]:g} N, to 1 N",
         f"{other.at:.4f}", f"{other.peak:.6f}", str(other.responses),
         f"{other.cpu_seconds:.2f}", f"{other.cpu_seconds / spent.cpu:.0f}"),
    ]  # fmt: skip
    expect("pyHarm finds the same optimum to 1e-3", abs(other.peak / peak - 1.0) < 1e-3)
    table("Case A beside pyHarm, one run", ("code", "N0 N", "peak", "responses", "s", "times"), rows)


def five_variables() -> None:
    """Five variables, three criteria: the peak is minimised, the band and the friction work are limited."""
    rows = []
    for name, (variables, limits) in FIVE.items():
        scene = solver.load_scene(name)
        result, spent = timed(
            lambda scene=scene, variables=variables, limits=limits: optim.design(
                scene, variables=variables, **limits
            ),
            runs=2,
        )
        expect(f"{name}: {result.status.value}", result.reached)
        rows.append(
            (name, f"{result.peak.value:.7g}", f"{result.band_hz:.4g}", str(result.evaluations),
             str(len(result.basins)), f"{result.optimality:.0e}", f"{spent.cpu:.2f}",
             f"{spent.least:.2f}", "2")
        )  # fmt: skip
    header = ("scene", "peak m", "band Hz", "responses", "basins", "KKT residual", "s (process)", "s (wall)",
              "wanted s")  # fmt: skip
    table("Five variables, three criteria", header, rows)


def robust() -> None:
    """The load of bladed-disk that is best for the worst kt and mu of two intervals."""
    scene = solver.load_scene("bladed-disk")
    result, spent = timed(
        lambda: optim.robust_design(scene, **UNCERTAIN),  # type: ignore[arg-type]
        runs=1,
    )
    expect(f"robust: {result.status.value}", result.reached)
    answer = result.to_json()
    rows = [
        (which, f"{answer[which]['values']['shroud.N0']:.3f}", f"{answer[which]['peak']['value']:.6g}",
         f"{answer[which]['worst']['peak']:.6g}")
        for which in ("nominal", "robust")
    ]  # fmt: skip
    table(
        "Robust design of bladed-disk, kt and mu in intervals", ("optimum", "N0 N", "peak m", "worst m"), rows
    )
    print(f"{spent.cpu:.2f} s of the process, {spent.least:.2f} s on the wall, wanted 5 s")
