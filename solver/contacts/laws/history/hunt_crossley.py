"""The law `hunt-crossley`: a stop with damping while it is closed, F = k δ (1 + χ δ'), δ = u − gap > 0.

K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440, doi:10.1115/1.3423596, with the exponent 1: the
damping grows with the approach, so that the force is continuous where contact begins and ends. A mass that
arrives with the velocity v leaves with w, ln((1 + χ v) / (1 − χ w)) = χ (v + w) (D. W. Marhefka, D. E. Orin,
IEEE Trans. Syst. Man Cybern. A 29 (1999) 566, doi:10.1109/3468.798060). Pulled away faster than 1/χ the force
is 0: the stop does not hold on.
"""

from __future__ import annotations

from typing import ClassVar

from solver.contacts.fields import Real
from solver.contacts.laws.history.function_law import HistoryContact, HistoryLaw, LawParameter, law_class

K, GAP, CHI = range(3)


class _DampedStop(HistoryContact):
    """It opens and closes."""

    OPENS: ClassVar[bool] = True


def force(u: float, v: float, state: Real, p: Real) -> float:
    """Return F."""
    return float(p[K] * max(u - p[GAP], 0.0) * max(1.0 + p[CHI] * v, 0.0))


def slopes(u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill the derivatives of F by u, v and the parameters."""
    depth, damped = max(u - p[GAP], 0.0), max(1.0 + p[CHI] * v, 0.0)
    closed = 1.0 if depth > 0.0 else 0.0
    moving = depth if damped > 0.0 else 0.0
    out[0, 0], out[0, 1] = closed * p[K] * damped, p[K] * p[CHI] * moving
    out[0, 2 + K], out[0, 2 + GAP] = depth * damped, -closed * p[K] * damped
    out[0, 2 + CHI] = p[K] * moving * v


HUNT_CROSSLEY = HistoryLaw(
    name="hunt-crossley",
    parameters={
        "k": LawParameter(unit="N/m", words="Stiffness", least=0.0),
        "gap": LawParameter(unit="m", words="Gap at rest; negative: pressed at rest"),
        "chi": LawParameter(
            unit="s/m", words="Damping over stiffness and approach", least=0.0, default=0.0, symbol="χ"
        ),
    },
    force=force, slopes=slopes, rubs=False,
    formula="`k δ (1 + χ δ̇)` where `δ = u - gap > 0`, never below 0",
    words="A stop with damping while it is closed, of Hunt and Crossley.",
)  # fmt: skip
LAW = law_class(HUNT_CROSSLEY, _DampedStop)
