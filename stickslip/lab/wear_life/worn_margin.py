"""The margin of worn contacts: what of the allowed stresses is used over the life, and when all of it is.

Of a scene with strengths the utilisation of a Haigh diagram (`solver.scene.materials`) is looked for over the
band of the worn scene, or at the frequencies that it runs at; it may have its peak elsewhere than the
amplitude. Where it reaches 1, at t* with U(w(t*), θ) = 1, the instant has the derivatives

    ∂t*/∂θ = −(U_w S + U_θ)/(U_w · r),

those of the utilisation being exact at its peak (envelope theorem), S and r as in
`stickslip.lab.wear_life.course`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import brentq

from solver.arrays import Real
from solver.continuation.branches.observation import observed_balance
from solver.response.worst_mean import WorstMeanSlopes
from solver.scene.materials import haigh_of, utilisation_of
from solver.sensitivity.nonsmooth import peak_gradient
from solver.studies.margin_diagram import judged_rows, most_used
from stickslip.lab.wear_life.course import Here, WearCourse


@dataclass(frozen=True, slots=True, kw_only=True)
class WornMargin:
    """Utilisation at T instants, and when it first is 1."""

    used: Annotated[Real, "Greatest share of the stresses allowed at each instant, (T,)."]
    hours: Annotated[float, "When it first is 1 [h]; NaN if it is not."]
    slopes: Annotated[Real, "Derivatives of that by θ [h per unit], (m,)."]


def worn_margin(course: WearCourse, rows: Sequence[Here]) -> WornMargin:
    """Return what of the stresses allowed is used at instants of a life; errors as `swept`."""
    used = np.array([utilisation_of(_used(course, row.depths)[0]) for row in rows])
    nothing = np.full(len(course.paths), math.nan)
    over = next((i for i, one in enumerate(used) if one >= 1.0), None)
    if over is None:
        return WornMargin(used=used, hours=math.nan, slopes=nothing)
    if over == 0:
        return WornMargin(used=used, hours=rows[0].hours, slopes=nothing)

    def above(hours: float) -> float:
        return _used(course, course.at(hours).depths)[0] - 1.0

    ends = rows[over - 1].hours, rows[over].hours
    at = float(brentq(above, *ends, xtol=1e-12 * course.hours, rtol=1e-13))
    here = course.at(at)
    paths = (*course.conditions.paths, *(loss.path for loss in course.wearing.losses))
    by_depths, by_own = course.by_state(_used(course, here.depths, paths)[1], here.depths)
    rise = float(by_depths @ here.rates)
    slopes = -(by_depths @ here.slopes + by_own) / rise if rise > 0.0 and course.smooth else nothing
    return WornMargin(used=used, hours=at, slopes=slopes)


def _used(course: WearCourse, depths: Real, paths: Sequence[str] = ()) -> tuple[float, Real]:
    """Return what is used most at depths, counted on, over the band or where it runs, with derivatives."""
    scene, conditions = course.wearing.at(depths), course.conditions
    if conditions.blocks is None:
        most = most_used(conditions.swept(scene))
        return most.peak.value, peak_gradient(most.slopes(*paths), most.peak).gradient
    found = []
    for hertz, _ in conditions.blocks:
        balance, motion = conditions.at_frequency(scene, hertz)
        for row in judged_rows(scene):
            seen = WorstMeanSlopes(observed_balance(balance, row, haigh_of(scene, row)), paths)
            gradient = seen.gradient(motion.u, hertz)
            found.append((gradient.value, gradient.by_parameters))
    return max(found, key=lambda one: one[0])
