"""The registry of contact laws.

To add a law, write a module with `LAW` and name it in `SHIPPED`; one from outside the package is named by
`solver.extensions`, or registered for one process.
"""

from __future__ import annotations

from solver.contacts.laws.contact_law import AnyContact
from solver.extensions import Kinds

SHIPPED = (
    "solver.contacts.laws.coulomb",
    "solver.contacts.laws.history.coulomb_viscous",
    "solver.contacts.laws.elastic_normal",
    "solver.contacts.laws.coulomb_2d",
    "solver.contacts.laws.coulomb_3d",
    "solver.contacts.laws.gap",
    "solver.contacts.laws.polynomial",
    "solver.contacts.laws.history.iwan",
    "solver.contacts.laws.history.bouc_wen",
    "solver.contacts.laws.history.dahl",
    "solver.contacts.laws.history.coulomb_tanh",
    "solver.contacts.laws.history.hunt_crossley",
)


LAWS: Kinds[type[AnyContact]] = Kinds(AnyContact, "law", lambda law: (law.LAW,), SHIPPED, "LAW")
laws, register, unregister = LAWS.known, LAWS.register, LAWS.unregister

DEFAULT = "coulomb"
"""The law of a contact that names none."""
