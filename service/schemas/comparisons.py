"""Two runs side by side: what differs between their inputs, and the figures of their results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from service.auth.callers import Caller
from service.db.repositories.run_repository import RunRow
from service.jobs.common.scene_requests import CHECKED_BY
from service.jobs.strict_json import digest
from service.queue.core import Service
from service.schemas.workbench_answers import Comparison, Figure, InputDifference, RunAnswer

SCENE, SETTINGS = "scene", "settings"
_CONTACTS = "contacts"
_LONGEST = 500  # characters of a value that is shown as it is

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Difference:
    """An input that is not the same; None where it is not given."""

    part: str
    path: str
    a: Any
    b: Any


def differences(a: Json, b: Json) -> Iterator[Difference]:
    """Yield what differs between two specs, the scene first.

    Rows of a table that have names (contacts, springs) are compared by name, other rows by their number. A
    value of a contact has the path that `set` takes, such as ``damper.N0``.
    """
    yield from (
        Difference(SCENE, _shown_path(path), one, other)
        for path, one, other in _differences((), a.get(SCENE), b.get(SCENE))
    )
    rest = ({key: value for key, value in spec.items() if key != SCENE} for spec in (a, b))
    yield from (
        Difference(SETTINGS, ".".join(path), one, other) for path, one, other in _differences((), *rest)
    )


def _shown_path(path: tuple[str, ...]) -> str:
    """Of a contact as parameters are named."""
    return ".".join(path[1:] if path[:1] == (_CONTACTS,) and len(path) > 1 else path)


def _differences(path: tuple[str, ...], a: Any, b: Any) -> Iterator[tuple[tuple[str, ...], Any, Any]]:
    if a == b:
        return
    one, other = _table(a), _table(b)
    if (one is None and a is not None) or (other is None and b is not None) or (one is other is None):
        yield path, _shown(a), _shown(b)
        return
    one, other = one or {}, other or {}
    for key in dict.fromkeys((*one, *other)):
        yield from _differences((*path, key), one.get(key), other.get(key))


def _table(value: Any) -> Json | None:
    """A table: an object, or a list of objects by their names or numbers; None for anything else."""
    if isinstance(value, Mapping):
        return value
    if not isinstance(value, list) or not value or not all(isinstance(row, Mapping) for row in value):
        return None
    names = [row.get("name") for row in value]
    named = all(isinstance(name, str) for name in names) and len(set(names)) == len(names)
    return dict(zip(names if named else map(str, range(len(value))), value, strict=True))


def _shown(value: Any) -> Any:
    """A value; of a long one what it is, with a digest that tells it apart."""
    if not isinstance(value, str | Sequence | Mapping) or len(repr(value)) <= _LONGEST:
        return value
    kind = "text" if isinstance(value, str) else "table" if isinstance(value, Mapping) else "list"
    rows = isinstance(value, list) and isinstance(value[0], list)
    size = f"{len(value)} x {len(value[0])}" if rows else str(len(value))
    return f"{kind} of {size}, sha256 {digest(value)[:16]}"


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
        results=_beside(*(_results(service, row) for row in rows)),
    )


def _inputs(service: Service, row: RunRow) -> dict[str, Any]:
    """What a run computes: its kind, its scene with every value, its settings."""
    spec = service.jobs.spec(row.job.id)
    return {"kind": row.job.kind, **{key: value for key, value in spec.items() if key != CHECKED_BY}}


def _results(service: Service, row: RunRow) -> dict[str, Any]:
    """The figures of a run; none if it has no result."""
    return service.jobs.figures(row.job.result_of or row.job.id)


def _beside(a: dict[str, Any], b: dict[str, Any]) -> list[Figure]:
    return [Figure(name=name, a=a.get(name), b=b.get(name)) for name in dict.fromkeys((*a, *b))]
