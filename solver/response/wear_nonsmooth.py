"""The derivative of the worst wear over a response by parameters, also where its place is a corner.

At a smooth maximum and at an end of the range it is the one at that fixed frequency (envelope theorem). Where
the response has a corner, two smooth pieces m⁻ and m⁺ meet at ω_k(p); as for peaks of the amplitude
(`solver.sensitivity.nonsmooth`) the derivative is m⁻_p + m⁻_ω dω_k/dp with dω_k/dp = −(m⁺_p − m⁻_p)/(m⁺_ω −
m⁻_ω), from solutions beside the corner at two distances, extrapolated to it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.workspace import Workspace
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.response.wear import Measured, WearPoint, WearSensitivity
from solver.response.worst_wear import Measure, WorstWear
from solver.sensitivity.nonsmooth import BESIDE, FAR, SMOOTH


def worst_slopes(
    sensitivity: WearSensitivity, worst: WorstWear, contact: str, measure: Measure = Measure.FRICTION_WORK
) -> Measured:
    """Return a local worst value of a frequency response with its derivatives by parameters.

    Parameters
    ----------
    sensitivity : of the balance of the response, `Branch.balance`, and the paths.
    worst : one of `solver.worst_wear` for the same contact and measure.

    Raises
    ------
    SettingError
        An unknown contact, or a law the measure has no meaning for.
    """
    here = _measured(sensitivity.at(worst.at, worst.solution), contact, measure)
    if not worst.interior or not abs(here.by_frequency) * worst.at > SMOOTH * abs(here.value):
        return here
    near, far = (_across(sensitivity, worst, contact, measure, share * BESIDE) for share in (1.0, 2.0))
    # Where nothing is found beside it, the derivative at the fixed frequency stands in.
    return here if near is None or far is None else replace(here, gradient=2.0 * near - far)


def _measured(point: WearPoint, contact: str, measure: Measure) -> Measured:
    found = {
        Measure.FRICTION_WORK: point.work,
        Measure.LEAST_LOAD: point.least_load,
        Measure.SLIP_TRAVEL: point.travel,
    }[measure](contact)
    if found is None:
        raise SettingError("contact", contact, f"must be one whose law has a {measure.value}")
    return found


def _across(
    sensitivity: WearSensitivity, worst: WorstWear, contact: str, measure: Measure, distance: float
) -> Real | None:
    """Return the derivatives of a corner from solutions at a relative distance on both sides."""
    sides = []
    for way in (-1.0, 1.0):
        at_hz = worst.at * (1.0 + way * distance)
        found = Workspace.of(sensitivity.balance).solve(2.0 * math.pi * at_hz, worst.solution)
        change = np.abs(found.u - worst.solution).max(initial=0.0)
        if not found.converged or change > FAR * np.abs(worst.solution).max(initial=0.0):
            return None
        sides.append(_measured(sensitivity.at(at_hz, found.u), contact, measure))
    left, right = sides
    rises = left.by_frequency, right.by_frequency
    if not rises[0] * rises[1] < 0.0:
        return None
    drift = -(right.gradient - left.gradient) / (rises[1] - rises[0])
    return np.asarray(left.gradient + rises[0] * drift)
