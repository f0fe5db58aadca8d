"""The type of the key `uncertain`; `optim.problem.uncertainty_input` reads what it means."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

MAX_UNCERTAIN = 2000


def _uncertain(value: object) -> object:
    """Tables and lists of a size that can be computed; the design layer looks at what they mean."""
    if not isinstance(value, dict | list) or not value:
        raise ValueError("must be a table of intervals, a table of an ellipsoid, or a list of samples")
    if _leaves(value) > MAX_UNCERTAIN:
        raise ValueError(f"must hold at most {MAX_UNCERTAIN} numbers")
    tables = value if isinstance(value, list) else [value]
    for table in tables:
        disk = table.get("mistuning") if isinstance(table, dict) else None
        if isinstance(disk, dict):
            _mistuning(disk)
    return value


def _leaves(value: object) -> int:
    """How many numbers and words a value holds; without recursion, a body may be nested deeply."""
    count, pending = 0, [value]
    while pending:
        item = pending.pop()
        if isinstance(item, dict):
            pending.extend(item.values())
        elif isinstance(item, list):
            pending.extend(item)
        else:
            count += 1
    return count


def _mistuning(disk: dict[str, Any]) -> None:
    """The types of a mistuned disk, which the design layer takes for granted."""
    of, seeds, rows = disk.get("of"), disk.get("seeds", [1]), disk.get("values", [1.0])
    names = [of] if isinstance(of, str) else of
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise ValueError("must have in `mistuning.of` a part of the disk, or a list of them")
    if not isinstance(seeds, list) or not all(_whole(seed) for seed in seeds):
        raise ValueError("must have in `mistuning.seeds` a list of whole numbers >= 0")
    if not isinstance(rows, list) or not rows:
        raise ValueError("must have in `mistuning.values` a list of factors, or of lists of them")
    factors = [factor for row in rows for factor in (row if isinstance(row, list) else [row])]
    if any(isinstance(f, bool) or not isinstance(f, int | float) for f in factors):
        raise ValueError("must have in `mistuning.values` numbers alone")


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**63


Uncertain = Annotated[
    Any,
    BeforeValidator(_uncertain),
    WithJsonSchema({"anyOf": [{"type": "object"}, {"type": "array", "items": {"type": "object"}}]}),
]
