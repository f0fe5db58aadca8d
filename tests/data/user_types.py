"""What a user writes, for a type checker: every line must be clean under its strictest rules."""

from typing import Any, assert_type

from matplotlib.figure import Figure

import optim
import solver
from service.client import Client


class Bar:
    """A progress bar like tqdm's."""

    def __init__(self, total: float) -> None:
        self.total = total

    def update(self, by: float) -> None:
        """Go on."""
        self.total -= by

    def close(self) -> None:
        """End."""


def report(share: float, count: int) -> None:
    """Progress as a function."""
    assert_type(share * count, float)


scene = solver.load_scene("bladed-disk").with_values({"shroud.N0": 150.0})
assert_type(scene, solver.Scene)
branch = solver.sweep(scene, "frequency", 500, 900, limit=1e-4, on_progress=solver.progress_bar(Bar))
assert_type(branch.plot(limit=1e-4), Figure)
branch.to_pandas().to_csv("branch.csv")
assert_type(branch.to_xarray()["amplitude"].attrs, dict[Any, Any])
if branch.peak is not None and branch.band is not None:
    assert_type(branch.peak.value + branch.band.width, float)

solution = solver.solve(scene, frequency_hz=755, accuracy=1e-3)
assert_type(solution.max_abs, float)
time, motion = solver.time_history(solution, "tip")
assert_type(float((time * motion).sum()), float)
assert_type(solver.stability(solution).stable, bool)
assert_type(solver.contact_wear(solution)["shroud"].work.value, float)
assert_type(solver.power_balance(solution).friction_w, float)
assert_type(solver.march(scene, frequency_hz=755.0).max_abs, float)

best = optim.design(scene, variables={"shroud.N0": (20, 3000)}, on_progress=report)
assert_type(best.optimum["shroud.N0"], float)
robust = optim.robust_design(scene, variables={"shroud.N0": (20.0, 3e3)}, uncertain={"shroud.mu": [0.2, 0.4]})
assert_type(robust.gain, float)
front = optim.pareto_front(scene, variables={"shroud.N0": (20.0, 3000.0)}, limit=1e-4)
assert_type([point.peak for point in front.points], list[float])
assert_type(optim.sensitivities(scene).plot(), Figure)
typed = optim.design(scene, cases=[optim.Case(name="a", engine_order=2)], limits=[optim.Limit("peak", 1e-4)])
assert_type(typed, optim.DesignResult)
assert_type(optim.campbell_diagram(scene, speeds_rpm=(1e3, 2e3)).status, optim.CampbellStatus)

assert_type(solver.response_map(scene, "shroud.N0", 20, 300, on_progress=report).status, solver.MapStatus)
assert_type(solver.track_peak(scene, "shroud.N0", 20, 300).optimum, solver.LeastPeak)
assert_type(solver.least_peak(scene, "shroud.N0", 20, 300).at, float)
assert_type(solver.mistuning_study(scene, of="tip").plot(), Figure)
assert_type(solver.plan(scene).unknowns, int)
solver.save(branch, "branch.nc")
assert_type(solver.load("branch.nc").variables["amplitude"].unit, str)
assert_type(solver.Scene.from_dict({**scene.to_dict(), "name": "mine"}).name, str)

with Client("http://127.0.0.1:8000") as client:
    job = client.submit({"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 1000]}})
    assert_type(client.wait(job.id, on_progress=report).progress, float)
    assert_type(client.results(job.id).result, dict[str, Any])
