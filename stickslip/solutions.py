"""One response: its motion in time, a run through many, power, stability, uniqueness, all that there are."""

from solver import (
    AllSolutions as AllSolutions,
    AmplitudeRange as AmplitudeRange,
    Certificate as Certificate,
    CertificateStatus as CertificateStatus,
    FoundSolution as FoundSolution,
    Growth as Growth,
    MarchStart as MarchStart,
    PowerBalance as PowerBalance,
    Shares as Shares,
    SolutionStatus as SolutionStatus,
    Stability as Stability,
    Uniqueness as Uniqueness,
    amplitude_range as amplitude_range,
    hysteresis_loop as hysteresis_loop,
    motion as motion,
    power_balance as power_balance,
    start_of as start_of,
    time_history as time_history,
    transient as transient,
    uniqueness as uniqueness,
)
