"""The law `iwan`: Segalman's four-parameter Iwan element, springs with sliders side by side.

D. J. Segalman, J. Appl. Mech. 72 (2005) 752, doi:10.1115/1.1989354: the sliders have the strengths φ of the
density R φ^χ up to φ_max, and S of them all begin to slip at φ_max. In the numbers of a test, the force
`limit` of gross slip, the stiffness `k` at rest, χ and the ratio β,

    φ_max = limit (1 + β) / (k (β + (χ + 1)/(χ + 2))),    R = limit (χ + 1) / (φ_max^(χ+2) (β + (χ+1)/(χ+2))),
    S = (limit / φ_max) β / (β + (χ + 1)/(χ + 2)).

The density is carried by `SLIDERS` sliders at strengths that grow by a constant ratio over `DECADES` decades,
each with the stiffness and the strength its part of the density has, so that stiffness and limit are exact.
The state is where every slider stands.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from solver.contacts.fields import Real
from solver.contacts.laws.contact_parts import Row
from solver.contacts.laws.history.function_law import HistoryContact, HistoryLaw, LawParameter, law_class

LIMIT, K, CHI, BETA = range(4)
SLIDERS, DECADES = 40, 3.0  # of the density; one more is the S of them
RATIO = 10.0 ** (-DECADES / SLIDERS)
LOG = math.log(RATIO)
_FINER = 8  # times as many sliders tell what these leave out


def step(u: float, v: float, du: float, dt: float, last: Real, state: Real, p: Real) -> float:
    """Drag along the sliders whose springs are drawn beyond their strengths; return the force."""
    chi, beta = p[CHI], p[BETA]
    mean = (chi + 1.0) / (chi + 2.0)
    top = p[LIMIT] * (1.0 + beta) / (p[K] * (beta + mean))
    # In shares of φ_max the density up to x has the stiffness x^(χ+1) and the strength mean·x^(χ+2).
    x, stiff, less, total = 1.0, 1.0, RATIO ** (chi + 1.0), 0.0
    for i in range(SLIDERS + 1):
        weight, reach = beta, top
        if i < SLIDERS:
            below = stiff * less if i < SLIDERS - 1 else 0.0
            weight = stiff - below
            reach = top * mean * x * (stiff - RATIO * below) / weight
            stiff, x = below, x * RATIO
        drawn = min(max(u - last[i], -reach), reach)
        state[i] = u - drawn
        total += weight * drawn
    return p[K] / (1.0 + beta) * total  # type: ignore[no-any-return]


def slopes(u: float, v: float, du: float, dt: float, last: Real, state: Real, p: Real, out: Real) -> None:
    """Fill the derivatives of sliders and force by the motion, the sliders and the parameters."""
    chi, beta = p[CHI], p[BETA]
    mean, scale, first = (chi + 1.0) / (chi + 2.0), p[K] / (1.0 + beta), 4 + SLIDERS + 1
    share, dmean = beta + mean, 1.0 / (chi + 2.0) ** 2
    top = p[LIMIT] * (1.0 + beta) / (p[K] * share)
    x, stiff, less = 1.0, 1.0, RATIO ** (chi + 1.0)
    force, by_u, by_limit, by_k, by_chi, by_beta = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(SLIDERS + 1):
        weight, reach, dweight, dreach = beta, top, 0.0, -top * dmean / share
        if i < SLIDERS:
            # by χ: each power of x gains a factor log x.
            below, log_x = (stiff * less if i < SLIDERS - 1 else 0.0), i * LOG
            weight, dweight = stiff - below, stiff * log_x - below * (log_x + LOG)
            moment = x * (stiff - RATIO * below)
            dmoment = x * (stiff * log_x - RATIO * below * (log_x + LOG))
            reach = top * mean * moment / weight
            dreach = reach * (dmean / mean + dmoment / moment - dweight / weight - dmean / share)
            stiff, x = below, x * RATIO
        drawn = u - last[i]
        way = 1.0 if drawn > reach else -1.0 if drawn < -reach else 0.0
        stuck = 1.0 if way == 0.0 else 0.0
        drawn = drawn if way == 0.0 else way * reach
        pull, own = scale * weight, reach * (1.0 / (1.0 + beta) - 1.0 / share)
        out[i, 0], out[i, 4 + i] = 1.0 - stuck, stuck
        out[i, first + LIMIT], out[i, first + K] = -way * reach / p[LIMIT], way * reach / p[K]
        out[i, first + CHI], out[i, first + BETA] = -way * dreach, -way * own
        out[SLIDERS + 1, 4 + i] = -stuck * pull
        force += pull * drawn
        by_u += stuck * pull
        by_limit += pull * way * reach / p[LIMIT]
        by_k -= pull * way * reach / p[K]
        by_chi += scale * dweight * drawn + pull * way * dreach
        by_beta += pull * way * own + (scale * drawn if i == SLIDERS else 0.0)
    out[SLIDERS + 1, 0] = by_u
    out[SLIDERS + 1, first + LIMIT], out[SLIDERS + 1, first + K] = by_limit, by_k + force / p[K]
    out[SLIDERS + 1, first + CHI] = by_chi
    out[SLIDERS + 1, first + BETA] = by_beta - force / (1.0 + beta)


class Sliders(HistoryContact):
    """What springs with sliders side by side answer beyond their functions."""

    DISCRETISED: ClassVar[bool] = True

    @property
    def sliders(self) -> tuple[tuple[float, float], ...]:
        """Stiffness [N/m] and strength [N] of every slider."""
        return self._sliders(1)

    def _sliders(self, finer: int) -> tuple[tuple[float, float], ...]:
        """Return the same where so many times as many carry the density."""
        limit, k, chi, beta = self.numbers[:4].tolist()
        mean, count = (chi + 1.0) / (chi + 2.0), finer * SLIDERS
        top, scale = limit * (1.0 + beta) / (k * (beta + mean)), k / (1.0 + beta)
        edges = [*(RATIO ** (i / finer) for i in range(count)), 0.0]
        stiff = [edge ** (chi + 1.0) for edge in edges]
        strong = [mean * edge ** (chi + 2.0) for edge in edges]
        parts = [(stiff[i] - stiff[i + 1], strong[i] - strong[i + 1]) for i in range(count)]
        return tuple((scale * a, scale * top * b) for a, b in (*parts, (beta, beta)) if a > 0.0)

    def unresolved(self, motion: Real) -> Real:
        """Return the force of many more sliders less that of these: it falls with their number squared."""
        total = np.zeros(motion.size)
        for sliders, sign in ((self._sliders(1), -1.0), (self._sliders(_FINER), 1.0)):
            stiff, strong = np.array(sliders).T
            reach, stands = strong / stiff, np.zeros(stiff.size)
            for again in range(2):  # the first period begins with every slider at rest
                for i, u in enumerate(motion):
                    np.clip(stands, u - reach, u + reach, out=stands)
                    if again:
                        total[i] += sign * float(stiff @ (u - stands))
        return total

    def rows(self) -> tuple[Row, ...]:
        """Return the rows of the time march: every slider by itself, with its own events."""
        return tuple(
            Row.of_strength(f"{self.name} ({i + 1})", kt, limit) for i, (kt, limit) in enumerate(self.sliders)
        )


IWAN = HistoryLaw(
    name="iwan",
    parameters={
        "limit": LawParameter(unit="N", words="Force at which all of it slips", least=0.0, above=True),
        "k": LawParameter(unit="N/m", words="Stiffness while nothing slips", least=0.0, above=True),
        "chi": LawParameter(
            words="Exponent of the strengths: the loss of a cycle grows with the motion to the 3 + χ",
            least=-1.0, most=4.0, above=True, symbol="χ",
        ),
        "beta": LawParameter(
            words="Stiffness of what slips last over that of the rest", least=0.0, most=1e6, symbol="β"
        ),
    },
    step=step, slopes=slopes, states=SLIDERS + 1, independent=True, odd=True, monotone=True,
    formula="springs, `k` in all, with sliders whose strengths have the density `φ^chi`, `beta` of them last",
    words="A joint that slips little by little: Segalman's four-parameter Iwan element.",
)  # fmt: skip
LAW = law_class(IWAN, Sliders)
