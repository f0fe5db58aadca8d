"""The bar that long computations show where somebody watches, and only there."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

import optim
import solver
from solver.results import watch
from solver.results.watch import Bar, is_watched, shows_progress

ROOT = Path(__file__).resolve().parents[3]


def test_nobody_watches_a_pipe(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv(watch.SETTING, raising=False)
    monkeypatch.setattr(watch, "PATIENCE", 0.0)
    assert not is_watched()
    solver.sweep(solver.load_scene("two-dof"), harmonics=3)
    assert capfd.readouterr().err == ""


def test_a_bar_says_how_far_it_is_and_leaves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    bar = Bar("sweep", lambda: now[0])
    for at, share in ((0.5, 0.1), (2.0, 0.5), (2.05, 0.6), (4.0, 1.2)):
        now[0] = at
        bar(share, 7)
    written = capsys.readouterr().err
    assert written.count("\r") == 2  # not within the first second, nor again within a tenth
    assert "sweep |████████████············|  50 %, 7, 2 s, 2 s left" in written
    assert "100 %, 7, 4 s, 0 s left" in written
    bar.close()
    wiped = capsys.readouterr().err
    assert wiped.strip() == ""
    assert len(wiped) >= len(written.split("\r")[-1].rstrip())


def test_what_runs_within_another_has_no_bar_of_its_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(watch.SETTING, "1")
    monkeypatch.setattr(watch, "PATIENCE", 0.0)
    monkeypatch.setattr(watch, "PAUSE", 0.0)
    scene = solver.load_scene("two-dof")
    optim.design(scene, harmonics=3)
    written = capsys.readouterr().err
    assert "design |" in written
    assert "sweep |" not in written
    assert written.endswith("\r")
    seen: list[float] = []
    solver.sweep(scene, harmonics=3, on_progress=lambda share, _: seen.append(share))
    assert seen
    assert capsys.readouterr().err == ""
    with pytest.raises(solver.SettingError):
        solver.sweep(scene, harmonics=-1)
    solver.sweep(scene, harmonics=3)
    assert "sweep |" in capsys.readouterr().err


def test_only_what_tells_its_progress_can_have_one() -> None:
    with pytest.raises(TypeError, match="on_progress"):
        shows_progress("solve")(solver.solve)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(pty, "openpty"), reason="there are no pseudo-terminals here")
def test_a_terminal_shows_it_and_the_command_has_its_own() -> None:
    """In a process whose standard error is a terminal; without a tenth of a second of patience."""
    code = (
        "from solver.results import watch as d; d.PATIENCE = d.PAUSE = 0.0\n"
        "import solver; solver.sweep(solver.load_scene('two-dof'), harmonics=3)"
    )
    environment = {key: value for key, value in os.environ.items() if key != watch.SETTING}
    ours, theirs = pty.openpty()
    try:
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, stderr=theirs, check=True, env=environment)
        assert b"sweep |" in os.read(ours, 65536)
    finally:
        os.close(ours)
        os.close(theirs)
