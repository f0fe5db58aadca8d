"""Files that follow from the code: ``python -m service.rendering.docs_tables`` brings them up to date.

Each table of the docs stands between two marks, ``<!-- NAME: begin -->`` and ``<!-- NAME: end -->``; a source
is written as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from optim.criteria.table import criteria_table
from optim.identification.data.columns_table import data_columns_table, data_formats_table
from optim.problem.keyword_source import keyword_source
from service.jobs.kinds.registry.table import placed
from service.rendering.problem_table import problem_table
from service.settings.table import settings_table
from solver.contacts.laws.table import laws_table
from solver.matrices.readers.table import formats_table

TABLES: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "design.md": {"keys": problem_table, "criteria": criteria_table},
    "identification.md": {"columns": data_columns_table, "formats": data_formats_table},
    "laws.md": {"laws": laws_table},
    "matrices.md": {"formats": formats_table},
    "operations.md": {"settings": settings_table},
}
"""Page of docs/, name of the mark, table."""
SOURCES: Mapping[str, Callable[[], str]] = {"optim/problem/keyword_types.py": keyword_source}
"""File, its text."""


def with_tables(text: str, tables: Mapping[str, Callable[[], str]]) -> str:
    """A page with its tables as they are now (ValueError if a mark is not there)."""
    for name, table in tables.items():
        text = placed(text, name, table())
    return text


def main() -> None:
    """Bring tables and sources up to date."""
    for name, tables in TABLES.items():
        page = Path("docs") / name
        page.write_text(with_tables(page.read_text(encoding="utf-8"), tables), encoding="utf-8")
    for file, source in SOURCES.items():
        Path(file).write_text(source(), encoding="utf-8")


if __name__ == "__main__":
    main()
