"""What accuracy costs: the rows, which of them lead, the table and the picture."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from scene_cases import bladed_disk, loose_mass, oscillator, two_dof

from service.cli import main
from solver import AccuracyRow, AccuracyStudy, Scene, SettingError, accuracy_study, solve, sweep
from stickslip.lab.accuracy.pictures import accuracy_figure


@pytest.fixture(scope="module")
def study() -> AccuracyStudy:
    return accuracy_study(bladed_disk(), 700.0, harmonics=(1, 3, 7, 15), samples=(64, 1024), repeats=3)


def rows_of(study: AccuracyStudy, samples: int) -> list[AccuracyRow]:
    return [row for row in study.rows if row.samples == samples]


def test_the_rows_are_what_they_say(study: AccuracyStudy):
    """Amplitudes known by other means: 113.27, 91.27, 71.55 and, converged, 71.613 µm."""
    assert study.reference == pytest.approx(71.613e-6, rel=1e-4)
    assert study.reference_harmonics >= 101
    assert study.reference_error < 1e-6 * study.reference
    closed = rows_of(study, 0)
    assert [row.harmonics for row in closed] == [1, 3, 7, 15]
    assert [1e6 * row.max_abs for row in closed[:3]] == pytest.approx([113.27, 91.27, 71.55], abs=0.006)
    for row in study.rows:
        assert row.error == abs(row.max_abs - study.reference)
        assert row.milliseconds > 0.0
        assert row.residual <= 1e-9
        assert row.iterations >= 1
        assert row.evaluator == ("sampled" if row.samples else "closed form")


def test_samples_tend_to_the_closed_form(study: AccuracyStudy):
    closed = {row.harmonics: row for row in rows_of(study, 0)}
    for samples, share in ((64, 0.2), (1024, 5e-4)):
        for row in rows_of(study, samples):
            assert abs(row.max_abs - closed[row.harmonics].max_abs) <= share * study.reference
    assert all(row.samples >= 4 * row.harmonics for row in study.rows if row.samples)
    assert len(rows_of(study, 1024)) == 4


def test_the_leading_rows_are_beaten_by_none(study: AccuracyStudy):
    leading = sorted((row for row in study.rows if row.pareto), key=lambda row: row.milliseconds)
    assert leading
    assert [row.error for row in leading] == sorted((row.error for row in leading), reverse=True)
    for row in study.rows:
        if not row.pareto:
            assert any(r.error <= row.error and r.milliseconds <= row.milliseconds for r in leading)


def test_at_the_peak_if_nothing_is_said():
    study = accuracy_study(two_dof(), harmonics=(3,), samples=(), repeats=1)
    peak = sweep(two_dof()).peak
    assert peak is not None
    assert study.frequency_hz == peak.at
    assert study.rows[0].max_abs == pytest.approx(solve(two_dof(), frequency_hz=peak.at, harmonics=3).max_abs)


def test_the_last_row_is_exact():
    """Against an orbit enclosed by interval arithmetic, with no code of this package."""
    case = json.loads((Path(__file__).parents[4] / "tests" / "data" / "certified_orbits.json").read_text())[0]
    scene = Scene.from_dict(case["scene"])
    study = accuracy_study(scene, case["frequency_hz"], harmonics=(3, 21), samples=(64,), repeats=2)
    exact = study.rows[-1]
    assert exact.evaluator == "exact"
    assert exact.max_abs == study.reference == pytest.approx(case["value"], rel=1e-13)
    assert abs(exact.max_abs - case["value"]) <= exact.error == study.reference_error
    assert exact.pareto
    for row in study.rows[:-1]:
        assert row.error == pytest.approx(abs(row.max_abs - case["value"]), abs=1e-12)
    (axes,) = accuracy_figure(study.to_json()).axes
    assert [line.get_label() for line in axes.lines] == ["closed form", "64 samples", "exact"]


def test_a_scene_without_contacts():
    study = accuracy_study(oscillator(k=2.0, c=0.1), 0.2, harmonics=(1,), samples=(64,), repeats=1)
    assert all(row.error <= 1e-14 * study.reference for row in study.rows)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"frequency_hz": 0.0}, "frequency_hz"),
        ({"harmonics": (3, -1)}, "harmonics"),
        ({"harmonics": ()}, "harmonics"),
        ({"repeats": 0}, "harmonics"),
        ({"samples": (62,)}, "samples"),
    ],
)
def test_bad_settings(arguments: dict[str, Any], name: str):
    with pytest.raises(SettingError, match=f"`{name}`"):
        accuracy_study(two_dof(), **{"frequency_hz": 1.2, **arguments})


def test_no_solution_to_compare_with():
    with pytest.raises(SettingError, match="no solution"):
        accuracy_study(loose_mass(floor=30.0), 1.7)


def test_the_picture(study: AccuracyStudy):
    page = accuracy_figure(study.to_json())
    (axes,) = page.axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert "[ms]" in axes.get_xlabel()
    assert "relative error" in axes.get_ylabel()
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines) == ["closed form", "64 samples", "1024 samples"]
    closed = rows_of(study, 0)
    np.testing.assert_allclose(lines["closed form"].get_xdata(), [row.milliseconds for row in closed])
    np.testing.assert_allclose(
        lines["closed form"].get_ydata(), [row.error / study.reference for row in closed]
    )
    looks = [(to_rgb(line.get_color()), line.get_marker(), line.get_linestyle()) for line in axes.lines]
    for part in zip(*looks, strict=True):
        assert len(set(part)) == len(looks)
    numbers = {text.get_text() for text in axes.texts}
    assert {"1", "3", "7", "15"} <= numbers


def test_on_the_command_line(
    study: AccuracyStudy, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    asked = []

    def instead(*_: Any, frequency_hz: float | None = None, **__: Any) -> AccuracyStudy:
        asked.append(frequency_hz)
        return study

    monkeypatch.setattr("solver.accuracy_study", instead, raising=False)
    picture = tmp_path / "study.png"
    assert main(["accuracy", "bladed-disk", "--frequency", "700", "--plot", str(picture)]) == 0
    told = capsys.readouterr().out
    assert "closed form" in told
    assert "1024 samples" in told
    assert "71.61 µm" in told
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["accuracy", "bladed-disk", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert asked == [700.0, None]
    assert found["rows"][0]["harmonics"] == 1
    assert math.isclose(found["reference"], study.reference)
    assert any(row["pareto"] for row in found["rows"])
