"""A case as a scene of stickslip, and what stickslip says of what is asked."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

import stickslip
from benchmarks.frictionbench.model import Case, NotOfferedError, piecewise_linear
from stickslip.lab.proofs.exact.answer import solve_exactly
from stickslip.lab.worst_mistuning.bounds import whitehead

OF_WORK = 400  # harmonics in which the friction work of an exact motion is summed


def scene(case: Case) -> stickslip.Scene:
    """Return the scene of a case; a sector of masses and springs is told by its springs."""
    structure, asked = case["structure"], case["asked"]
    dofs, sectors = structure["dofs"], structure.get("sectors", 1)
    band = asked.get("band_hz") or [asked.get(key, 1.0) for key in ("frequency_hz", "frequency_hz")]
    if "guess_hz" in asked:
        band = [asked["guess_hz"]] * 2
    low, high = (band[0], band[1]) if band[1] > band[0] else (0.5 * band[0], 2.0 * band[1])
    order = {"engine_order": case["engine_order"]} if "engine_order" in case else {}
    loads = case["loads"] or [{"dof": dofs[0], "amplitude": 1.0}]
    raw: dict[str, Any] = {
        "name": case["name"].replace(".", "_"), "contacts": case["contacts"],
        "excitation": [{**one, **order} for one in loads],
        "observe": {"dof": asked["dof"], "band": [low, high]},
    }  # fmt: skip
    if sectors == 1:
        raw["structure"] = {"kind": "matrices", "dofs": dofs, **{key: structure[key] for key in "MCK"}}
    else:
        raw["structure"] = {
            "kind": "cyclic", "sectors": sectors, "springs": _springs(structure),
            "masses": {name: structure["M"][i][i] for i, name in enumerate(dofs)},
        }  # fmt: skip
    return stickslip.Scene.from_dict(raw)


def _springs(structure: dict[str, Any]) -> list[dict[str, Any]]:
    dofs = structure["dofs"]
    K, C, K_next, C_next = (np.array(structure[key]) for key in ("K", "C", "K_next", "C_next"))
    found = []

    def add(a: str, b: str, k: float, c: float) -> None:
        if k or c:
            found.append({"between": [a, b], "k": float(k), "c": float(c)})

    for i, a in enumerate(dofs):
        for j, b in enumerate(dofs):
            if j > i:
                add(a, b, -K[i, j], -C[i, j])
            add(a, f"{b}@next", -K_next[i, j], -C_next[i, j])
        rest = [X[i].sum() + X_next[i].sum() + X_next[:, i].sum() for X, X_next in ((K, K_next), (C, C_next))]
        # What rounding leaves of the sum of a row without a spring to the ground is none.
        rest = [r if abs(r) > 1e-12 * abs(X[i, i]) else 0.0 for r, X in zip(rest, (K, C), strict=True)]
        add(a, "ground", *rest)
    return found


def answer(case: Case, harmonics: int, exact: bool = False) -> dict[str, float]:
    """Return stickslip's value, where it is and its own estimate of the error.

    Raises
    ------
    NotOfferedError
        Nothing answers what is asked.
    """
    asked = case["asked"]
    what = asked["what"]
    if what == "amplification":
        return {"value": whitehead(case["structure"]["sectors"]), "estimate": 0.0}
    made = scene(piecewise_linear(case) if exact else case)
    H = asked.get("harmonics", harmonics)
    if what in ("amplitude", "half-peak-to-peak", "loss"):
        return _response(made, asked, H, exact)
    if exact:
        raise NotOfferedError(f"exact orbits do not answer {what}")
    if what == "peak":
        return _peak(made, H, "harmonics" in asked)
    if what == "least-peak":
        best = stickslip.peaks.least_peak(made, asked["variable"], *asked["range"], harmonics=H)
        if not best.reached:
            raise ArithmeticError(best.status.value)
        at = made.with_values({asked["variable"]: best.at})
        return {**_peak(at, H, "harmonics" in asked), "value": best.peak, "at": best.at}
    if what == "limit-cycle":
        one = limit_cycle(made, asked, H)
        estimate = 1e-12 * one.max_abs if "harmonics" in asked else one.max_abs_error
        return {"value": one.max_abs, "at": one.frequency_hz, "estimate": estimate}
    raise NotOfferedError(f"nothing answers {what}")


def solved(made: stickslip.Scene, asked: dict[str, Any], H: int, exact: bool = False) -> stickslip.Solution:
    """Return the response that is asked for.

    Raises
    ------
    ArithmeticError
        It did not converge.
    """
    hz = asked["frequency_hz"]
    if asked.get("which") == "attracting":  # what a march from rest ends in, which the balance need not find
        found = solve_exactly(made, hz, H)
    elif "which" in asked:
        every = stickslip.solve_all(made, frequency_hz=hz, harmonics=H).solutions
        pick = max if asked["which"] == "largest" else min
        attract = (one.solution for one in every if one.stability is None or one.stability.stable)
        found = pick(attract, key=lambda one: one.max_abs)
        found = solve_exactly(made, hz, H, near=found) if exact else found
    else:
        found = stickslip.solve(made, frequency_hz=hz, harmonics=H, exact=exact)
    if not found.converged:
        raise ArithmeticError(found.status.value)
    return found


def _response(made: stickslip.Scene, asked: dict[str, Any], H: int, exact: bool) -> dict[str, float]:
    loss = asked["what"] == "loss"
    found = solved(made, asked, max(H, OF_WORK) if exact and loss else H, exact)
    if loss:
        # It has no estimate of its own. What twice the harmonics leave out may be half of it; of an exact
        # motion only terms of the sum are left out.
        value = sum(one.work for one in found.contacts)
        if exact:
            return {"value": value, "estimate": abs(value - sum(_half(one).work for one in found.contacts))}
        finer = sum(one.work for one in solved(made, asked, min(2 * H, 1000)).contacts)
        return {"value": value, "estimate": 2.0 * abs(finer - value)}
    half = asked["what"] == "half-peak-to-peak"
    return {"value": found.half_peak_to_peak if half else found.max_abs, "estimate": found.error_estimate}


def _half(contact: Any) -> Any:
    keep = contact.slip.size // 4 * 2 + 1
    return replace(contact, slip=contact.slip[:keep], force=contact.force[:keep])


def _peak(made: stickslip.Scene, H: int, defined: bool) -> dict[str, float]:
    branch = stickslip.sweep(made, harmonics=H)
    if branch.peak is None:
        raise ArithmeticError(f"no peak: {branch.status.value}")
    estimate = 1e-12 * branch.peak.value if defined else branch.error_estimate
    return {
        "value": branch.peak.value,
        "at": branch.peak.at,
        "estimate": math.nan if estimate is None else estimate,
    }


def limit_cycle(made: stickslip.Scene, asked: dict[str, Any], H: int) -> stickslip.modes.LimitCycle:
    """Return the limit cycle that is asked for.

    Raises
    ------
    ArithmeticError
        There is none such.
    """
    rows = [row for contact in made.contacts for row in contact.rows() if row.mu]
    least = min(row.mu * row.N0 / row.kt for row in rows)
    mode = stickslip.modes.nonlinear_mode(made, 1, amplitudes=(0.5 * least, 60.0 * least), harmonics=H)
    cycles = stickslip.modes.limit_cycles(mode).cycles
    wanted = [one for one in cycles if one.attracts == (asked["which"] == "attracting")]
    if not wanted:
        raise ArithmeticError(f"no such limit cycle among {len(cycles)}")
    return wanted[0]
