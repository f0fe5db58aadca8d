"""The report of an identification: what it says is what was found."""

import re
from pathlib import Path

import numpy as np
import pytest
from measured_cases import two_dof_runs

import optim
import solver
from service.cli import main
from service.rendering.report.making import report_of
from service.rendering.report.sections import Designed


def test_a_report_says_what_was_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = two_dof_runs(np.random.default_rng(1), 0.03)[:2]
    text = "excitation.amplitude,damper.N0,frequency,real,imag\n"
    for run in runs:
        level, load = run["conditions"]["excitation.amplitude"], run["conditions"]["damper.N0"]
        for row in zip(run["frequency"], run["real"], run["imag"], strict=True):
            text += ",".join(str(number) for number in (level, load, *row)) + "\n"
    file, page = tmp_path / "rig.csv", tmp_path / "fit.html"
    file.write_text(text, encoding="utf-8")
    words = ["identify", "two-dof", str(file), "--unknown", "damper.kt", "15", "80", "--unknown", "damper.mu"]
    words += ["0.1", "0.6", "--harmonics", "5", "--starts", "1", "--report", str(page)]
    assert main(words) == 0
    told = capsys.readouterr().out
    report = page.read_text("utf-8")
    for name in ("damper.kt", "damper.mu"):
        line = next(line for line in told.splitlines() if line.strip().startswith(name))
        value = line.split()[1]
        assert f">{value}" in report
    assert "data:image/svg+xml;base64," in report
    assert "Correlations" in report
    assert "What to measure next" in report
    assert "[uncertain" in report
    assert not re.search(r"""(src|href)=["']?(https?:|//)""", report)


def test_without_an_estimate_there_is_a_report_all_the_same() -> None:
    scene = solver.load_scene("two-dof")
    data = [{"frequency": [1.0, 1.2, 1.4], "amplitude": [1.9, 1.8, 1.2]}]
    found = optim.identify(
        scene, data, {"damper.mu": (0.1, 0.6)}, harmonics=3, starts=1, should_stop=lambda: True
    )
    assert not found.estimates
    page = report_of(Designed(scene=scene, problem={}, result=found.to_json()), "html").decode()
    assert found.status.value in page
    assert "There is no estimate." in page
