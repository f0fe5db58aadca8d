"""What a job of a nonlinear mode gives besides its curve: loops, shapes, and exact peaks to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import solver
from service.jobs.common.sizes import MOST_MOTIONS
from service.jobs.study import Watch

MOST_CONTACTS = 40
MOST_DOFS = 400
SAMPLES = 97
"""Of a loop, its first again at the end."""
FAR = 100.0
_AMPLITUDE = "excitation.amplitude"


def motions_of(found: solver.NonlinearMode) -> dict[str, Any]:
    """Hysteresis loops of the contacts and the shape of the mode at some points, evenly along the curve.

    Returns
    -------
    `points` are numbers of points of the curve. `loops` have for each of those motion [m] and force [N] of a
    contact over one period, its first sample again at the end. `shapes` have for each the real and the
    imaginary parts of harmonic 1 of the degrees of freedom `dofs` over the amplitude [1/√kg]. Of more
    contacts or degrees of freedom than fit, the first are given.
    """
    count = found.amplitude.size
    points = [int(i) for i in np.unique(np.linspace(0, max(count - 1, 0), min(count, MOST_MOTIONS)).round())]
    points = points if count else []
    loops = []
    for name in found.contact_names[:MOST_CONTACTS]:
        pairs = [found.loop(i, name, samples=SAMPLES - 1) for i in points]
        loops.append({
            "contact": name,
            "motion": [[*motion.tolist(), float(motion[0])] for motion, _ in pairs],
            "force": [[*force.tolist(), float(force[0])] for _, force in pairs],
        })  # fmt: skip
    shapes = [found.shape(i)[:MOST_DOFS] for i in points]
    return {
        "points": points,
        "loops": loops,
        "dofs": list(found.scene.dofs[:MOST_DOFS]),
        "shapes": {"real": [s.real.tolist() for s in shapes], "imag": [s.imag.tolist() for s in shapes]},
    }


def excitations(curve: solver.PerformanceCurve, band: Sequence[float], count: int) -> list[float]:
    """Factors on the excitation, evenly in their logarithms, whose peaks the curve has within a band [Hz].

    At most a hundred times more or less than the scene's own, as far as the curve has that.
    """
    inside = (curve.excitation > 0.0) & (curve.frequency_hz > band[0]) & (curve.frequency_hz < band[1])
    near = inside & (curve.excitation >= 1.0 / FAR) & (curve.excitation <= FAR)
    inside = near if near.any() else inside
    factors = curve.excitation[inside]
    if not factors.size:
        return []
    return [float(f) for f in np.geomspace(factors.min(), factors.max(), count)]


def exact_peaks(
    found: solver.NonlinearMode, curve: solver.PerformanceCurve, count: int, watch: Watch
) -> list[dict[str, Any]]:
    """The highest peak of the whole response at so many factors on the excitation; null where it has none.

    What was not computed when it was to end is left out.
    """
    told: list[dict[str, Any]] = []
    own = found.scene.value(_AMPLITUDE)
    factors = excitations(curve, found.scene.observe.band, count)
    for i, factor in enumerate(factors):
        if watch.should_stop is not None and watch.should_stop():
            break
        branch = solver.sweep(
            found.scene.with_values({_AMPLITUDE: factor * own}), harmonics=found.n_harmonics,
            **watch.part(i / len(factors), (i + 1) / len(factors))._asdict(),
        )  # fmt: skip
        peak = branch.peak if branch.reached else None
        told.append({
            "excitation": factor,
            "peak": None if peak is None else peak.value,
            "frequency": None if peak is None else peak.at,
            "status": branch.status.value,
        })  # fmt: skip
    return told
