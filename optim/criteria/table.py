"""The table of criteria in docs/design.md; `python -m service.rendering.docs_tables` writes it."""

from __future__ import annotations

from optim.criteria.criterion import Criterion
from optim.criteria.key import Key
from optim.criteria.registry import criteria


def criteria_table() -> str:
    """Every criterion with its weight and the keys of its limit, as a table of Markdown."""
    rows = ["| criterion | minimised by `weights` | limited by |", "|---|---|---|"]
    for one in criteria():
        weight = f"`{one.weight}` [1/{one.unit}]" if one.weight else ""
        rows.append(f"| {_said(one)} | {weight} | {'<br>'.join(map(_limited, one.keys))} |")
    return "\n".join(rows) + "\n"


def _said(one: Criterion) -> str:
    better = "" if one.smaller_is_better else ", larger is better"
    return f"**{one.name}** [{one.unit}]{better}: {one.help}"


def _limited(key: Key) -> str:
    option = f"{key.flag} {key.metavar}".replace("|", "\\|")
    return f"`{key.name}`: {key.help} `{option}`"
