"""Answers in closed form, in balls of python-flint, by the name of the case."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import arb

from benchmarks.frictionbench.model import Case


def den_hartog(case: Case) -> dict[str, Any]:
    """x0² = (P / (k (1 − β²)))² − (F U / k)², U = sin(π/β) / (β (1 + cos(π/β))), while nothing stops."""
    contact = case["contacts"][0]
    limit, beta = arb(contact["mu"]) * arb(contact["N0"]), 2 * arb.pi() * arb(case["asked"]["frequency_hz"])
    angle = arb.pi() / beta
    U = angle.sin() / (beta * (1 + angle.cos()))
    return {"value": ((1 / (1 - beta**2)) ** 2 - (limit * U) ** 2).sqrt()}


def griffin_peak(case: Case) -> dict[str, Any]:
    """πPA = 4F (A − F/kd): A = 4F² / (kd (4F − πP))."""
    contact = case["contacts"][0]
    limit, kd, P = (
        arb(contact["mu"]) * arb(contact["N0"]),
        arb(contact["kt"]),
        arb(case["loads"][0]["amplitude"]),
    )
    return {"value": 4 * limit**2 / (kd * (4 * limit - arb.pi() * P))}


def griffin_optimum(case: Case) -> dict[str, Any]:
    """The above is least, πP/kd, at F = πP/2."""
    contact, P = case["contacts"][0], arb(case["loads"][0]["amplitude"])
    return {"value": arb.pi() * P / arb(contact["kt"]), "at": arb.pi() * P / 2 / arb(contact["mu"])}


def sinha_griffin(case: Case) -> dict[str, Any]:
    """π c ω A² = 4F (A − F/kd), ω² = k + kd (θ − sin 2θ / 2) / π, θ = acos(1 − 2F/(kd A)), k = m = 1."""
    contact, c = case["contacts"][0], -arb(case["structure"]["C"][0][0])
    limit, kd = arb(contact["mu"]) * arb(contact["N0"]), arb(contact["kt"])
    slips = limit / kd

    def omega(A: Any) -> Any:
        theta = (1 - 2 * slips / A).acos()
        return (1 + kd * (theta - (2 * theta).sin() / 2) / arb.pi()).sqrt()

    def lost(A: Any) -> Any:
        return 4 * limit * (A - slips) - arb.pi() * c * omega(A) * A**2

    small, best, large = slips * arb("1.0000001"), 2 * slips, 100 * slips
    low, high = (small, best) if case["asked"]["which"] == "attracting" else (large, best)
    for _ in range(200):
        middle = ((low + high) / 2).mid()
        low, high = (low, middle) if lost(middle) > 0 else (middle, high)
    A, wider = low.union(high), 1 + arb("1e-9")
    # More is lost than fed by a motion that is a little larger, and less by a smaller one: it goes back.
    returns = {bool(lost(A * wider) > 0 > lost(A / wider)), not lost(A * wider) < 0 < lost(A / wider)}
    return {
        "value": A,
        "at": omega(A) / (2 * arb.pi()),
        "attracts": returns.pop() if len(returns) == 1 else None,
    }


def whitehead(case: Case) -> dict[str, Any]:
    """(1 + √N) / 2."""
    return {"value": (1 + arb(case["structure"]["sectors"]).sqrt()) / 2}


FORMS: dict[str, Callable[[Case], dict[str, Any]]] = {
    "den-hartog-0.8": den_hartog, "den-hartog-1.5": den_hartog, "griffin-peak": griffin_peak,
    "griffin-optimum": griffin_optimum, "sinha-griffin-attracting": sinha_griffin,
    "sinha-griffin-repelling": sinha_griffin, "whitehead-6": whitehead,
}  # fmt: skip
