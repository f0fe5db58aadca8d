"""The tables of terms in a scene: what each is called, and its keys."""

from __future__ import annotations

from solver.scene.terms.linear_terms import Aerodynamics, Coupling, DiameterCoefficient, Influence
from solver.scene.terms.recovery import Recovered
from solver.scene.terms.speed import SpeedDependence

TERM_KEYS: dict[tuple[str, ...], tuple[str, tuple[str, ...]]] = {
    ("with_speed",): ("a dependence on the speed", tuple(SpeedDependence.model_fields)),
    ("recovery",): ("a recovered quantity", tuple(Recovered.model_fields)),
    ("couplings",): ("a coupling", tuple(Coupling.model_fields)),
    ("aerodynamics",): ("aerodynamics", tuple(Aerodynamics.model_fields)),
    ("aerodynamics", "influence"): ("an influence", tuple(Influence.model_fields)),
    ("aerodynamics", "nodal_diameters"): ("a nodal diameter", tuple(DiameterCoefficient.model_fields)),
}
