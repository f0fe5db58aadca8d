"""The figures of the paper: every script of docs/paper runs, and the page quotes the numbers it prints."""

import re
import runpy
import sys
from pathlib import Path

import matplotlib as mpl
import pytest

DOCS = Path(__file__).resolve().parent.parent.parent.parent / "docs"
SCRIPTS = sorted(script for script in (DOCS / "paper").glob("*.py") if script.stem != "look")
PAGE = (DOCS.parent / "benchmarks" / "paper.md").read_text(encoding="utf-8")
SLOW = ("figure13",)
LONGEST_SCRIPT = 40


def quoted(script: Path) -> dict[str, str]:
    """What the page says beside a figure: the first and the last column of its table."""
    _, _, after = PAGE.partition(f"| [{script.name}](../docs/paper/{script.name}) |")
    rows = re.match(r".*\n\|---.*\n((?:\|.*\n)+)", after)
    assert rows is not None, f"{script.name} has no table"
    cells = [re.split(r"(?<!\\)\|", row.replace("\n", ""))[1:-1] for row in rows[1].splitlines()]
    return {first.strip().replace("\\|", "|"): last.strip() for first, _, last in cells}


def test_the_commands_of_the_page_name_scripts() -> None:
    lines = re.findall(r"^python (.*)$", PAGE, flags=re.MULTILINE)
    assert lines
    assert [line for line in lines if DOCS.parent / line not in SCRIPTS] == []
    assert len(re.findall("^```", PAGE, flags=re.MULTILINE)) == 2


def test_every_figure_has_a_script() -> None:
    assert [script.stem for script in SCRIPTS] == [
        *(f"figure{number:02d}" for number in (*range(3, 9), *range(10, 14))), "superharmonics",
    ]  # fmt: skip


@pytest.mark.few(5)
@pytest.mark.parametrize(
    "script",
    [pytest.param(script, marks=pytest.mark.long if script.stem in SLOW else ()) for script in SCRIPTS],
    ids=lambda script: script.stem,
)
def test_the_script_draws_and_says_what_the_page_quotes(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(script.parent))
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    with mpl.rc_context():
        runpy.run_path(str(script), run_name="__main__")
    said = dict(line.split(": ", 1) for line in capsys.readouterr().out.splitlines())
    assert said == quoted(script)
    (picture,) = tmp_path.iterdir()
    assert picture.name == f"{script.stem}.png"
    assert picture.stat().st_size > 20_000
    assert (DOCS / "img" / "paper" / picture.name).is_file()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_the_script_is_short_and_uses_the_public_interface(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_SCRIPT
    modules = set(re.findall(r"^(?:from|import) ([\w.]+)", text, flags=re.MULTILINE))
    assert modules <= {"look", "stickslip", "numpy"}
