"""Design reports: complete, without anything from elsewhere, and enough to have the same again."""

from __future__ import annotations

import html
import re
import shutil
from pathlib import Path

import pytest

import optim
import solver
from service.cli import main
from service.report.pdf import BROWSERS

PROBLEM = """scene = "two-dof"
limit = 2.5
max_band_hz = 0.5
harmonics = 3

[variables]
"damper.N0" = [20, 500]
"""


def design(folder: Path, target: str) -> Path:
    (folder / "given.toml").write_text(PROBLEM)
    words = ["design", "--problem", str(folder / "given.toml"), "--report", str(folder / target), "--json"]
    assert main(words) == 0
    return folder / target


def test_a_report_has_everything_and_gives_the_same_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = design(tmp_path, "report.html").read_text("utf-8")
    assert not re.search(r"""(src|href)=["']?(https?:|//|file:)""", page)
    assert "<script" not in page
    assert str(tmp_path) not in page
    for heading in (
        "Optimum",
        "Before and after",
        "What holds it",
        "At the peak",
        "Scene",
        "Plan",
        "Versions",
    ):
        assert f">{heading}<" in page
    for words in ("multiplier", "KKT residual", "estimated error", "Limits", "@media print"):
        assert words in page
    assert page.count("data:image/svg+xml;base64,") == 2
    blocks = [html.unescape(block) for block in re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL)]
    command, problem, scene = blocks
    (tmp_path / "problem.toml").write_text(problem)
    (tmp_path / "scene.toml").write_text(scene)
    first = capsys.readouterr().out
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        assert main([*command.split()[1:], "--json"]) == 0
    again = capsys.readouterr().out
    numbers = [re.search(r'"optimum": (\{.*?\}), "peak": (\{.*?\})', out) for out in (first, again)]
    assert numbers[0] is not None
    assert numbers[1] is not None
    assert numbers[0].groups() == numbers[1].groups()


@pytest.mark.parametrize("kind", ["design", pytest.param("pareto", marks=pytest.mark.long)])
def test_a_job_has_a_report(
    kind: str, server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "given.toml").write_text(PROBLEM.replace("max_band_hz = 0.5\n", ""))
    problem = ["--problem", str(tmp_path / "given.toml")]
    assert main(["submit", kind, *problem, "--url", server, "--json"]) == 0
    job = re.search(r'"id": "([^"]+)"', capsys.readouterr().out)
    assert job is not None
    assert main(["watch", job[1], "--url", server]) == 0
    assert main(["report", job[1], "--url", server, "--out", str(tmp_path / "report.html")]) == 0
    page = (tmp_path / "report.html").read_text("utf-8")
    assert ">Optimum<" in page
    assert (">Trade-off<" in page) == (kind == "pareto")


def test_a_report_of_another_kind_is_refused(server: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["submit", "solve", "two-dof", "--frequency", "1.2", "--harmonics", "3", "--url", server]
    assert main([*words, "--json"]) == 0
    job = re.search(r'"id": "([^"]+)"', capsys.readouterr().out)
    assert job is not None
    assert main(["report", job[1], "--url", server]) == 2
    assert "must be a design or a pareto job" in capsys.readouterr().err


@pytest.mark.long
def test_a_pdf_is_printed_by_a_browser(tmp_path: Path) -> None:
    if not any(shutil.which(name) for name in BROWSERS):
        pytest.skip("no Chromium or Chrome is installed")
    assert design(tmp_path, "report.pdf").read_bytes().startswith(b"%PDF")


def test_without_a_browser_a_pdf_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    words = ["design", "two-dof", "--harmonics", "1", "--report", str(tmp_path / "report.pdf")]
    assert main(words) == 2
    assert "needs Chromium or Chrome" in capsys.readouterr().err
    assert not (tmp_path / "report.pdf").exists()


@pytest.mark.long
def test_a_report_without_linear_limits() -> None:
    """A law without a load to remove: the responses alone."""
    from service.report.design import Designed, design_report

    raw = solver.load_scene("two-dof").to_dict()
    spring = {"name": "stop", "law": "gap", "between": ["m1", "ground"], "k": 50.0, "gap": 0.5}
    scene = solver.Scene.from_dict({**raw, "contacts": [*raw["contacts"], spring]})  # type: ignore[misc]
    found = optim.design(scene, variables={"damper.N0": (20.0, 500.0)}, harmonics=3)
    given = Designed(
        scene=scene, problem={"variables": {"damper.N0": [20, 500]}, "harmonics": 3}, result=found.to_json()
    )
    page = design_report(given)
    assert "between the linear limits" not in page
    assert "as given and at the optimum" in page
