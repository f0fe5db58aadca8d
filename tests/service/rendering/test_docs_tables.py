"""Tables in the docs, and sources that are generated, say what the code says."""

from pathlib import Path

import pytest
from docs_tables import SOURCES, TABLES, with_tables

ROOT = Path(__file__).resolve().parent.parent.parent.parent
DOCS = ROOT / "docs"


@pytest.mark.parametrize("page", TABLES)
def test_tables_are_up_to_date(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text == with_tables(text, TABLES[page]), "run: python docs/docs_tables.py"


@pytest.mark.parametrize("file", SOURCES)
def test_generated_sources_are_up_to_date(file: str) -> None:
    text = (ROOT / file).read_text(encoding="utf-8")
    assert text == SOURCES[file](), "run: python docs/docs_tables.py"
