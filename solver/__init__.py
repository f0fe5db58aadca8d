"""Periodic response of structures with friction contacts: scenes, balance, continuation, time marching.

The names below are the public interface, loaded on first use, so that importing the package is cheap.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solver.accuracy import ErrorEstimate, branch_errors
    from solver.accuracy_cost import AccuracyRow, AccuracyStudy, accuracy_study
    from solver.branch import Band, Branch, BranchStatus, Peak
    from solver.continuation import sweep
    from solver.continuation_settings import ContinuationSettings, Predictor
    from solver.corners import PeakGradient, PeakKind, peak_gradient
    from solver.curvature import AmplitudeHessian, EdgeHessian, PeakHessian
    from solver.dataset import Dataset, Variable
    from solver.effects import Plan, plan
    from solver.energy import PowerBalance, power_balance
    from solver.errors import Issue, MissingExtraError, ResultFileError, SceneError, SettingError, SolverError
    from solver.floquet import Growth, Stability, branch_stability, stability
    from solver.histories import hysteresis_loop, motion, time_history
    from solver.least import least_peak
    from solver.maps import MapStatus, ResponseMap, response_map
    from solver.marching import march
    from solver.mistuned_disks import MistunedDisk, MistuningStatus, MistuningStudy, mistuning_study
    from solver.mistuning import BladeAmplitudes, BladePeaks, blade_amplitudes, blade_peaks, mistuned
    from solver.peak_tracks import Basin, LeastPeak, PeakTrack, TrackStatus
    from solver.response import Solution, SolutionStatus, solve
    from solver.saving import load, save
    from solver.savings import Effects
    from solver.scene import Scene, load_scene, shipped_scenes
    from solver.sectors import Extent, annulus, sectors_needed
    from solver.segments_of import Shares
    from solver.sensitivity import Gradient, Sensitivities
    from solver.shown import Shown, Summary, progress_bar
    from solver.stretches import Stretch, joined
    from solver.tracking import track_peak
    from solver.wear import ContactWear, Measured, WearSensitivity, contact_wear
    from solver.wear_corners import worst_slopes
    from solver.wear_peaks import Measure, WorstWear, worst_friction_work, worst_wear

_HOME = {
    "AccuracyRow": "accuracy_cost", "AccuracyStudy": "accuracy_cost", "accuracy_study": "accuracy_cost",
    "ErrorEstimate": "accuracy", "branch_errors": "accuracy",
    "Band": "branch", "Branch": "branch", "BranchStatus": "branch", "Peak": "branch",
    "ContinuationSettings": "continuation_settings", "Predictor": "continuation_settings",
    "sweep": "continuation",
    "Dataset": "dataset", "Variable": "dataset", "Shown": "shown", "Summary": "shown",
    "progress_bar": "shown", "load": "saving", "save": "saving",
    "MissingExtraError": "errors", "ResultFileError": "errors",
    "Issue": "errors", "SceneError": "errors", "SettingError": "errors", "SolverError": "errors",
    "Effects": "savings", "Plan": "effects", "plan": "effects",
    "Scene": "scene", "load_scene": "scene", "shipped_scenes": "scene",
    "Solution": "response", "SolutionStatus": "response", "solve": "response",
    "Growth": "floquet", "Stability": "floquet", "branch_stability": "floquet", "stability": "floquet",
    "BladePeaks": "mistuning", "blade_peaks": "mistuning", "MistunedDisk": "mistuned_disks",
    "MistuningStatus": "mistuned_disks", "MistuningStudy": "mistuned_disks",
    "mistuning_study": "mistuned_disks",
    "BladeAmplitudes": "mistuning", "blade_amplitudes": "mistuning", "mistuned": "mistuning",
    "Extent": "sectors", "sectors_needed": "sectors", "annulus": "sectors",
    "Gradient": "sensitivity", "Sensitivities": "sensitivity", "AmplitudeHessian": "curvature",
    "EdgeHessian": "curvature", "PeakHessian": "curvature",
    "PeakGradient": "corners", "PeakKind": "corners", "peak_gradient": "corners",
    "march": "marching", "PowerBalance": "energy", "power_balance": "energy",
    "hysteresis_loop": "histories", "motion": "histories", "time_history": "histories",
    "MapStatus": "maps", "ResponseMap": "maps", "response_map": "maps", "LeastPeak": "peak_tracks",
    "Basin": "peak_tracks", "PeakTrack": "peak_tracks", "TrackStatus": "peak_tracks", "least_peak": "least",
    "track_peak": "tracking", "Shares": "segments_of",
    "ContactWear": "wear", "Measured": "wear", "WearSensitivity": "wear", "contact_wear": "wear",
    "Measure": "wear_peaks", "WorstWear": "wear_peaks", "worst_friction_work": "wear_peaks",
    "worst_wear": "wear_peaks", "worst_slopes": "wear_corners", "Stretch": "stretches", "joined": "stretches",
}  # fmt: skip

__all__ = [
    "AccuracyRow",
    "AccuracyStudy",
    "AmplitudeHessian",
    "Band",
    "Basin",
    "BladeAmplitudes",
    "BladePeaks",
    "Branch",
    "BranchStatus",
    "ContactWear",
    "ContinuationSettings",
    "Dataset",
    "EdgeHessian",
    "Effects",
    "ErrorEstimate",
    "Extent",
    "Gradient",
    "Growth",
    "Issue",
    "LeastPeak",
    "MapStatus",
    "Measure",
    "Measured",
    "MissingExtraError",
    "MistunedDisk",
    "MistuningStatus",
    "MistuningStudy",
    "Peak",
    "PeakGradient",
    "PeakHessian",
    "PeakKind",
    "PeakTrack",
    "Plan",
    "PowerBalance",
    "Predictor",
    "ResponseMap",
    "ResultFileError",
    "Scene",
    "SceneError",
    "Sensitivities",
    "SettingError",
    "Shares",
    "Shown",
    "Solution",
    "SolutionStatus",
    "SolverError",
    "Stability",
    "Stretch",
    "Summary",
    "TrackStatus",
    "Variable",
    "WearSensitivity",
    "WorstWear",
    "accuracy_study",
    "annulus",
    "blade_amplitudes",
    "blade_peaks",
    "branch_errors",
    "branch_stability",
    "contact_wear",
    "hysteresis_loop",
    "joined",
    "least_peak",
    "load",
    "load_scene",
    "march",
    "mistuned",
    "mistuning_study",
    "motion",
    "peak_gradient",
    "plan",
    "power_balance",
    "progress_bar",
    "response_map",
    "save",
    "sectors_needed",
    "shipped_scenes",
    "solve",
    "stability",
    "sweep",
    "time_history",
    "track_peak",
    "worst_friction_work",
    "worst_slopes",
    "worst_wear",
]


def __getattr__(name: str) -> object:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'solver' has no attribute {name!r}")
    value = getattr(import_module(f"solver.{_HOME[name]}"), name)
    globals()[name] = value
    return value
