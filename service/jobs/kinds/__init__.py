"""The kinds of job that come with the service, in the order of `service.jobs.names`."""

from __future__ import annotations

from collections.abc import Mapping

import optim
import solver
from service.jobs.kind_registry import Registry
from service.jobs.names import there
from service.jobs.study import Study, study_named
from solver.jit.compiler_process import ready


def warm_up() -> None:
    """Load the numerical packages and the compiled loops, so that the first job does not wait for them."""
    ready()  # who computes for others computes compiled
    scene = solver.load_scene("two-dof")
    solver.solve(scene, frequency_hz=scene.observe.band[0], harmonics=3)
    solver.sweep(scene, harmonics=3)
    optim.design(scene, harmonics=3)


SHIPPED = Registry([study_named(name).as_kind() for name in there()], warm_up)


def studies(registry: Registry = SHIPPED) -> Mapping[str, type[Study]]:
    """Return the studies among some kinds by their names."""
    return {kind.name: kind.request for kind in registry if issubclass(kind.request, Study)}
