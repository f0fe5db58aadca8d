"""The table of formats in docs/matrices.md; `python -m service.rendering.docs_tables` writes it."""

from __future__ import annotations

from solver.matrices.readers.registry import readers

_GIVES = {
    "matrix": "one matrix", "matrices": "one matrix or several", "modes": "modes", "labels": "names of rows",
    "nodes": "nodes",
}  # fmt: skip


def formats_table() -> str:
    """Every format with its endings, what it gives, and the word of an upload, as a table of Markdown."""
    rows = ["| files end in | format | holds | `?format=` |", "|---|---|---|---|"]
    for reader in readers():
        suffixes = ", ".join(f"`{suffix}`" for suffix in reader.suffixes)
        gives = ", ".join(_GIVES[kind] for kind in reader.gives)
        words = ", ".join(f"`{word}`" for word in (reader.word, *reader.media))
        rows.append(f"| {suffixes} | {reader.help} | {gives} | {words} |")
    return "\n".join(rows) + "\n"
