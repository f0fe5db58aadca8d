"""`stickslip new`: what it writes runs at once, and nothing is replaced unasked."""

from pathlib import Path

import pytest

import solver
from service.cli import main
from stickslip.lab.templates.commands import known


@pytest.mark.parametrize("like", known())
def test_what_is_written_is_a_scene_of_that_name(
    like: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my-blade", "--like", like]) == 0
    text = Path("my-blade.toml").read_text("utf-8")
    assert "#" in text
    assert solver.load_scene("my-blade").name == "my-blade"


def test_it_runs_at_once_and_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my-blade.toml"]) == 0
    assert main(["sweep", "my-blade", "--harmonics", "3"]) == 0
    before = Path("my-blade.toml").read_bytes()
    capsys.readouterr()
    assert main(["new", "my-blade.toml", "--like", "two-dof"]) == 2
    assert "--force" in capsys.readouterr().err
    assert Path("my-blade.toml").read_bytes() == before
    assert main(["new", "my-blade.toml", "--like", "two-dof", "--force"]) == 0
    assert solver.load_scene("my-blade.toml").contacts[0].name == "damper"
