"""Periodic response of structures with friction contacts: scenes, balance, continuation, time marching.

The names below are the public interface, loaded on first use, so that importing the package is cheap.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solver.balance.simplifications import Effects
    from solver.contacts.laws.history.definition import LawParameter
    from solver.contacts.laws.history.register import register_law
    from solver.contacts.segments import Shares
    from solver.continuation.branch import AnyBranch, Branch, BranchStatus
    from solver.continuation.extrema.error_estimate import ErrorEstimate, branch_errors
    from solver.continuation.marks import Bifurcations, Mark, MarkKind
    from solver.continuation.peaks import Band, Peak
    from solver.continuation.segment import Stretch, joined
    from solver.continuation.settings import ContinuationSettings, Predictor
    from solver.errors import (
        Issue,
        MissingExtraError,
        ResultFileError,
        SceneError,
        SettingError,
        SolverError,
        StoppedError,
    )
    from solver.marching.march import march
    from solver.marching.start import MarchStart
    from solver.modes.driven.controlled import HeldAmplitude, HeldStatus, held_amplitude
    from solver.modes.driven.phase_resonance import PhaseResonance, phase_resonance
    from solver.modes.gradient import ModeGradient, mode_gradient
    from solver.modes.limit_cycles import LimitCycle, LimitCycles, limit_cycles
    from solver.modes.nonlinear_mode import nonlinear_mode
    from solver.modes.peaks.peak_correction import PeakCorrection, corrected_peak
    from solver.modes.peaks.performance import PerformanceCurve, performance_curve
    from solver.modes.results import NonlinearMode, NonlinearModeStatus
    from solver.response.power_balance import PowerBalance, power_balance
    from solver.response.solution import Solution, SolutionStatus
    from solver.response.solve import solve
    from solver.response.stability.all_solutions import AllSolutions, FoundSolution, solve_all
    from solver.response.stability.bifurcations import bifurcations
    from solver.response.stability.floquet import Growth, Stability, branch_stability, stability
    from solver.response.stability.residual_forces import AmplitudeRange, amplitude_range
    from solver.response.stability.switching import Switched, switch_branches
    from solver.response.stability.uniqueness import Uniqueness, uniqueness
    from solver.response.sweep import sweep
    from solver.response.time_history import hysteresis_loop, motion, time_history
    from solver.response.wear import ContactWear, Measured, WearSensitivity, contact_wear
    from solver.response.wear_nonsmooth import worst_slopes
    from solver.response.worst_wear import Measure, WorstWear, worst_friction_work, worst_wear
    from solver.results.base import Shown, progress_bar
    from solver.results.dataset import Dataset, Variable
    from solver.results.told import Summary
    from solver.scene.builder import SceneBuilder
    from solver.scene.cyclic.annulus import Extent, annulus, sectors_needed
    from solver.scene.scene import Scene, load_scene, shipped_scenes
    from solver.scene.templates.registry import new_scene
    from solver.sensitivity.gradient import Gradient, Sensitivities
    from solver.sensitivity.hessian import AmplitudeHessian, EdgeHessian, PeakHessian
    from solver.sensitivity.nonsmooth import PeakGradient, PeakKind, peak_gradient
    from solver.studies.blades import BladeAmplitudes, BladePeaks, blade_amplitudes, blade_peaks, mistuned
    from solver.studies.convergence import AccuracyRow, AccuracyStudy, accuracy_study
    from solver.studies.instant import start_of
    from solver.studies.interference import interference_diagram
    from solver.studies.interference_result import (
        DiameterFrequencies,
        FoldedOrder,
        Interference,
        InterferenceDiagram,
        InterferenceStatus,
        Wave,
    )
    from solver.studies.mistuning import MistunedDisk, MistuningStatus, MistuningStudy, mistuning_study
    from solver.studies.peaks.minimise_peak import least_peak
    from solver.studies.peaks.results import Basin, LeastPeak, PeakTrack, TrackStatus
    from solver.studies.peaks.track_peak import track_peak
    from solver.studies.plan import Plan, plan
    from solver.studies.response_map import MapStatus, ResponseMap, response_map
    from solver.views.io import load, save

_HOME = {
    "AccuracyRow": "studies.convergence", "AccuracyStudy": "studies.convergence",
    "accuracy_study": "studies.convergence", "ErrorEstimate": "continuation.extrema.error_estimate",
    "branch_errors": "continuation.extrema.error_estimate", "Band": "continuation.peaks",
    "AnyBranch": "continuation.branch",
    "Branch": "continuation.branch", "BranchStatus": "continuation.branch", "Peak": "continuation.peaks",
    "ContinuationSettings": "continuation.settings", "Predictor": "continuation.settings",
    "sweep": "response.sweep", "Dataset": "results.dataset", "Variable": "results.dataset",
    "Shown": "results.base", "Summary": "results.base", "progress_bar": "results.base", "load": "views.io",
    "save": "views.io", "MissingExtraError": "errors", "ResultFileError": "errors", "Issue": "errors",
    "SceneError": "errors", "SettingError": "errors", "SolverError": "errors",
    "StoppedError": "errors",
    "Effects": "balance.simplifications", "Plan": "studies.plan", "plan": "studies.plan",
    "SceneBuilder": "scene.builder",
    "Scene": "scene.scene", "load_scene": "scene.scene", "shipped_scenes": "scene.scene",
    "new_scene": "scene.templates.registry",
    "Solution": "response.solution", "SolutionStatus": "response.solution", "solve": "response.solve",
    "Growth": "response.stability.floquet", "Stability": "response.stability.floquet",
    "branch_stability": "response.stability.floquet", "stability": "response.stability.floquet",
    "Bifurcations": "continuation.marks", "Mark": "continuation.marks",
    "MarkKind": "continuation.marks", "bifurcations": "response.stability.bifurcations",
    "AllSolutions": "response.stability.all_solutions", "FoundSolution": "response.stability.all_solutions",
    "solve_all": "response.stability.all_solutions", "AmplitudeRange": "response.stability.residual_forces",
    "amplitude_range": "response.stability.residual_forces", "Uniqueness": "response.stability.uniqueness",
    "uniqueness": "response.stability.uniqueness", "Switched": "response.stability.switching",
    "switch_branches": "response.stability.switching",
    "BladePeaks": "studies.blades", "blade_peaks": "studies.blades",
    "interference_diagram": "studies.interference", "DiameterFrequencies": "studies.interference_result",
    "FoldedOrder": "studies.interference_result", "Interference": "studies.interference_result",
    "InterferenceDiagram": "studies.interference_result",
    "InterferenceStatus": "studies.interference_result", "Wave": "studies.interference_result",
    "MistunedDisk": "studies.mistuning", "MistuningStatus": "studies.mistuning",
    "MistuningStudy": "studies.mistuning", "mistuning_study": "studies.mistuning",
    "BladeAmplitudes": "studies.blades", "blade_amplitudes": "studies.blades", "mistuned": "studies.blades",
    "Extent": "scene.cyclic.annulus", "sectors_needed": "scene.cyclic.annulus",
    "annulus": "scene.cyclic.annulus",
    "Gradient": "sensitivity.gradient", "Sensitivities": "sensitivity.gradient",
    "AmplitudeHessian": "sensitivity.hessian", "EdgeHessian": "sensitivity.hessian",
    "PeakHessian": "sensitivity.hessian", "PeakGradient": "sensitivity.nonsmooth",
    "PeakKind": "sensitivity.nonsmooth", "peak_gradient": "sensitivity.nonsmooth",
    "MarchStart": "marching.start", "start_of": "studies.instant", "march": "marching.march",
    "PowerBalance": "response.power_balance",
    "power_balance": "response.power_balance", "hysteresis_loop": "response.time_history",
    "motion": "response.time_history", "time_history": "response.time_history",
    "MapStatus": "studies.response_map", "ResponseMap": "studies.response_map",
    "response_map": "studies.response_map", "LeastPeak": "studies.peaks.results",
    "Basin": "studies.peaks.results", "PeakTrack": "studies.peaks.results",
    "TrackStatus": "studies.peaks.results", "least_peak": "studies.peaks.minimise_peak",
    "track_peak": "studies.peaks.track_peak", "Shares": "contacts.segments", "ContactWear": "response.wear",
    "Measured": "response.wear", "WearSensitivity": "response.wear", "contact_wear": "response.wear",
    "Measure": "response.worst_wear", "WorstWear": "response.worst_wear",
    "worst_friction_work": "response.worst_wear", "worst_wear": "response.worst_wear",
    "worst_slopes": "response.wear_nonsmooth", "Stretch": "continuation.segment",
    "joined": "continuation.segment", "LawParameter": "contacts.laws.history.definition",
    "register_law": "contacts.laws.history.register", "NonlinearMode": "modes.results",
    "PerformanceCurve": "modes.peaks.performance", "performance_curve": "modes.peaks.performance",
    "LimitCycle": "modes.limit_cycles", "LimitCycles": "modes.limit_cycles",
    "limit_cycles": "modes.limit_cycles",
    "HeldAmplitude": "modes.driven.controlled", "HeldStatus": "modes.driven.controlled",
    "held_amplitude": "modes.driven.controlled",
    "ModeGradient": "modes.gradient", "mode_gradient": "modes.gradient",
    "PeakCorrection": "modes.peaks.peak_correction", "corrected_peak": "modes.peaks.peak_correction",
    "PhaseResonance": "modes.driven.phase_resonance", "phase_resonance": "modes.driven.phase_resonance",
    "NonlinearModeStatus": "modes.results", "nonlinear_mode": "modes.nonlinear_mode",
}  # fmt: skip

__all__ = [
    "AccuracyRow",
    "AccuracyStudy",
    "AllSolutions",
    "AmplitudeHessian",
    "AmplitudeRange",
    "AnyBranch",
    "Band",
    "Basin",
    "Bifurcations",
    "BladeAmplitudes",
    "BladePeaks",
    "Branch",
    "BranchStatus",
    "ContactWear",
    "ContinuationSettings",
    "Dataset",
    "DiameterFrequencies",
    "EdgeHessian",
    "Effects",
    "ErrorEstimate",
    "Extent",
    "FoldedOrder",
    "FoundSolution",
    "Gradient",
    "Growth",
    "HeldAmplitude",
    "HeldStatus",
    "Interference",
    "InterferenceDiagram",
    "InterferenceStatus",
    "Issue",
    "LawParameter",
    "LeastPeak",
    "LimitCycle",
    "LimitCycles",
    "MapStatus",
    "MarchStart",
    "Mark",
    "MarkKind",
    "Measure",
    "Measured",
    "MissingExtraError",
    "MistunedDisk",
    "MistuningStatus",
    "MistuningStudy",
    "ModeGradient",
    "NonlinearMode",
    "NonlinearModeStatus",
    "Peak",
    "PeakCorrection",
    "PeakGradient",
    "PeakHessian",
    "PeakKind",
    "PeakTrack",
    "PerformanceCurve",
    "PhaseResonance",
    "Plan",
    "PowerBalance",
    "Predictor",
    "ResponseMap",
    "ResultFileError",
    "Scene",
    "SceneBuilder",
    "SceneError",
    "Sensitivities",
    "SettingError",
    "Shares",
    "Shown",
    "Solution",
    "SolutionStatus",
    "SolverError",
    "Stability",
    "StoppedError",
    "Stretch",
    "Summary",
    "Switched",
    "TrackStatus",
    "Uniqueness",
    "Variable",
    "Wave",
    "WearSensitivity",
    "WorstWear",
    "accuracy_study",
    "amplitude_range",
    "annulus",
    "bifurcations",
    "blade_amplitudes",
    "blade_peaks",
    "branch_errors",
    "branch_stability",
    "contact_wear",
    "corrected_peak",
    "held_amplitude",
    "hysteresis_loop",
    "interference_diagram",
    "joined",
    "least_peak",
    "limit_cycles",
    "load",
    "load_scene",
    "march",
    "mistuned",
    "mistuning_study",
    "mode_gradient",
    "motion",
    "new_scene",
    "nonlinear_mode",
    "peak_gradient",
    "performance_curve",
    "phase_resonance",
    "plan",
    "power_balance",
    "progress_bar",
    "register_law",
    "response_map",
    "save",
    "sectors_needed",
    "shipped_scenes",
    "solve",
    "solve_all",
    "stability",
    "start_of",
    "sweep",
    "switch_branches",
    "time_history",
    "track_peak",
    "uniqueness",
    "worst_friction_work",
    "worst_slopes",
    "worst_wear",
]


if not TYPE_CHECKING:  # a checker shall notice a name that is none

    def __getattr__(name: str) -> object:
        """Load a public name on first use."""
        if name not in _HOME:
            raise AttributeError(f"module 'solver' has no attribute {name!r}")
        value = getattr(import_module(f"solver.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names too that are not loaded yet, for completion."""
    return sorted({*globals(), *__all__})
