"""Completion in the shell: what is offered behind a half-written line, and the script that asks for it."""

import contextlib
import io
import os
import shutil
import subprocess
from pathlib import Path
from unittest.mock import patch

import pytest
from launch import COMMAND

import solver
from optim.problem.design_problem import Method
from service.cli import main
from service.jobs.common.study_keys import WORDS
from solver.scene.parameter_paths import parameter_paths

ROOT = Path(__file__).resolve().parent.parent.parent.parent


def run(line: str, instruction: str, folder: Path) -> str:
    """What the command prints for a shell; `line` ends where the cursor is."""
    words = f"stickslip {line}x".split()
    environment = {
        "_STICKSLIP_COMPLETE": instruction, "COMP_WORDS": f"stickslip {line}",
        "COMP_CWORD": str(len(words) - 1),
    }  # fmt: skip
    out, said = io.StringIO(), io.StringIO()
    with (
        patch.dict(os.environ, environment), contextlib.chdir(folder),
        contextlib.redirect_stdout(out), contextlib.redirect_stderr(said),
    ):  # fmt: skip
        assert main([]) == 0
    assert said.getvalue() == ""
    return out.getvalue()


def offered(line: str, folder: Path) -> list[str]:
    return run(line, "complete_bash", folder).split()


def test_commands_are_offered(tmp_path: Path) -> None:
    assert offered("so", tmp_path) == ["solve"]
    assert offered("submit ca", tmp_path) == ["campbell"]
    assert offered("keys r", tmp_path) == ["rotate", "revoke"]


def test_options_are_offered(tmp_path: Path) -> None:
    assert offered("solve two-dof --fr", tmp_path) == ["--frequency"]
    assert "--key-file" in offered("submit design --k", tmp_path)


def test_scenes_are_offered_and_scene_files(tmp_path: Path) -> None:
    (tmp_path / "disks").mkdir()
    (tmp_path / "twin.toml").touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "disks" / "first.json").touch()
    assert offered("solve tw", tmp_path) == ["two-dof", "twin.toml"]
    assert offered("solve ", tmp_path) == [*solver.shipped_scenes(), "disks/", "twin.toml"]
    assert offered("solve disks/", tmp_path) == ["disks/first.json"]
    assert offered("submit sweep bl", tmp_path) == ["bladed-disk"]


def test_parameter_paths_of_the_scene_are_offered(tmp_path: Path) -> None:
    scene = solver.load_scene("bladed-disk")
    known = parameter_paths(scene)
    wanted = [path for path in known if path.startswith("sh")]
    assert wanted
    assert offered("sweep bladed-disk --parameter sh", tmp_path) == wanted
    assert offered("sweep bladed-disk --parameter freq", tmp_path) == ["frequency"]
    assert offered("solve bladed-disk --set sh", tmp_path) == [f"{path}=" for path in wanted]
    assert offered("design bladed-disk --variable sh", tmp_path) == wanted
    assert offered("design bladed-disk --never-separates ", tmp_path) == [
        contact.name for contact in scene.contacts
    ]


def test_a_scene_that_cannot_be_read_offers_nothing(tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text("name = ", "utf-8")
    assert offered("sweep broken.toml --parameter s", tmp_path) == []
    assert offered("solve nothing --set ", tmp_path) == []


def test_the_words_offered_are_those_accepted(tmp_path: Path) -> None:
    assert offered("design two-dof --method ", tmp_path) == [method.value for method in Method]
    assert offered("solve two-dof --effects ", tmp_path) == list(WORDS)
    assert solver.Effects.read(",".join(WORDS[2:])) == solver.Effects.everything()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_script(shell: str, tmp_path: Path) -> None:
    script = run("", f"source_{shell}", tmp_path)
    assert "_STICKSLIP_COMPLETE" in script
    if shutil.which(shell):
        assert subprocess.run([shell, "-n"], input=script, text=True, check=False).returncode == 0


def test_help_says_how_to_install(tmp_path: Path) -> None:
    done = subprocess.run([*COMMAND, "--help"], capture_output=True, text=True, check=True, cwd=tmp_path,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})  # fmt: skip
    assert "--install-completion" in done.stdout
    assert "--show-completion" in done.stdout
