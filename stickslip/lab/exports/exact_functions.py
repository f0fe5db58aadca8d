"""Answers as functions of parameters, each with its exact derivatives: what other programs differentiate.

A function takes the values of its `paths` and returns value and gradient. Where there is no answer, because
an iteration did not converge or a search proved nothing, both are NaN: what is not known is not a number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.continuation.branches.sweep import sweep
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.modes.at_amplitudes import mode_at_amplitudes
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient
from solver.studies.peaks.minimise_peak import least_peak as minimise_peak
from solver.studies.peaks.track_results import ActivePeak

FREQUENCY = "frequency"
AMPLITUDE = "amplitude"


@dataclass(frozen=True, slots=True)
class ExactFunction:
    """A number that depends on parameters."""

    name: Annotated[str, "What it is, for programs that name their quantities."]
    unit: Annotated[str, "Of its value."]
    paths: Annotated[tuple[str, ...], "What it depends on, in the order of its argument."]
    evaluate: Annotated[
        Callable[[dict[str, float]], tuple[float, Real] | None],
        "Value and gradient, (n_paths,), at values by path; None where there is no answer.",
    ]

    def __call__(self, x: Real) -> tuple[float, Real]:
        """Return value and gradient.

        Raises
        ------
        SettingError
            Not as many numbers as paths.
        """
        values = np.asarray(x, dtype=np.float64)
        if values.shape != (len(self.paths),):
            raise SettingError("x", values.shape, f"must have the shape ({len(self.paths)},), a value a path")
        found = self.evaluate(dict(zip(self.paths, values.tolist(), strict=True)))
        return found or (math.nan, np.full(len(self.paths), math.nan))


def solve(
    scene: Scene, paths: Sequence[str], *, frequency_hz: float | None = None, harmonics: int = 11
) -> ExactFunction:
    """The amplitude max|x| [m] at one frequency.

    Parameters
    ----------
    scene : of all values that are not in `paths`.
    paths : parameter paths; "frequency" [Hz] among them, or `frequency_hz` given.
    harmonics : highest harmonic kept.
    """
    if (FREQUENCY in paths) == (frequency_hz is not None):
        wanted = f"must be given, or {FREQUENCY!r} be one of the paths, not both"
        raise SettingError("frequency_hz", frequency_hz, wanted)

    def evaluate(values: dict[str, float]) -> tuple[float, Real] | None:
        hertz = values.pop(FREQUENCY) if frequency_hz is None else frequency_hz
        balance = build(scene.with_values(values), harmonics=harmonics)
        found = Workspace.of(balance).solve(2.0 * math.pi * hertz)
        if not found.converged:
            return None
        slopes = Sensitivities(balance, tuple(values)).gradient(found.u, hertz)
        by = dict(zip(values, slopes.by_parameters.tolist(), strict=True)) | {FREQUENCY: slopes.by_frequency}
        return slopes.value, np.array([by[path] for path in paths])

    return ExactFunction("amplitude", "m", tuple(paths), evaluate)


def peak(scene: Scene, paths: Sequence[str], *, harmonics: int = 11) -> ExactFunction:
    """The highest peak of the frequency response [m]; parameters as of `solve`."""

    def evaluate(values: dict[str, float]) -> tuple[float, Real] | None:
        branch = sweep(scene.with_values(values), harmonics=harmonics)
        if not branch.reached or branch.peak is None:
            return None
        found = peak_gradient(Sensitivities(branch.balance, paths), branch.peak)
        return found.value, found.gradient

    return ExactFunction("peak", "m", tuple(paths), evaluate)


def least_peak(
    scene: Scene, parameter: str, start: float, stop: float, paths: Sequence[str], *, harmonics: int = 11
) -> ExactFunction:
    """The least that the highest peak [m] can be made by one parameter within its bounds.

    Its derivative is that of the envelope: of the peaks that are equally high at the optimum, mixed so that
    what they change by the parameter cancels (Danskin's theorem).

    Parameters
    ----------
    scene, paths, harmonics : as of `peak`; `parameter` is none of the paths.
    parameter, start, stop : what is chosen, and its bounds.
    """
    if parameter in paths:
        raise SettingError("paths", parameter, "must not hold the parameter that is chosen")

    def evaluate(values: dict[str, float]) -> tuple[float, Real] | None:
        found = minimise_peak(scene.with_values(values), parameter, start, stop, harmonics=harmonics)
        if not found.reached or found.branch is None:
            return None
        sensitivities = Sensitivities(found.branch.balance, paths)
        slopes = np.zeros(len(paths))
        for active, share in zip(found.active, _shares(found.active), strict=True):
            nearest = np.argmin([abs(one.at - active.frequency) for one in found.branch.peaks])
            of = found.branch.peaks[int(nearest)]
            slopes += share * peak_gradient(sensitivities, of).gradient
        return found.peak, slopes

    return ExactFunction("least_peak", "m", tuple(paths), evaluate)


def damping_ratio(
    scene: Scene,
    paths: Sequence[str],
    *,
    mode: int = 1,
    nodal_diameter: int | None = None,
    harmonics: int = 11,
) -> ExactFunction:
    """The damping ratio ζ of a mode at a modal amplitude.

    Parameters
    ----------
    scene, harmonics : as of `solve`.
    paths : parameter paths; "amplitude" [√kg m] is one of them.
    mode, nodal_diameter : as of `solver.nonlinear_mode`.
    """
    if AMPLITUDE not in paths:
        raise SettingError("paths", list(paths), f"must hold {AMPLITUDE!r}, at which the mode is looked at")

    def evaluate(values: dict[str, float]) -> tuple[float, Real] | None:
        at = np.array([values.pop(AMPLITUDE)])
        found = mode_at_amplitudes(
            scene.with_values(values), at, tuple(values), mode=mode, nodal_diameter=nodal_diameter,
            harmonics=harmonics,
        )  # fmt: skip
        by = dict(zip(values, found.by_damping[0].tolist(), strict=True))
        by[AMPLITUDE] = float(found.by_amplitude[0, 1])
        if math.isnan(found.damping_ratio[0]):
            return None
        return float(found.damping_ratio[0]), np.array([by[path] for path in paths])

    return ExactFunction("damping_ratio", "", tuple(paths), evaluate)


def _shares(active: Sequence[ActivePeak]) -> list[float]:
    """How much each of the highest peaks counts at an optimum: their slopes, so mixed, sum to 0."""
    if len(active) == 1:
        return [1.0]
    slopes = [one.slope for one in active]
    low, high = slopes.index(min(slopes)), slopes.index(max(slopes))
    if not slopes[low] < 0.0 < slopes[high]:
        return [math.nan] * len(active)  # at an end of the range: whichever stays highest
    share = slopes[high] / (slopes[high] - slopes[low])
    return [share if i == low else 1.0 - share if i == high else 0.0 for i in range(len(active))]
