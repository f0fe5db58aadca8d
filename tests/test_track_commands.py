"""`stickslip peaks` and `stickslip map`: JSON keys, words, pictures, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from service.cli import main

PEAKS = ["peaks", "two-dof", "--parameter", "damper.N0", "--from", "80", "--to", "130", "--checks", "0"]
MAP = [
    "map",
    "two-dof",
    "--parameter",
    "damper.N0",
    "--from",
    "80",
    "--to",
    "130",
    "--steps",
    "3",
    "--frequencies",
    "12",
]


@pytest.mark.parametrize(
    ("arguments", "keys"),
    [
        (PEAKS, {"parameter", "peak", "frequency", "seconds", "optimum", "status"}),
        (MAP, {"parameter", "frequency", "amplitude", "ridge", "seconds", "status"}),
    ],
)
def test_json_is_one_object(arguments: list[str], keys: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert keys <= set(found)
    track = found if "optimum" in found else found["ridge"]
    assert track["optimum"]["at"] == pytest.approx(104.788, abs=1e-3)
    assert len(track["parameter"]) == len(track["peak"]) == len(track["frequency"])


@pytest.mark.parametrize("arguments", [PEAKS, MAP])
def test_words_name_the_least_peak(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "least peak" in out
    assert "104.788 N" in out


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
@pytest.mark.parametrize("arguments", [PEAKS, MAP])
def test_pictures_are_written(
    arguments: list[str], suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / f"picture{suffix}"
    assert main([*arguments, "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 4000
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("peaks two-dof --parameter damper.N7 --from 1 --to 2", "damper.N7"),
        ("peaks two-dof --parameter damper.N0 --from 5 --to 5", "differ"),
        ("peaks two-dof --parameter frequency --from 1 --to 2", "frequency"),
        ("map two-dof --parameter damper.N0 --from 1 --to 2 --steps 1", "steps"),
        ("map two-dof --parameter damper.N0 --from 1 --to x", "x"),
    ],
)
def test_bad_input_ends_with_two(arguments: str, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments.split()) == 2
    assert word in capsys.readouterr().err
