"""Parts of a design's result as objects of JSON."""

from __future__ import annotations

from optim.criteria.criterion import Row
from optim.criteria.linearised import Conditions
from optim.criteria.rows import Evaluation
from optim.results.basins import Basin, Checked
from solver.continuation.branch import Branch
from solver.results.known import Known
from solver.results.told import json_number


def over_bands(evaluation: Evaluation) -> dict[str, Branch]:
    """Return of each case the response over its band, which is its first."""
    first: dict[str, Branch] = {}
    for response in evaluation.responses:
        first.setdefault(response.case, response.branch)
    return first


def bands_json(evaluation: Evaluation) -> list[dict[str, object]]:
    """Return where the resonance band of each case lies."""
    return [
        {
            "case": case, "limit": branch.band.limit, "width_hz": branch.band.width,
            "intervals_hz": [list(interval) for interval in branch.band.intervals],
        }
        for case, branch in over_bands(evaluation).items()
        if branch.band is not None
    ]  # fmt: skip


def row_json(row: Row) -> dict[str, object]:
    """Return a row."""
    return {
        "quantity": row.quantity.name, "case": row.case, "what": row.what, "value": row.value,
        "unit": row.quantity.unit, "at": json_number(row.at_hz), "bound": row.bound, "weight": row.weight,
        "smaller_is_better": row.quantity.smaller_is_better,
    }  # fmt: skip


def known_parts(evaluation: Evaluation) -> list[tuple[str, Known]]:
    """Return for the response of each case over its band its name and how well its peak is known."""
    return [(case, b.known) for case, b in over_bands(evaluation).items() if b.peak is not None]


def looked_json(one: Evaluation) -> dict[str, object]:
    """Return a design of the look over the whole range."""
    kept = all(row.bound is None or row.value <= row.bound for row in one.rows)
    return {
        "values": dict(one.values), "objective": one.objective, "feasible": kept,
        "n_harmonics": one.harmonics or None,
    }  # fmt: skip


def checked_json(one: Checked) -> dict[str, object]:
    """Return a local optimum computed again."""
    return {
        "values": dict(one.values), "n_harmonics": one.harmonics, "peak": json_number(one.peak),
        "objective": json_number(one.objective), "feasible": one.feasible,
    }  # fmt: skip


def basin_json(basin: Basin) -> dict[str, object]:
    """Return a local optimum."""
    return {
        "values": dict(basin.values), "peak": basin.peak, "objective": basin.objective,
        "settled": basin.settled, "feasible": basin.feasible, "proven": basin.proven,
    }  # fmt: skip


def conditions_json(found: Conditions) -> dict[str, object]:
    """Return the first-order conditions of a design."""
    return {
        "residual": json_number(found.residual),
        "violation": found.violation,
        "rows": [
            {"what": row.what, "case": row.case, "quantity": row.quantity.name, "multiplier": x}
            for row, x in found.rows
        ],
        "bounds": [{"variable": name, "side": side, "multiplier": x} for name, side, x in found.bounds],
    }
