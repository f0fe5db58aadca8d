"""The law `coulomb-tanh`: Coulomb's friction with the jump at rest drawn out over a small velocity.

F = μ N tanh(v / v0), the regularisation of D. D. Quinn, J. Vib. Acoust. 126 (2004) 581, and many before:
viscous while the velocity is small beside v0, so nothing ever sticks.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.laws.history.function_law import HistoryLaw, LawParameter, law_class

MU, LOAD, V0 = range(3)


def force(u: float, v: float, state: Real, p: Real) -> float:
    """Return F."""
    return float(p[MU] * p[LOAD] * np.tanh(v / p[V0]))


def slopes(u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill the derivatives of F by u, v and the parameters."""
    share = np.tanh(v / p[V0])
    steep = (1.0 - share * share) / p[V0]
    out[0, 1] = p[MU] * p[LOAD] * steep
    out[0, 2 + MU], out[0, 2 + LOAD] = p[LOAD] * share, p[MU] * share
    out[0, 2 + V0] = -p[MU] * p[LOAD] * steep * v / p[V0]


COULOMB_TANH = HistoryLaw(
    name="coulomb-tanh",
    parameters={
        "mu": LawParameter(words="Friction coefficient", least=0.0, most=100.0, symbol="μ"),
        "N0": LawParameter(unit="N", words="Normal load", least=0.0),
        "v0": LawParameter(
            unit="m/s", words="Velocity over which the jump is drawn out", least=0.0, above=True
        ),
    },
    force=force, slopes=slopes, odd=True, monotone=True,
    formula="`μ N0 tanh(u̇ / v0)`",
    words="Coulomb's friction with the jump at rest drawn out over a small velocity.",
)  # fmt: skip
LAW = law_class(COULOMB_TANH)
