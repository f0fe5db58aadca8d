"""The law `dahl`: friction of Dahl, Valanis' endochronic law where a spring stands beside it.

P. R. Dahl, A solid friction model, Aerospace Corporation TOR-158(3107-18)-1 (1968); K. C. Valanis, Arch.
Mech. 23 (1971) 517, whose simplest law without a yield surface is Dahl's with exponent 1 and a spring,

    F = k u + f,    ḟ = σ u̇ |1 − (f/Fc) sgn u̇|^i sgn(1 − (f/Fc) sgn u̇).
"""

from __future__ import annotations

from solver.contacts.fields import Real
from solver.contacts.laws.history.function_law import Derivatives, HistoryLaw, LawParameter, law_class

SIGMA, LIMIT, EXPONENT, K = range(4)


def rate(u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill ḟ, of real or complex numbers."""
    turn = 1.0 if v.real >= 0.0 else -1.0
    left = 1.0 - turn * state[0] / p[LIMIT]
    way = 1.0 if left.real >= 0.0 else -1.0
    # A power of 0 has no complex step.
    share = way * (way * left) ** p[EXPONENT] if left.real != 0.0 else 0.0 * left
    out[0] = p[SIGMA] * v * share


def force(u: float, v: float, state: Real, p: Real) -> float:
    """Return F."""
    return p[K] * u + state[0]  # type: ignore[no-any-return]


DAHL = HistoryLaw(
    name="dahl",
    parameters={
        "sigma": LawParameter(
            unit="N/m", words="Stiffness of the friction at rest", least=0.0, above=True, symbol="σ"
        ),
        "limit": LawParameter(unit="N", words="Limit of the friction force", least=0.0, above=True),
        "exponent": LawParameter(
            words="Exponent of what is left to the limit", least=1.0, most=20.0, default=1.0
        ),
        "k": LawParameter(unit="N/m", words="Stiffness of a spring beside it", least=0.0, default=0.0),
    },
    force=force, rate=rate, states=1, derivatives=Derivatives.COMPLEX_STEP, reversals=True, odd=True,
    formula="`k u + f`, `ḟ = σ u̇ (1 - (f / limit) sgn u̇)^exponent`",
    words="Friction of Dahl; with a spring beside it Valanis' law.",
)  # fmt: skip
LAW = law_class(DAHL)
