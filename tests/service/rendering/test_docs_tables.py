"""Tables in the docs say what the code says."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.rendering.docs_tables import TABLES, with_tables

DOCS = Path(__file__).resolve().parent.parent.parent.parent / "docs"


@pytest.mark.parametrize("page", TABLES)
def test_tables_are_up_to_date(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text == with_tables(text, TABLES[page]), "run: python -m service.rendering.docs_tables"
