"""`stickslip peaks` and `stickslip map`: words, pictures, bad input; their JSON is in tests/golden."""

import json
from pathlib import Path

import numpy as np
import pytest

import solver
from service.cli import main
from solver.views.plots.tracks import ridge_lines

RANGE = "two-dof --parameter damper.N0 --from 80 --to 130"
PEAKS = f"peaks {RANGE} --checks 0"
MAP = f"map {RANGE} --steps 3 --frequencies 12"


@pytest.mark.parametrize("arguments", [PEAKS, MAP])
def test_words_name_the_least_peak_and_a_picture_is_written(
    arguments: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "picture.png"
    assert main([*arguments.split(), "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 4000
    out, err = capsys.readouterr()
    assert "least peak" in out
    assert "104.8 N" in out
    assert err == ""


def test_the_ridge_is_broken_only_where_another_peak_becomes_the_highest() -> None:
    """Between 85 and 120 N the peak of the disk moves by 100 Hz, which is no jump; at 185 N there is one."""
    track = solver.track_peak(solver.load_scene("bladed-disk"), "shroud.N0", 60.0, 300.0, checks=0)
    parameter, frequency = ridge_lines(track.to_json())
    assert np.array_equal(parameter[~np.isnan(parameter)], track.parameter)
    assert np.array_equal(frequency[~np.isnan(frequency)], track.frequency)
    breaks = np.flatnonzero(np.isnan(parameter))
    assert np.isnan(frequency[breaks]).all()
    exchanges = [at for at, _ in track.exchanges]
    assert pytest.approx(exchanges[-1], abs=0.01) == 185.46
    assert parameter[breaks - 1] == pytest.approx(exchanges)
    assert parameter[breaks + 1] == pytest.approx(exchanges)


def test_contacts_without_second_derivatives_are_mapped_but_not_tracked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (Path(solver.__file__).parent / "scene" / "shipped" / "two-dof.toml").read_text()
    ring = (
        '[[contacts]]\nname = "ring"\nlaw = "dahl"\nbetween = ["m1", "ground"]\n'
        "sigma = 10.0\nlimit = 15.0\n\n"
    )
    scene = tmp_path / "ring.toml"
    scene.write_text(text.replace("[excitation]", f"{ring}[excitation]"))
    asked = [str(scene), *RANGE.split()[1:]]
    grid = ["--steps", "2", "--frequencies", "3"]
    for arguments in (["peaks", *asked], ["map", *asked, *grid]):
        assert main(arguments) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert "`scene`" in err
        assert "ring (dahl)" in err
    assert main(["map", *asked, *grid, "--no-ridge", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ridge"] is None
    assert None not in found["amplitude"][0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("margin two-dof --points 2 --harmonics 3", "excitation"),
        ("peaks two-dof --checks 0 --harmonics 3", "least peak"),
        ("controlled two-dof --harmonics 3", "least force"),
    ],
)
def test_what_is_left_out_is_what_the_scene_suggests(
    arguments: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments.split()) == 0
    out, err = capsys.readouterr()
    assert said in out
    assert err == ""


def test_a_study_that_a_scene_has_nothing_for_says_why(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mistuning", "two-dof"]) == 2
    assert "is not for `mistuning`: the scene is one blade" in capsys.readouterr().err
