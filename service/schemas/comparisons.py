"""Two runs side by side."""

from __future__ import annotations

from itertools import islice
from typing import Any

from service.auth.callers import Caller
from service.db.repositories.runs import RunRow
from service.jobs.common.scenes import CHECKED_BY
from service.jobs.differences import differences, figures
from service.queue.core import Service
from service.schemas.workbench_answers import Comparison, Figure, InputDifference, RunAnswer

_MOST_INPUTS = 500
_MOST_COUNTED = 10_000


def comparison(service: Service, a: str, b: str, caller: Caller) -> Comparison:
    """What differs between two runs of which the caller sees both (NotFoundError if not)."""
    rows = [service.runs.seen(one, caller.sees) for one in (a, b)]
    specs = [_inputs(service, row) for row in rows]
    found = differences(*specs)
    told = [InputDifference(part=d.part, path=d.path, a=d.a, b=d.b) for d in islice(found, _MOST_INPUTS)]
    return Comparison(
        a=RunAnswer.of_run(rows[0]),
        b=RunAnswer.of_run(rows[1]),
        inputs=told,
        more_inputs=sum(1 for _ in islice(found, _MOST_COUNTED)),
        results=_beside(*(_figures(service, row) for row in rows)),
    )


def _inputs(service: Service, row: RunRow) -> dict[str, Any]:
    """What a run computes: its kind, its scene with every value, its settings."""
    spec = service.jobs.spec(row.job.id)
    return {"kind": row.job.kind, **{key: value for key, value in spec.items() if key != CHECKED_BY}}


def _figures(service: Service, row: RunRow) -> dict[str, Any]:
    """The figures of a run; none if it has no result."""
    return figures(service.jobs.result(row.job.result_of or row.job.id))


def _beside(a: dict[str, Any], b: dict[str, Any]) -> list[Figure]:
    return [Figure(name=name, a=a.get(name), b=b.get(name)) for name in dict.fromkeys((*a, *b))]
