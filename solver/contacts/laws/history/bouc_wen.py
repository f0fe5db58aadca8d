"""The law `bouc-wen`: smooth hysteresis of Bouc and Wen.

R. Bouc, Proc. 4th Conf. on Nonlinear Oscillations, Prague (1967) 315; Y. K. Wen, J. Eng. Mech. Div. 102
(1976) 249, doi:10.1061/JMCEA3.0002106. With z in metres,

    F = α k u + (1 − α) k z,    ż = A u̇ − β |u̇| |z|ⁿ⁻¹ z − γ u̇ |z|ⁿ.
"""

from __future__ import annotations

import math

from solver.contacts.fields import Real
from solver.contacts.laws.history.function_law import HistoryLaw, LawParameter, law_class

K, ALPHA, A, BETA, GAMMA, N = range(6)


def rate(u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill ż."""
    z = state[0]
    same = p[BETA] * math.copysign(1.0, z) * math.copysign(1.0, v) + p[GAMMA]
    out[0] = v * (p[A] - same * abs(z) ** p[N])


def force(u: float, v: float, state: Real, p: Real) -> float:
    """Return F."""
    return float(p[K] * (p[ALPHA] * u + (1.0 - p[ALPHA]) * state[0]))


def slopes(u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill the derivatives of ż and F by u, v, z and the parameters."""
    z, size = state[0], abs(state[0])
    turn = math.copysign(1.0, z) * math.copysign(1.0, v)
    same = p[BETA] * turn + p[GAMMA]
    power = size ** p[N]
    out[0, 0], out[0, 1] = 0.0, p[A] - same * power
    out[0, 2] = -v * same * p[N] * power / size * math.copysign(1.0, z) if size > 0.0 else 0.0
    out[0, 3 + A] = v
    out[0, 3 + BETA], out[0, 3 + GAMMA] = -v * turn * power, -v * power
    out[0, 3 + N] = -v * same * power * math.log(size) if size > 0.0 else 0.0
    out[1, 0], out[1, 2] = p[K] * p[ALPHA], p[K] * (1.0 - p[ALPHA])
    out[1, 3 + K] = p[ALPHA] * u + (1.0 - p[ALPHA]) * z
    out[1, 3 + ALPHA] = p[K] * (u - z)


BOUC_WEN = HistoryLaw(
    name="bouc-wen",
    parameters={
        "k": LawParameter(unit="N/m", words="Stiffness at rest, for A = 1", least=0.0, above=True),
        "alpha": LawParameter(
            words="Share of the stiffness that stays", least=0.0, most=1.0, default=0.0, symbol="α"
        ),
        "A": LawParameter(words="Slope of z at rest", least=0.0, above=True, default=1.0),
        "beta": LawParameter(
            unit="1/m^n", words="Loss of slope on a way that loads", least=0.0, above=True, symbol="β"
        ),
        "gamma": LawParameter(unit="1/m^n", words="The same on every way", default=0.0, symbol="γ"),
        "n": LawParameter(words="Sharpness of the transition", least=1.0, most=100.0, default=1.0),
    },
    force=force, rate=rate, slopes=slopes, states=1, reversals=True, odd=True,
    formula="`α k u + (1 - α) k z`, `ż = u̇ (A - (β sgn(u̇ z) + γ) abs(z)ⁿ)`",
    words="Smooth hysteresis of Bouc and Wen.",
)  # fmt: skip
LAW = law_class(BOUC_WEN)
