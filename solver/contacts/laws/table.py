"""The table of laws in docs/laws.md; `python -m service.rendering.docs_tables` writes it."""

from __future__ import annotations

from solver.contacts.laws.registry import DEFAULT, laws


def laws_table() -> str:
    """Every law with its force and parameters, as a table of Markdown."""
    rows = ["| `law` | Force | Parameters that can be continued in |", "|---|---|---|"]
    for word, law in laws().items():
        name = f"`{word}` (default)" if word == DEFAULT else f"`{word}`"
        rows.append(f"| {name} | {law.FORCE} | {', '.join(f'`{key}`' for key in law.PARAMETERS)} |")
    return "\n".join(rows) + "\n"
