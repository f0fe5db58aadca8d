"""What people read: how long it is, how a page begins, and that nothing stands in two places."""

import re
import runpy
from datetime import date
from pathlib import Path

import pytest
from changelog import fragments, released

ROOT = Path(__file__).resolve().parents[2]
HOUSE = runpy.run_path(str(ROOT / "docs" / "house.py"))
PAGES = sorted((ROOT / "docs").glob("*.md"))
MOST_PAGES, MOST_WORDS, MOST_OF_THE_README, LINES_OF_A_RELEASE = 36, 60_000, 700, 60
ALIKE = 12  # words in a row that stand in two pages
BEGINS = "After this page you can "


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def prose(page: Path) -> list[str]:
    """The words of a page without code, and without tables that follow from the code."""
    text = re.sub(r"^```.*?^```$", "", text_of(page), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"<!-- (\w+): begin -->.*?<!-- \1: end -->", "", text, flags=re.DOTALL).split()


def test_pages_and_words_stay_few() -> None:
    found = HOUSE["House"](ROOT).pages()
    assert found["pages"] <= MOST_PAGES
    assert found["words"] <= MOST_WORDS
    assert found["words of the README"] <= MOST_OF_THE_README


def test_a_page_begins_with_what_a_reader_can_do_after_it() -> None:
    first = {page.name: text_of(page).split("\n\n")[1] for page in PAGES}
    assert [name for name, words in first.items() if not words.startswith(BEGINS)] == []


def test_nothing_stands_in_two_pages() -> None:
    places: dict[tuple[str, ...], str] = {}
    twice = set()
    for page in [ROOT / "README.md", *PAGES]:
        words = prose(page)
        for start in range(len(words) - ALIKE + 1):
            run = tuple(words[start : start + ALIKE])
            other = places.setdefault(run, page.name)
            if other != page.name:
                twice.add(f"{other}, {page.name}: {' '.join(run)}")
    assert sorted(twice) == []


def test_the_rows_of_a_table_have_its_columns() -> None:
    """A bar within a cell is written with a backslash."""
    wrong = []
    for page in [ROOT / "README.md", *PAGES, *sorted((ROOT / "benchmarks").rglob("*.md"))]:
        text = re.sub(r"^```.*?^```$", "", text_of(page), flags=re.MULTILINE | re.DOTALL)
        for table in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
            bars = [len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()]
            wrong += [f"{page.name}: {table.splitlines()[0]}"] * (len(set(bars)) > 1)
    assert wrong == []


def test_a_release_is_told_in_a_minute() -> None:
    """Each is dated, newest first, and as long as somebody reads."""
    text = text_of(ROOT / "CHANGELOG.md")
    heads = [*re.finditer(r"^## (.+)$", text, flags=re.MULTILINE)]
    assert heads
    assert [one[1] for one in heads if not re.fullmatch(r"\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)", one[1])] == []
    ends = [*(one.start() for one in heads[1:]), len(text)]
    sections = [text[one.start() : end].rstrip() for one, end in zip(heads, ends, strict=True)]
    assert [
        len(section.splitlines()) for section in sections if len(section.splitlines()) > LINES_OF_A_RELEASE
    ] == []


def test_changes_since_it_are_files_that_a_release_gathers(tmp_path: Path) -> None:
    fragments(ROOT / "changes")  # each says by its name what it is
    (tmp_path / "slider.fixed.md").write_text("A slider\nstays.\n")
    (tmp_path / "export.added.md").write_text("`stickslip export`.\n")
    text = released("# Changelog\n\nWords.\n\n## 1.0.0 (2026-11-30)\n", "1.1.0", date(2027, 1, 2), tmp_path)
    assert text == (
        "# Changelog\n\nWords.\n\n## 1.1.0 (2027-01-02)\n\n### Added\n\n- `stickslip export`.\n\n"
        "### Fixed\n\n- A slider stays.\n\n## 1.0.0 (2026-11-30)\n"
    )
    (tmp_path / "more.md").touch()
    with pytest.raises(ValueError, match="must end in"):
        fragments(tmp_path)
