"""The tables of docs/identification.md; `python -m service.rendering.docs_tables` writes them."""

from __future__ import annotations

from optim.identification.data.measured_units import known_units
from optim.identification.data.registry import data_kinds
from optim.identification.readers.registry import data_formats


def data_columns_table() -> str:
    """Every kind of data with its columns, their units and the words of its head, as a table of Markdown."""
    rows = ["| kind | column | units, the first if none is named | what it is |", "|---|---|---|---|"]
    for kind in data_kinds():
        for column in kind.columns:
            units = ", ".join(known_units(column.dimension))
            rows.append(f"| `{kind.name}` | `{column.name}` | {units} | {column.help} |")
        rows += [f"| `{kind.name}` | head: `{word}` | | {text} |" for word, text in kind.words.items()]
    return "\n".join(rows) + "\n"


def data_formats_table() -> str:
    """Every format of files with its endings, as a table of Markdown."""
    rows = ["| format | files end in | how |", "|---|---|---|"]
    for one in data_formats():
        rows.append(f"| {one.name} | {', '.join(f'`{suffix}`' for suffix in one.suffixes)} | {one.help} |")
    return "\n".join(rows) + "\n"
