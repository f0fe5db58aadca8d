"""What a job of a nonlinear mode gives besides its curve: loops, shapes, and exact peaks to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import solver
from service.jobs.outputs import OnProgress, ShouldStop
from solver.results.watch import part_of
from solver.scene.scene import Scene

MOST_POINTS = 40
"""Points of the curve with loops and shapes."""
MOST_CONTACTS = 40
MOST_DOFS = 400
SAMPLES = 97
"""Of a loop, its first again at the end."""
MOST_PEAKS = 40
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
    points = [int(i) for i in np.unique(np.linspace(0, max(count - 1, 0), min(count, MOST_POINTS)).round())]
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
    scene: Scene,
    factors: Sequence[float],
    harmonics: int,
    on_progress: OnProgress | None,
    should_stop: ShouldStop,
) -> list[dict[str, Any]]:
    """The highest peak of the whole response at each factor on the excitation; null where it has none.

    Parameters
    ----------
    scene : with the excitation that counts as 1.
    factors : on every force.
    harmonics : highest harmonic kept.
    on_progress : called with (share done, points so far).
    should_stop : asked within the sweeps; what was not computed then is left out.
    """
    found: list[dict[str, Any]] = []
    own = scene.value(_AMPLITUDE)
    for i, factor in enumerate(factors):
        if should_stop is not None and should_stop():
            break
        branch = solver.sweep(
            scene.with_values({_AMPLITUDE: factor * own}), harmonics=harmonics, should_stop=should_stop,
            on_progress=part_of(on_progress, i / len(factors), (i + 1) / len(factors)),
        )  # fmt: skip
        peak = branch.peak if branch.completed else None
        found.append({
            "excitation": factor,
            "peak": None if peak is None else peak.value,
            "frequency": None if peak is None else peak.at,
            "status": branch.status.value,
        })  # fmt: skip
    return found
