"""The page of a link says of a result what the command says."""

import html
from datetime import UTC, datetime
from typing import Any

import pytest

import solver
from service.cli import main
from service.jobs.kinds import SHIPPED
from service.rendering.report.about import shared_page
from service.rendering.text import told
from service.schemas.workbench_answers import SharedRun


def page_of(kind: str, result: dict[str, Any], scene: str = "two-dof") -> str:
    now = datetime(2026, 1, 2, tzinfo=UTC)
    run = SharedRun(
        id="1", kind=kind, status="successful", progress=1.0, scene=scene, name="", notes="", tags=[],
        created=now, started=now, finished=now, error=None,
        request={"scene": scene, "set": {"damper.N0": 80.0}},
    )  # fmt: skip
    return html.unescape(shared_page(run, told(kind, result, SHIPPED.tell_of(kind)), [], "token"))


def test_a_study_is_told_as_the_command_tells_it(capsys: pytest.CaptureFixture[str]) -> None:
    found = solver.nonlinear_mode(solver.load_scene("two-dof"), amplitudes=(0.1, 3.0), harmonics=1)
    page = page_of("modes", found.to_json())
    assert main(["modes", "two-dof", "--from", "0.1", "--to", "3", "--harmonics", "1"]) == 0
    printed = [line.split() for line in capsys.readouterr().out.splitlines() if "N" not in line]
    rows = [cells for cells in printed if cells and cells[0].startswith(("0.1", "most"))]
    assert len(rows) >= 2
    assert all(cell in page for cells in rows for cell in cells)
    assert "<th scope='row'>set.damper.N0</th><td>80</td>" in page


def test_a_kind_of_which_nothing_is_said_is_told_by_its_keys() -> None:
    page = page_of("of-its-own", {"worst": 0.25, "parts": {"high": True, "none": None}, "many": [1.0] * 9})
    for name, value in (("worst", "0.25"), ("parts.high", "yes"), ("many", "9 values")):
        assert f"<th scope='row'>{name}</th><td>{value}</td>" in page
    assert "parts.none" not in page
