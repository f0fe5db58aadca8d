"""The kinds of job that come with the service; a further one is one module and one entry here."""

from __future__ import annotations

import solver
from service.jobs import Registry
from service.kinds.march import MARCH
from service.kinds.solve import SOLVE
from service.kinds.sweep import SWEEP


def warm_up() -> None:
    """Load the numerical packages and the compiled loops, so that the first job does not wait for them."""
    scene = solver.load_scene("two-dof")
    low, high = scene.observe.band
    solver.solve(scene, frequency_hz=low, harmonics=3)
    solver.sweep(scene, start=low, stop=low + 0.02 * (high - low), harmonics=3)


SHIPPED = Registry([SWEEP, SOLVE, MARCH], warm_up)
