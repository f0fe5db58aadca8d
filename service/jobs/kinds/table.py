"""The tables of the kinds of job in a page: ``python -m service.jobs.kinds.table docs/jobs.md``."""

from __future__ import annotations

import sys
from pathlib import Path

from service.jobs.common.scenes import HarmonicRequest, SceneRequest
from service.jobs.kinds import SHIPPED
from service.jobs.registry import JobKind, JobRequest, Registry

KINDS, AGAIN = "kinds", "interrupted"
_HEADS = {
    KINDS: "| kind | keys of its own, those needed in bold | result | sweeps stored |",
    AGAIN: "| kind | what the next attempt does |",
}
_OF_ALL = (HarmonicRequest, SceneRequest, JobRequest)
_WAYS = {
    "goes on": "goes on behind the last point that was kept; the result is the one it would have been, bit "
    "for bit",
    "parts": "computes the parts that are missing; the result is the same bit for bit",
    "anew": "begins anew",
}


def kinds_table(registry: Registry) -> str:
    """What each kind takes, computes and stores, as a table of Markdown."""
    rows = [
        f"| `{kind.name}` | {_keys(kind)} | {kind.view.result or kind.summary} | {kind.view.sweeps} |"
        for kind in registry
    ]
    return _table(KINDS, rows)


def interrupted_table(registry: Registry) -> str:
    """What becomes of a job of each kind whose worker died, as a table of Markdown."""
    names = {way: [f"`{kind.name}`" for kind in registry if _way(kind) == way] for way in _WAYS}
    return _table(AGAIN, [f"| {', '.join(names[way])} | {_WAYS[way]} |" for way in _WAYS if names[way]])


def _table(name: str, rows: list[str]) -> str:
    head = _HEADS[name]
    rule = "|" + " --- |" * (head.count("|") - 1)
    return "\n".join([head, rule, *rows]) + "\n"


def _keys(kind: JobKind) -> str:
    """The keys that not every kind has, with those that must be given in bold."""
    if kind.view.keys:
        return kind.view.keys
    shared = next(base for base in _OF_ALL if issubclass(kind.request, base))
    own = [
        (field.alias or name, field.is_required())
        for name, field in kind.request.model_fields.items()
        if shared.model_fields.get(name) is None or shared.model_fields[name].annotation != field.annotation
    ]
    return ", ".join(f"**`{key}`**" if needed else f"`{key}`" for key, needed in own)


def _way(kind: JobKind) -> str:
    if kind.run_on is not None:
        return "goes on"
    return "anew" if kind.parts is None else "parts"


def placed(text: str, name: str, table: str) -> str:
    """A page with a table between its marks (ValueError if one is not there)."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = text.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n\n{table}\n{end}{after}"


def with_tables(text: str, registry: Registry) -> str:
    """The page with the tables between their marks as they are now (ValueError if a mark is not there)."""
    for name, table in ((KINDS, kinds_table(registry)), (AGAIN, interrupted_table(registry))):
        text = placed(text, name, table)
    return text


def main() -> None:
    """Bring the tables of a page up to date."""
    page = Path(sys.argv[1])
    page.write_text(with_tables(page.read_text(encoding="utf-8"), SHIPPED), encoding="utf-8")


if __name__ == "__main__":
    main()
