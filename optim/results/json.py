"""Parts of a design's result as objects of JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from solver.results.told import json_number

if TYPE_CHECKING:
    from optim.criteria.constraint_rows import DesignEvaluation
    from optim.criteria.linearised import Conditions
    from solver.continuation.branch import Branch
    from solver.results.known import Known


def over_bands(evaluation: DesignEvaluation) -> dict[str, Branch]:
    """Return of each case the response over its band, which is its first."""
    first: dict[str, Branch] = {}
    for response in evaluation.responses:
        first.setdefault(response.case, response.branch)
    return first


def bands_json(evaluation: DesignEvaluation) -> list[dict[str, object]]:
    """Return where the resonance band of each case lies."""
    return [
        {
            "case": case, "limit": branch.band.limit, "width_hz": branch.band.width,
            "intervals_hz": [list(interval) for interval in branch.band.intervals],
        }
        for case, branch in over_bands(evaluation).items()
        if branch.band is not None
    ]  # fmt: skip


def evaluation_json(evaluation: DesignEvaluation | None) -> dict[str, object]:
    """Return the rows of a design, its peaks, its bands, and how well each is known."""
    if evaluation is None:
        return {"peaks": [], "bands": [], "objective": None, "rows": [], "errors": []}
    rows = evaluation.rows
    return {
        "peaks": [{"value": peak.value, "at": peak.at_hz, "case": peak.case} for peak in evaluation.peaks],
        "bands": bands_json(evaluation),
        "objective": json_number(evaluation.objective_told) if rows else None,
        "rows": [row.to_json() for row in rows],
        "errors": [
            {"case": case, "peak": known.value, **known.to_json()} for case, known in known_parts(evaluation)
        ],
    }


def known_parts(evaluation: DesignEvaluation) -> list[tuple[str, Known]]:
    """Return for the response of each case over its band its name and how well its peak is known."""
    return [(case, b.known) for case, b in over_bands(evaluation).items() if b.peak is not None]


def looked_json(one: DesignEvaluation) -> dict[str, object]:
    """Return a design of the look over the whole range."""
    kept = all(row.bound is None or row.value <= row.bound for row in one.rows)
    return {
        "values": dict(one.values), "objective": json_number(one.objective_told), "feasible": kept,
        "n_harmonics": one.harmonics or None,
    }  # fmt: skip


def conditions_json(found: Conditions) -> dict[str, object]:
    """Return the first-order conditions of a design."""
    return {
        "residual": found.residual,
        "violation": found.violation,
        "rows": [
            {"what": row.what, "case": row.case, "quantity": row.quantity.name, "multiplier": x}
            for row, x in found.rows
        ],
        "bounds": [{"variable": name, "side": side, "multiplier": x} for name, side, x in found.bounds],
    }
