"""The page for users of other codes: the example in ours gives what the page says, and theirs is complete."""

import os
import re
import subprocess
import textwrap
from pathlib import Path

import pytest

import solver

PAGE = (Path(__file__).resolve().parent.parent.parent / "docs" / "coming-from.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return PAGE.partition(f"## {title}\n")[2].partition("\n## ")[0]


def script(title: str) -> str:
    """The indented lines of a section."""
    lines = [line for line in section(title).splitlines() if line.startswith("    ") or not line]
    return textwrap.dedent("\n".join(lines)).strip()


def ours() -> dict[str, object]:
    """The names that our example leaves behind."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", section("Here"), flags=re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, "coming-from.md", "exec"), names)
    return names


def test_our_numbers_are_those_of_time_marching(capsys: pytest.CaptureFixture[str]) -> None:
    names = ours()
    peak, at, error = (float(word) for word in capsys.readouterr().out.split("{")[0].split())
    assert (peak, at) == (pytest.approx(10.2358, abs=5e-5), pytest.approx(1.01433, abs=5e-6))
    assert error == pytest.approx(1e-4, rel=0.1)
    scene = names["scene"]
    assert isinstance(scene, solver.Scene)
    assert solver.march(scene, frequency_hz=1.01436).max_abs == pytest.approx(10.2358, abs=1e-4)
    opening = solver.sweep(scene.with_values({"slider.N1": 150.0}))
    assert opening.peak is not None
    assert opening.peak.value == pytest.approx(10.328, abs=5e-4)


def test_the_phase_of_the_page_is_a_sine() -> None:
    """`phase` −π/2 is a sine: sine parts in place of cosine parts, and a negative cosine for a sine."""
    scene = ours()["scene"]
    assert isinstance(scene, solver.Scene)
    small = scene.with_values({"excitation.amplitude": 1.0})
    cosine = solver.solve(small, frequency_hz=0.5, harmonics=1).observed
    sine = solver.solve(small.with_values({"excitation.phase": -0.5 * 3.141592653589793}), frequency_hz=0.5,
                        harmonics=1).observed  # fmt: skip
    assert sine[1] == pytest.approx(-cosine[2], rel=1e-9)
    assert sine[2] == pytest.approx(cosine[1], rel=1e-9)


@pytest.mark.parametrize("title", ["By pyHarm", "By tmdsimpy"])
def test_their_lines_are_python(title: str) -> None:
    compile(script(title), title, "exec")


@pytest.mark.long
def test_pyharm_finds_what_the_page_says(tmp_path: Path) -> None:
    """With an interpreter that has pyHarm, as for the benchmarks; it leaves a folder where it runs."""
    interpreter = os.environ.get("PYHARM_PYTHON")
    if interpreter is None:
        pytest.skip("PYHARM_PYTHON does not name an interpreter with pyHarm")
    done = subprocess.run(
        [interpreter, "-c", script("By pyHarm")], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    points, peak, at = done.stdout.splitlines()[-1].split()
    assert int(points) == 224
    assert float(peak) == pytest.approx(10.23605, abs=5e-6)
    assert float(at) == pytest.approx(1.01443, abs=5e-6)
