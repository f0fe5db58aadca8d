"""Nonlinear modes: frequency and damping over the amplitude, peaks from them, flutter, held amplitudes."""

from solver import (
    HeldAmplitude as HeldAmplitude,
    HeldStatus as HeldStatus,
    LimitCycle as LimitCycle,
    LimitCycles as LimitCycles,
    ModeGradient as ModeGradient,
    NonlinearMode as NonlinearMode,
    NonlinearModeStatus as NonlinearModeStatus,
    PeakCorrection as PeakCorrection,
    PerformanceCurve as PerformanceCurve,
    PhaseResonance as PhaseResonance,
    certify_cycle as certify_cycle,
    corrected_peak as corrected_peak,
    held_amplitude as held_amplitude,
    limit_cycles as limit_cycles,
    mode_gradient as mode_gradient,
    nonlinear_mode as nonlinear_mode,
    performance_curve as performance_curve,
    phase_resonance as phase_resonance,
)
