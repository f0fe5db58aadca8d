"""The page on a disk from a mesh to its damper: every line of it, in order, and the numbers it quotes."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import solver
from service.cli import main

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = (ROOT / "docs" / "fe-disk.md").read_text(encoding="utf-8")
COMMANDS = [
    line
    for block in re.findall(r"^```sh\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    for line in block.splitlines()
]


def with_the_contacts(text: str) -> str:
    """The scene with what the third step puts into it."""
    (contacts,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    changes = {
        r"# A contact joins.*\n(#.*\n)+": contacts,
        r"damping_ratio = .*": "damping_ratio = 0.0005",
        r"amplitude = 1\.0.*\nengine_order = 1": "amplitude = 20.0\nengine_order = 4",
        r"band = .*": "band = [150.0, 450.0]",
    }
    for old, new in changes.items():
        text, count = re.subn(old, new, text)
        assert count == 1, old
    return text


def run(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    words = shlex.split(line)
    if words[0] == "stickslip":
        assert main(words[1:]) == 0
        return capsys.readouterr().out
    words = [sys.executable, *words[1:]] if words[0] == "python" else words
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")
def test_the_page_runs_line_by_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    said = []
    for line in COMMANDS:
        said.append(" ".join(run(line, capsys).split()))
        if " import " in line:
            scene = Path("disk.toml")
            scene.write_text(with_the_contacts(scene.read_text()))
    made, _, imported, plan, free, loaded, _, best, _, _, check = said
    assert "48 bricks, 405 nodes, 1080 rows" in made
    assert "diameter 0 172, 521.2" in imported
    assert "good to 3606 Hz" in imported
    assert "engine order 4 meet 4, 12 of 0 to 12" in plan
    assert re.search(r"peak 0\.207\d* .*m at 172\.1 Hz", free)
    assert "peak 0.211" in loaded
    assert re.search(r"shroud\.N0 44\.4\d* N peak 0\.208", best)
    apart = re.search(r"differ by (\S+), .* by (\S+)$", check)
    assert apart is not None
    assert float(apart[1]) < 1e-6
    assert float(apart[2]) < 1e-3
    the_shipped_scene_is_the_one_just_made()


def the_shipped_scene_is_the_one_just_made() -> None:
    made, shipped = solver.load_scene("disk.toml"), solver.load_scene("fe-disk")
    assert made.contacts == shipped.contacts
    assert made.nodes == shipped.nodes
    found = [solver.solve(scene, frequency_hz=255.0, harmonics=3).max_abs for scene in (made, shipped)]
    np.testing.assert_allclose(found, found[0], rtol=1e-7)


def test_the_programs_of_the_page_are_there() -> None:
    """Each line names a command or a file that exists; the test that runs them all takes minutes."""
    for line in COMMANDS:
        words = shlex.split(line)
        assert words[0] in ("python", "ccx", "stickslip")
        assert words[0] != "python" or (ROOT / words[1]).is_file()
