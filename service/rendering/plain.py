"""A result of any kind for people; of which nothing else is known, its numbers and words by their keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.jobs.registry import Json, PrintedResult, Registry
from service.rendering.tables.text import print_pairs

_FEW = 6


def print_result(kind: str, result: Json) -> None:
    """Print a result: as the local command does, as its kind says, or by its keys."""
    # Loaded here, as below: the help of a command prints no result.
    from service.rendering.tables import results

    if results.knows(kind):
        results.of_kind(kind)(result)
        return
    # Loaded here: it brings every kind along.
    from service.settings.kinds import registry_here

    view = told(kind, result, registry_here())
    print_pairs(view.title, view.pairs)


def told(kind: str, result: Json, registry: Registry) -> PrintedResult:
    """What is printed of a result: as its kind says, or by its keys."""
    tell = registry[kind].view.tell if kind in registry else None
    return tell(result) if tell is not None else PrintedResult(title=kind, pairs=list(_pairs(result, "")))


def _pairs(table: Json, before: str) -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _pairs(value, f"{before}{key}.")
        else:
            yield before + key, _shown(value)


def _shown(value: Any) -> str:
    """A value in a few words."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str) or not isinstance(value, Sequence):
        return "" if value is None else str(value)
    scalars = not any(isinstance(one, (Mapping, list)) for one in value)
    few = scalars and len(value) <= _FEW
    return ", ".join(map(_shown, value)) if few else f"{len(value)} values"
