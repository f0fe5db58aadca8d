"""The page on identification: rig, parameters, robust design and report; its tables are up to date."""

import re
import shlex
from pathlib import Path

import pytest
from docs_tables import TABLES, with_tables

from optim.problem.uncertainty_input import read_uncertain
from service.cli import main
from solver import load_scene
from solver.scene.toml import load_raw

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE_NAME = "identification.md"
PAGE = (ROOT / "docs" / PAGE_NAME).read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
RIG, AGAIN, POSTERIOR = (text for language, text in BLOCKS if language == "python")
COMMANDS = [line for language, text in BLOCKS if language == "sh" for line in text.splitlines()]


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the measurements of the page."""
    monkeypatch.chdir(tmp_path)
    exec(compile(RIG, PAGE_NAME, "exec"), {"__name__": "page"})
    return tmp_path


def run(line: str) -> None:
    words = shlex.split(line)
    assert words[0] == "stickslip"
    assert main(words[1:]) == 0


def test_the_parameters_of_the_rig(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(COMMANDS[0])
    told = capsys.readouterr().out
    kt, mu = (re.search(rf"damper.{name} +([\d.]+)", told) for name in ("kt", "mu"))
    assert kt is not None
    assert mu is not None
    quoted = re.search(r"kt = ([\d.]+) ± [\d.]+ N/m and μ = ([\d.]+)", PAGE)
    assert quoted is not None
    assert [float(kt[1]), float(mu[1])] == pytest.approx([float(x) for x in quoted.groups()], rel=2e-4)
    assert (rig / "fit.png").stat().st_size > 10_000
    problem = load_raw(rig / "damper.toml")
    scene = load_scene(problem["scene"]).with_values(problem["set"])
    assert read_uncertain(scene, (), problem["uncertain"]).coordinates[0].name == "damper.kt"


@pytest.mark.long
def test_the_whole_way(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every line of the page, to the report of the robust design."""
    for line in COMMANDS:
        run(line)
    assert "damper.kt" in (rig / "damper.html").read_text(encoding="utf-8")
    exec(compile(AGAIN, PAGE_NAME, "exec"), {"__name__": "page"})
    assert "damper.mu" in capsys.readouterr().out
    exec(compile(POSTERIOR, PAGE_NAME, "exec"), {"__name__": "page"})
    told = re.search(r"of μ from ([\d.]+) to ([\d.]+), and a load of ([\d.]+) N", PAGE)
    assert told is not None
    printed = [float(one) for one in re.findall(r"-?\d+\.\d+", capsys.readouterr().out)]
    assert [printed[0], printed[1], printed[4]] == pytest.approx(
        [float(one) for one in told.groups()], rel=1e-3
    )


def test_the_page_is_that_of_the_registries() -> None:
    assert with_tables(PAGE, TABLES[PAGE_NAME]) == PAGE
