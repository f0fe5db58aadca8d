"""A law from outside that is registered where its module is imported."""

from own_laws import PARAMETERS, analytic

import solver

SmoothFriction = solver.register_law(
    "smooth-friction", parameters=PARAMETERS, force=analytic, odd=True, monotone=True,
    formula="`k u + limit v / √(v² + v0²)`", words="A spring and a friction that is smooth at rest.",
)  # fmt: skip
