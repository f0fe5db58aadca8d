"""The page on a blade from a mesh to its damper: every line of it, in order, and the numbers it quotes."""

import importlib.util
import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import optim
import solver
from service.cli import main

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE, OF_A_FACE, OF_A_LIFE = re.split(
    r"\n## (?:A whole face|From the amplitude to a life)\n",
    (ROOT / "docs" / "fe-example.md").read_text(encoding="utf-8"),
)


def commands(page: str) -> list[str]:
    blocks = re.findall(r"^```sh\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


COMMANDS = commands(PAGE)


def with_the_contact(text: str, page: str = PAGE) -> str:
    """The scene with what the page puts into it."""
    (contact,) = re.findall(r"^```toml\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)
    text, templates = re.subn(r"# A contact joins.*\n(#.*\n)+", contact, text)
    assert templates == 1
    assert text.count("\ndamping_ratio = 0.001\n") == 1
    return text


def run(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    words = shlex.split(line)
    if words[0] == "python":
        done = subprocess.run([sys.executable, *words[1:]], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout
    assert words[0] == "stickslip"
    assert main(words[1:]) == 0
    return capsys.readouterr().out


@pytest.fixture
def beside_docs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a new folder beside the documentation, as the page does."""
    if importlib.util.find_spec("skfem") is None:
        pytest.skip("scikit-fem, which makes the matrices of the page, is not installed")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")


@pytest.mark.long
@pytest.mark.usefixtures("beside_docs")
def test_the_page_runs_line_by_line(capsys: pytest.CaptureFixture[str]) -> None:
    said = {}
    for line in COMMANDS:
        said[line] = " ".join(run(line, capsys).split())
        if " import " in line:
            scene = Path("blade.toml")
            scene.write_text(with_the_contact(scene.read_text()))
    made, imported, _, free, loaded, best, _, response = (said[line] for line in COMMANDS)
    assert "1830 rows" in made
    assert "tip node 638" in made
    assert "platform node 373" in made
    assert "258.4 Hz, 1137 Hz" in imported
    assert "0.1517 kg" in imported
    assert "31 modes" in imported
    assert "good to 16" in imported
    assert "peak 10.3" in free
    assert re.search(r"± 0\.12 mm", loaded)
    assert re.search(r"damper\.N0 83\.8\d* N peak 0\.178", best)
    assert "peak 0.178" in response
    assert all(Path(f"blade-{name}.png").stat().st_size > 10_000 for name in ("peak", "response"))
    the_reduction_is_good_to_what_it_says()


@pytest.mark.long
@pytest.mark.usefixtures("beside_docs")
def test_the_day_with_a_face_runs_line_by_line(capsys: pytest.CaptureFixture[str]) -> None:
    made, imported, free, loaded, designed, _, checked = (
        " ".join(run(line, capsys).split()) for line in commands(OF_A_FACE)
    )
    assert "1638 rows, 581 nodes, 21 of them on the face" in made
    assert "to 19 motions" in imported
    assert re.search(r"error 4\.\de-5 of the peak", imported)
    assert "peak 4.19" in free
    assert "peak 3.67" in loaded
    assert re.search(r"plat\.N0 [\d.]+ N peak [\d.]+ ", designed)
    apart = [float(text) for text in re.findall(r"([\d.e-]+) of it apart", checked)]
    assert len(apart) == 3
    assert max(apart) <= 2e-3
    assert Path("face-response.png").stat().st_size > 10_000


def the_reduction_is_good_to_what_it_says() -> None:
    """A force on the tip or the platform moves both as it does in the model of all rows.

    The response knows the structure by nothing else; 21 harmonics of 282 Hz stay below 16 kHz.
    """
    M, K = (sparse.load_npz(f"blade-{name}.npz").tocsc() for name in "MK")
    labels = Path("blade.dof").read_text().split()
    ends = [labels.index(label) for label in ("638.2", "373.2")]
    with np.load("blade-reduced.npz") as reduced:
        small = {name: reduced[name] for name in ("M", "K")}
    for harmonic, within in ((0, 1e-6), (1, 1e-5), (5, 1e-4), (21, 1e-2)):
        minus = -((2.0 * np.pi * 282.0 * harmonic) ** 2)
        forces = np.zeros((M.shape[0], 2))
        forces[ends, [0, 1]] = 1.0
        moved = splu(sparse.csc_array(K + minus * M)).solve(forces)[ends]
        kept = np.linalg.solve(small["K"] + minus * small["M"], np.eye(len(small["K"]))[:, :2])[:2]
        np.testing.assert_allclose(kept, moved, atol=within * np.abs(moved).max())


@pytest.mark.long
@pytest.mark.usefixtures("beside_docs")
def test_all_rows_of_the_model_say_what_the_reduced_ones_say(capsys: pytest.CaptureFixture[str]) -> None:
    """And the kept scene is the one just made."""
    for line in COMMANDS[:2]:
        run(line, capsys)
    made = Path("blade.toml")
    made.write_text(with_the_contact(made.read_text()))
    text = made.read_text().replace('M = "blade-reduced.npz"', 'M = "blade-M.npz"')
    text = text.replace('K = "blade-reduced.npz"', 'K = "blade-K.npz"\nmapping = "blade.dof"')
    text = text.replace('"tip" = 0', '"tip" = "638.UY"').replace('"platform" = 1', '"platform" = "373.UY"')
    Path("full.toml").write_text(text)
    scenes = [solver.load_scene(name) for name in ("full.toml", "blade.toml", ROOT / "docs/fe/blade.toml")]
    found = [
        solver.solve(scene.with_values({"damper.N0": 84.0}), frequency_hz=282.0, harmonics=21).max_abs
        for scene in scenes
    ]
    assert found[1] == pytest.approx(found[0], rel=3e-4)
    assert found[2] == pytest.approx(found[1], rel=1e-6)


def test_the_kept_scene_has_the_optimum_of_the_page() -> None:
    """Without scikit-fem too."""
    scene = solver.load_scene(ROOT / "docs" / "fe" / "blade.toml")
    assert tomllib.loads((ROOT / "docs/fe/blade.toml").read_text())["structure"]["damping_ratio"] == 0.001
    best = optim.design(scene, variables={"damper.N0": (1.0, 1000.0)}, harmonics=21)
    assert json.loads(json.dumps(best.optimum))["damper.N0"] == pytest.approx(83.85, abs=0.1)
    assert best.peak.value == pytest.approx(0.1783e-3, rel=1e-3)
