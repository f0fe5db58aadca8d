"""The README: every snippet runs as it stands."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

import solver
from service.cli import main

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
ADDRESS = "http://127.0.0.1:8000"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
LINES = [line for language, text in BLOCKS if language == "sh" for line in text.splitlines()]


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def test_every_language_is_looked_at() -> None:
    assert {language for language, _ in BLOCKS} == {"sh", "python", "toml"}


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("make ")])
def test_make_knows_the_targets(line: str) -> None:
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    done = subprocess.run([*shlex.split(line), "--dry-run"], cwd=ROOT, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("line", [line for line in LINES if not line.startswith("make ")])
def test_commands_run(
    line: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = shlex.split(line)
    assert words[0] == "stickslip"
    monkeypatch.chdir(tmp_path)
    if words[1] == "serve":
        # What runs until it is told to stop: the fixture `server` runs it; here its options are read.
        words.append("--help")
    if words[1] == "submit":
        monkeypatch.setenv("STICKSLIP_URL", request.getfixturevalue("server"))
    assert main(words[1:]) == 0
    written = [word for word, before in zip(words[1:], words, strict=False) if before == "--plot"]
    assert [file.name for file in tmp_path.iterdir()] == written


@pytest.mark.parametrize("code", blocks("python"))
def test_python_runs(code: str, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]) -> None:
    if ADDRESS in code:
        code = code.replace(ADDRESS, request.getfixturevalue("server"))
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})
    assert len(capsys.readouterr().out.splitlines()) >= 2


@pytest.mark.parametrize("text", blocks("toml"))
def test_scenes_work(text: str) -> None:
    scene = solver.Scene.from_dict(tomllib.loads(text))
    branch = solver.sweep(scene)
    assert branch.completed
    assert branch.peak is not None
    assert branch.peak.interior


def test_links_and_pictures_exist() -> None:
    targets = re.findall(r"\]\(([^)]+)\)", README)
    assert [t for t in targets if not t.startswith("http") and not (ROOT / t).is_file()] == []


def test_the_peaks_the_readme_quotes() -> None:
    scene = solver.load_scene("bladed-disk")

    def peak(**values: float) -> float:
        branch = solver.sweep(scene.with_values({f"{name}.N0": load for name, load in values.items()}))
        assert branch.peak is not None
        return 1e3 * branch.peak.value

    assert peak(shroud=185.0) == pytest.approx(0.100, abs=5e-4)
    assert peak(shroud=0.0, root=1e9) == pytest.approx(14.0, abs=0.5)
    assert peak(shroud=1e9, root=1e9) == pytest.approx(0.66, abs=5e-3)
