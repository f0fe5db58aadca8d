"""The figure of each class of result, for its ``plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from solver.continuation.branch import AnyBranch
from solver.marching.march_result import MarchResult
from solver.modes.peaks.performance import PerformanceCurve
from solver.response.solution import Solution
from solver.response.stability.multipliers import Stability
from solver.results.known import Measured
from solver.scene.scene import Scene
from solver.studies.blades import BladeAmplitudes, BladePeaks
from solver.views.plots.curves import Response
from solver.views.plots.disks import blades_figure, performance_figure
from solver.views.plots.motion import Motion, motion_figure, multipliers_figure
from solver.views.plots.responses import Demands, response_figure
from solver.views.plots.style import Into

if TYPE_CHECKING:
    pass


def of_branch(branch: AnyBranch, ax: Into = None, *, limit: float | None = None) -> Figure:
    """Draw the response, its peak and its band; `limit` is an amplitude [m] drawn as a line."""
    return response_figure(Response.of_branch(branch), asked=Demands(limit=limit), ax=ax)


def of_solution(solution: Solution, ax: Into = None) -> Figure:
    """Draw a period, its hysteresis loops and harmonics."""
    return motion_figure(Motion.of_solution(solution), ax=ax)


def of_march(march: MarchResult, ax: Into = None, *, scene: Scene | None = None) -> Figure:
    """Draw the last period and its hysteresis loops; `scene`, what was marched, gives the title."""
    if scene is None:
        return motion_figure(Motion.of_march(march), ax=ax)
    return motion_figure(Motion.of_march(march, scene.name, scene.observe.dof), ax=ax)


def of_stability(found: Stability, ax: Into = None) -> Figure:
    """Draw the multipliers and the unit circle."""
    return multipliers_figure(found, ax=ax)


def of_performance(curve: PerformanceCurve, ax: Into = None) -> Figure:
    """Draw the peak over the load, or over the excitation."""
    return performance_figure(curve.to_json(), dof=curve.mode.scene.observe.dof, ax=ax)


def of_amplitudes(blades: BladeAmplitudes, ax: Into = None) -> Figure:
    """Draw the amplitude of every blade."""
    return blades_figure(blades.max_abs, Measured(dof=blades.dof).name, ax=ax)


def of_blade_peaks(peaks: BladePeaks, ax: Into = None) -> Figure:
    """Draw the highest peak of every blade."""
    return blades_figure(peaks.value, f"highest peak, {peaks.measured.name}", ax=ax)
