"""Contacts in every state, for tests of their force."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from contact_cases import Case, evaluate

REFERENCE = json.loads((Path(__file__).parent.parent / "data" / "contact_force.json").read_text())
NAMES = [name for name in REFERENCE if name != "about"]


def coefficients(table: dict[str, list[float]], n_harmonics: int) -> np.ndarray:
    """Coefficients from a table harmonic -> [cos, sin]."""
    q = np.zeros(2 * n_harmonics + 1)
    for harmonic, (cosine, sine) in table.items():
        k = int(harmonic)
        if k == 0:
            q[0] = cosine
        else:
            q[2 * k - 1 : 2 * k + 1] = cosine, sine
    return q


def reference_case(name: str) -> Case:
    row = REFERENCE[name]
    return Case(U=coefficients(row["u"], 11), N=coefficients(row["N"], 1), kt=row["kt"], mu=row["mu"])


@dataclass(frozen=True, kw_only=True)
class Transition:
    """A family of contacts over x that changes its smooth piece once between `low` and `high`."""

    family: Callable[[float], Case]
    low: float
    high: float
    before: str
    after: str


def _case(U: list[float], N: list[float], **values: float) -> Case:
    return Case(U=np.array(U), N=np.array(N), **{"kt": 30.0, "mu": 0.3, **values})


TRANSITIONS = {
    "one-sided slip of a stuck contact": Transition(
        family=lambda x: _case([0.1, x, 0.3], [100.0, 20.0, 30.0]), low=0.2, high=1.0,
        before="stuck", after="stuck",
    ),
    "first slip, one limit at a time": Transition(
        family=lambda x: _case([0.1, x, 0.3], [100.0, 20.0, 30.0]), low=0.85, high=1.2,
        before="stuck", after="slipping",
    ),
    "first slip, both limits at once": Transition(
        family=lambda x: _case([0.0, x, 0.0, 0.0, 0.0, 0.1, 0.05], [100.0]), low=0.5, high=1.5,
        before="stuck", after="slipping",
    ),
    "a second slip within the half period": Transition(
        family=lambda x: _case([0.0, 3.0, 1.0, 0.0, 0.0, x, 0.4 * x], [100.0, 10.0, 0.0]), low=0.1, high=1.6,
        before="slipping", after="slipping",
    ),
    "first separation while slipping": Transition(
        family=lambda x: _case([0.0, 3.0, 4.0, 0.0, 0.0, 1.0, 0.0], [100.0, x, 0.0]), low=95.0, high=110.0,
        before="slipping", after="lifting",
    ),
    "first slip as the load falls": Transition(
        family=lambda x: _case([0.02, -0.1, 0.2], [100.0, x, 0.0]), low=90.0, high=99.9,
        before="stuck", after="slipping",
    ),
    "after separation: stick becomes slip": Transition(
        family=lambda x: _case([0.0, 0.3, x], [100.0, 200.0, 0.0]), low=3.2, high=5.0,
        before="lifting", after="lifting",
    ),
    "after separation: stick becomes slip the other way": Transition(
        family=lambda x: _case([0.0, 0.3, -x], [100.0, 200.0, 0.0]), low=0.5, high=4.0,
        before="lifting", after="lifting",
    ),
    "first touch": Transition(
        family=lambda x: _case([0.0, 3.0, 4.0], [x, 100.0, 0.0]), low=-110.0, high=-90.0,
        before="separated", after="lifting",
    ),
    "second contact interval": Transition(
        family=lambda x: _case([0.0, 3.0, 4.0], [20.0, 100.0, 0.0, x, 0.0]), low=70.0, high=95.0,
        before="lifting", after="lifting",
    ),
}  # fmt: skip


def critical(transition: Transition) -> float:
    """Return where the family changes its smooth piece."""
    low, high = transition.low, transition.high
    pattern = evaluate(transition.family(low)).pattern
    assert evaluate(transition.family(high)).pattern != pattern
    while high - low > 1e-13 * abs(high):
        middle = 0.5 * (low + high)
        if evaluate(transition.family(middle)).pattern == pattern:
            low = middle
        else:
            high = middle
    return low
