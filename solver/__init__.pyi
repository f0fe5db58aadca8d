from .balance.simplifications import Effects as Effects
from stickslip.lab.proofs.certificate import (
    Certificate as Certificate,
    CertificateStatus as CertificateStatus,
    certify as certify,
)
from .contacts.laws.history.function_law import LawParameter as LawParameter
from .contacts.laws.history.function_law import register_law as register_law
from .contacts.pieces.line import Shares as Shares
from .continuation.branch import AnyBranch as AnyBranch, Branch as Branch, BranchStatus as BranchStatus
from .continuation.extrema.error_estimate import (
    ErrorEstimate as ErrorEstimate,
    branch_errors as branch_errors,
)
from .continuation.branch import Bifurcations as Bifurcations, Mark as Mark, MarkKind as MarkKind
from .continuation.branch import Band as Band, Peak as Peak
from .continuation.stretches import Course as Course, Stretch as Stretch, joined as joined
from .continuation.walk import (
    ContinuationSettings as ContinuationSettings,
    Predictor as Predictor,
)
from .errors import (
    Issue as Issue,
    MissingExtraError as MissingExtraError,
    ResultFileError as ResultFileError,
    SceneError as SceneError,
    SettingError as SettingError,
    SolverError as SolverError,
    StoppedError as StoppedError,
)
from .marching.march import march as march
from .marching.march import MarchStart as MarchStart
from .marching.transient import transient as transient
from stickslip.lab.proofs.certified_cycles import certify_cycle as certify_cycle
from stickslip.lab.controlled.controlled import held_amplitude as held_amplitude
from stickslip.lab.controlled.phase_resonance import phase_resonance as phase_resonance
from .modes.mode_gradient import ModeGradient as ModeGradient, mode_gradient as mode_gradient
from stickslip.lab.limit_cycles.limit_cycles import (
    LimitCycle as LimitCycle,
    LimitCycles as LimitCycles,
    limit_cycles as limit_cycles,
)
from .modes.nonlinear_mode import nonlinear_mode as nonlinear_mode
from .modes.peaks.peak_correction import PeakCorrection as PeakCorrection, corrected_peak as corrected_peak
from .modes.peaks.performance import (
    PerformanceCurve as PerformanceCurve,
    performance_curve as performance_curve,
)
from stickslip.lab.controlled.held_result import HeldAmplitude as HeldAmplitude, HeldStatus as HeldStatus
from .modes.mode_results import (
    NonlinearMode as NonlinearMode,
    NonlinearModeStatus as NonlinearModeStatus,
    PhaseResonance as PhaseResonance,
)
from .response.time_history import PowerBalance as PowerBalance, power_balance as power_balance
from stickslip.lab.quasi_periodic.quasi_periodic import quasi_periodic as quasi_periodic
from stickslip.lab.quasi_periodic.quasi_periodic_curve import (
    QuasiPeriodicCurve as QuasiPeriodicCurve,
    TorusCurveStatus as TorusCurveStatus,
    quasi_periodic_curve as quasi_periodic_curve,
)
from .response.solution import Solution as Solution, SolutionStatus as SolutionStatus
from .response.solve import solve as solve
from stickslip.lab.all_solutions.all_solutions import (
    AllSolutions as AllSolutions,
    FoundSolution as FoundSolution,
    solve_all as solve_all,
)
from .response.stability.bifurcations import bifurcations as bifurcations
from .response.stability.floquet import branch_stability as branch_stability, stability as stability
from .response.stability.multipliers import Growth as Growth, Stability as Stability
from stickslip.lab.all_solutions.residual_forces import (
    AmplitudeRange as AmplitudeRange,
    amplitude_range as amplitude_range,
)
from .response.stability.bifurcations import Switched as Switched, switch_branches as switch_branches
from .response.stability.verdict import Uniqueness as Uniqueness, uniqueness as uniqueness
from .response.sweep import sweep as sweep
from .response.time_history import (
    hysteresis_loop as hysteresis_loop,
    motion as motion,
    time_history as time_history,
)
from .response.wear import (
    ContactWear as ContactWear,
    Measured as Measured,
    WearSensitivity as WearSensitivity,
    contact_wear as contact_wear,
)
from .response.worst_wear import worst_slopes as worst_slopes
from .response.worst_wear import (
    Measure as Measure,
    WorstWear as WorstWear,
    worst_friction_work as worst_friction_work,
    worst_wear as worst_wear,
)
from .results.base import Shown as Shown, progress_bar as progress_bar
from .results.files import Dataset as Dataset, Variable as Variable
from .results.told import Summary as Summary
from .scene.scene_builder import SceneBuilder as SceneBuilder
from .scene.cyclic.annulus import Extent as Extent, annulus as annulus, sectors_needed as sectors_needed
from .scene.scene import Scene as Scene, load_scene as load_scene, shipped_scenes as shipped_scenes
from stickslip.lab.templates.templates import new_scene as new_scene
from .scene.tensor_springs import tensor_springs as tensor_springs
from .sensitivity.gradient import Gradient as Gradient, Sensitivities as Sensitivities
from .sensitivity.gradient import (
    AmplitudeHessian as AmplitudeHessian,
    EdgeHessian as EdgeHessian,
    PeakHessian as PeakHessian,
)
from .sensitivity.nonsmooth import (
    PeakGradient as PeakGradient,
    PeakKind as PeakKind,
    peak_gradient as peak_gradient,
)
from stickslip.lab.accuracy.accuracy_result import AccuracyRow as AccuracyRow, AccuracyStudy as AccuracyStudy
from .studies.blades import (
    BladeAmplitudes as BladeAmplitudes,
    BladePeaks as BladePeaks,
    blade_amplitudes as blade_amplitudes,
    blade_peaks as blade_peaks,
    mistuned as mistuned,
)
from stickslip.lab.accuracy.accuracy_study import accuracy_study as accuracy_study
from .studies.instant import start_of as start_of
from .studies.interference import interference_diagram as interference_diagram
from .studies.margin_diagram import margin_diagram as margin_diagram
from .studies.study_results import (
    AllowedExcitation as AllowedExcitation,
    MarginDiagram as MarginDiagram,
    MarginStatus as MarginStatus,
)
from .studies.study_results import (
    DiameterFrequencies as DiameterFrequencies,
    FoldedOrder as FoldedOrder,
    Interference as Interference,
    InterferenceDiagram as InterferenceDiagram,
    InterferenceStatus as InterferenceStatus,
    Wave as Wave,
)
from .studies.mistuning import mistuning_study as mistuning_study
from .studies.study_results import (
    MistunedDisk as MistunedDisk,
    MistuningStatus as MistuningStatus,
    MistuningStudy as MistuningStudy,
)
from stickslip.lab.worst_mistuning.climbing import WorstSearch as WorstSearch
from stickslip.lab.worst_mistuning.intentional import IntentionalMistuning as IntentionalMistuning
from stickslip.lab.worst_mistuning.worst import worst_mistuning as worst_mistuning
from stickslip.lab.worst_mistuning.worst_result import (
    IntentionalPattern as IntentionalPattern,
    PatternPeak as PatternPeak,
    ResidualPeak as ResidualPeak,
    WorstMistuning as WorstMistuning,
    WorstMistuningStatus as WorstMistuningStatus,
)
from .studies.study_results import MapStatus as MapStatus, ResponseMap as ResponseMap
from .studies.peaks.minimise_peak import least_peak as least_peak
from .studies.peaks.track_results import (
    Basin as Basin,
    LeastPeak as LeastPeak,
    PeakTrack as PeakTrack,
    TrackStatus as TrackStatus,
)
from .studies.peaks.track_peak import track_peak as track_peak
from .studies.plan import plan as plan
from .studies.study_results import Plan as Plan
from .studies.response_map import response_map as response_map
from stickslip.lab.wear_life.least_worn_peak import (
    LeastWornPeak as LeastWornPeak,
    WornStatus as WornStatus,
    least_worn_peak as least_worn_peak,
)
from stickslip.lab.wear_life.life import wear_life as wear_life
from stickslip.lab.wear_life.mission import Mission as Mission
from stickslip.lab.wear_life.life_result import WearLife as WearLife, WearLifeStatus as WearLifeStatus
from stickslip.lab.wear_life.wearing import WearLaw as WearLaw
from .views.io import load as load, save as save
