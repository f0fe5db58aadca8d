"""The kinds of job that come with the service; a further one is one module and one entry here."""

from __future__ import annotations

from collections.abc import Mapping

import optim
import solver
from service.jobs.registry import Registry
from service.jobs.studies.accuracy import Accuracy
from service.jobs.studies.campbell import Campbell
from service.jobs.studies.controlled import Controlled
from service.jobs.studies.design import Design
from service.jobs.studies.identify import Identify
from service.jobs.studies.interference import Interference
from service.jobs.studies.map import Map
from service.jobs.studies.march import March
from service.jobs.studies.margin import Margin
from service.jobs.studies.mistuning import Mistuning
from service.jobs.studies.modes import Modes
from service.jobs.studies.pareto import Pareto
from service.jobs.studies.peaks import Peaks
from service.jobs.studies.plan import Plan
from service.jobs.studies.posterior import PosteriorStudy
from service.jobs.studies.quasi_periodic import QuasiPeriodicStudy
from service.jobs.studies.sensitivities import Sensitivities
from service.jobs.studies.solve import Solve
from service.jobs.studies.sweep import Sweep
from service.jobs.studies.transient import Transient
from service.jobs.studies.wear import Wear
from service.jobs.studies.worst_mistuning import WorstMistuningStudy
from service.jobs.study import Study


def warm_up() -> None:
    """Load the numerical packages and the compiled loops, so that the first job does not wait for them."""
    scene = solver.load_scene("two-dof")
    solver.solve(scene, frequency_hz=scene.observe.band[0], harmonics=3)
    solver.sweep(scene, harmonics=3)
    optim.design(scene, harmonics=3)


SHIPPED = Registry(
    [
        Sweep.as_kind(),
        Map.as_kind(),
        Peaks.as_kind(),
        Design.as_kind(),
        Pareto.as_kind(),
        Margin.as_kind(),
        Solve.as_kind(),
        March.as_kind(),
        Transient.as_kind(),
        QuasiPeriodicStudy.as_kind(),
        Wear.as_kind(),
        Accuracy.as_kind(),
        Campbell.as_kind(),
        Interference.as_kind(),
        Mistuning.as_kind(),
        WorstMistuningStudy.as_kind(),
        Identify.as_kind(),
        PosteriorStudy.as_kind(),
        Modes.as_kind(),
        Controlled.as_kind(),
        Sensitivities.as_kind(),
        Plan.as_kind(),
    ],
    warm_up,
)


def studies(registry: Registry = SHIPPED) -> Mapping[str, type[Study]]:
    """Return the studies among some kinds by their names."""
    return {kind.name: kind.request for kind in registry if issubclass(kind.request, Study)}
