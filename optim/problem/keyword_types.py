"""The keys of a design problem as keyword arguments, for type checkers: ``**problem: Unpack[…]``.

Written by ``python docs/docs_tables.py`` from `problem_keys`; not to be edited. A key of a
criterion from outside the package is none of these: pass it in a ``**dict[str, Any]``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from optim.problem.checks import Method, MethodWord, ScalingWord


class ProblemKeywords(TypedDict, total=False):
    """Those of a design and of a front."""

    harmonics: int | None
    """Highest harmonic of the balance."""
    variables: Mapping[str, Sequence[float]] | None
    """Variable to [low, high]: a parameter path, or several that share a value, separated by commas. The mass
    of the first damper, or the normal load of the contact whose load varies, if left out."""
    scaling: Mapping[str, ScalingWord] | None
    """Whether equal steps or equal ratios of a variable count equally; by its bounds."""
    cases: Sequence[Mapping[str, object]] | None
    """The responses that count; the scene as it is if left out."""
    limit: float | None
    """Amplitude [m] above which the resonance band is measured; half power of the peak."""
    start: Mapping[str, float] | None
    """A design to start from, variable to value."""
    method: MethodWord | Method | None
    """How the optimum is searched."""
    max_peak: float | None
    """Largest amplitude allowed [m]."""
    max_stress: float | Mapping[str, float] | None
    """Largest alternating stress [Pa], of every recovered stress or by row."""
    min_margin: float | Mapping[str, float] | None
    """Least margin, of every recovered stress with a material or by row: how many times the alternating
    stress may be as large."""
    forbidden_hz: Sequence[Sequence[float]] | None
    """Ranges [Hz] in which the amplitude stays below `limit`."""
    speeds_rpm: Sequence[Sequence[float]] | None
    """Ranges of running speed [1/min]; times the order of each case they are forbidden too."""
    running_rpm: Sequence[float | Sequence[float]] | None
    """Speeds and ranges of speed [1/min] at which the machine runs."""
    max_running_amplitude: float | None
    """Largest amplitude allowed at the running speeds [m]."""
    max_friction_work: float | Mapping[str, float] | None
    """Largest friction work in a cycle [J], of every friction contact or by contact (wear)."""
    max_wear_rate: float | Mapping[str, float] | None
    """Largest wear rate [m³/s], of every friction contact or by contact."""
    wear_coefficient: float | Mapping[str, float] | None
    """Volume worn off by a unit of friction work [m³/J], of every contact limited or by contact."""
    worn: Mapping[str, object] | None
    """The life: `hours`, wear `coefficient` [m³/J], `area` [m²], and perhaps `load_loss_per_depth` [N/m],
    `stiffness_loss_per_depth` [N/m²], `frequency_hz`, `from_hours`, `least_factor`, `largest_factor` of the
    coefficient, `most` [m]."""
    min_damping: float | Mapping[str, float] | None
    """Least damping `ratio` of a `mode` (the first) at a modal `amplitude` [√kg m]."""
    quality_factor: float | Mapping[str, float] | None
    """Of which `mode` (the first) at which modal `amplitude` [√kg m], and the `most` it may be."""
    max_mass: float | None
    """Largest mass of all bodies [kg]."""
    contact_states: Mapping[str, Literal["never-separates"]] | None
    """What a contact must never do: contact to `never-separates`."""


class DesignKeywords(ProblemKeywords, total=False):
    """Those of a design without uncertainty."""

    basins: int | None
    """How many local optima are looked for; 2."""
    tolerance: float | None
    """Relative error of the peak up to which a performance curve suffices; 0.05."""
    max_band_hz: float | None
    """Largest width of the resonance band allowed [Hz]."""
    weights: Mapping[str, float] | None
    """What is minimised: peak [1/m], band [1/Hz], stress [1/Pa], utilisation, running [1/m], wear [1/m³/s],
    worn [1/m], quality, mass [1/kg], each times its weight; the peak alone."""


class FrontKeywords(ProblemKeywords, total=False):
    """Those of a front but the number of its points."""
