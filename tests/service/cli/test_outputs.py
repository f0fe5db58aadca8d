"""``--plot`` and ``--out`` of every command that computes, and the pictures of stored results."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from each import each

import optim
import solver
from service.cli import main
from service.jobs.drawing import result_figure
from service.jobs.kind_registry import NothingToDrawError
from service.jobs.kinds import SHIPPED

COMMANDS = {
    "solve": "two-dof --frequency 1.2 --harmonics 3",
    "sweep": "two-dof --from 0.8 --to 1.4 --harmonics 3",
    "march": "two-dof --frequency 1.2",
    "wear": (
        "two-dof --hours 0.0001 --coefficient damper=1e-11 --area damper=0.0002 --load-loss damper=4e6"
        " --harmonics 3"
    ),
    "quasi-periodic": "two-dof --frequency 1.05 --second 1.3821 --amplitude 60 --harmonics 3 --turns 24",
    "transient": "two-dof --from 0.9 --to 1.2 --rate 0.02",
    "peaks": "two-dof --parameter damper.N0 --from 50 --to 200 --harmonics 3",
    "map": "two-dof --parameter damper.N0 --from 50 --to 200 --steps 3 --frequencies 5 --harmonics 3",
    "mistuning": "bladed-disk --of tip --samples 2 --harmonics 1 --from 740 --to 780",
    "worst-mistuning": "bladed-disk --of tip --starts 2 --contacts stuck --patterns AB",
    "modes": "two-dof --from 0.1 --to 3 --harmonics 3",
    "interference": "bladed-disk --speed 11000 --up-to 1400",
    "controlled": "two-dof --amplitude 1 --harmonics 3",
    "margin": "two-dof --from 20 --to 120 --points 3 --limit 2 --harmonics 3",
    "campbell": "two-dof --speeds 50 80 --harmonics 3",
    "sensitivities": "two-dof --harmonics 3",
    "design": "two-dof --variable damper.N0 20 500 --harmonics 3",
    "pareto": "two-dof --variable damper.N0 20 500 --limit 2 --points 3 --harmonics 3",
}


_QUICK = ("solve", "sweep", "march", "interference", "design")


@pytest.mark.parametrize(
    "command", [pytest.param(c, marks=() if c in _QUICK else pytest.mark.long) for c in COMMANDS]
)
def test_every_command_draws_and_writes(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture, file = tmp_path / "picture.html", tmp_path / "numbers.json"
    words = [command, *COMMANDS[command].split(), "--json", "--plot", str(picture), "--out", str(file)]
    assert main(words) == 0
    assert capsys.readouterr().out.startswith("{")
    page, data = picture.read_text("utf-8"), solver.load(file)
    assert page.startswith("<!DOCTYPE html>")
    assert "data:image/svg+xml;base64," in page
    assert not re.search(r"""(src|href)=["']?(https?:|//)""", page)
    assert "<script" not in page
    name = COMMANDS[command].split()[0]
    assert f'name = "{name}"' in data.attributes["scene"]  # type: ignore[operator]
    assert data.attributes["source"] in page  # type: ignore[operator]
    assert "<pre>" in page


@pytest.mark.long
def test_posteriors_of_files_are_drawn_written_and_handed_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mass without contacts: its posterior, three assemblies, and a choice between two models."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> tuple[int, str, str]:
        status = main([*asked, *words])
        return status, *capsys.readouterr()

    scene = {
        "name": "rig",
        "structure": {
            "kind": "lumped", "masses": {"m": 1.0},
            "springs": [{"between": ["m", "ground"], "k": 41.0, "c": 0.5, "name": "spring"}],
        },
        "excitation": {"dof": "m", "amplitude": 2.0}, "observe": {"dof": "m", "band": [0.8, 1.3]},
    }  # fmt: skip
    (tmp_path / "rig.json").write_text(json.dumps(scene))
    (tmp_path / "a.csv").write_text("frequency,amplitude,sd\n0.9,0.22,0.02\n1.0,0.56,0.02\n1.1,0.27,0.02\n")
    asked = ["posterior", "rig.json", "a.csv", "--unknown", "excitation.amplitude", "1", "3"]
    asked += ["--starts", "1", "--harmonics", "1"]
    asked += ["--draws", "160", "--sampler", "importance"]
    status, out, err = run(*["--uncertain", "u.toml", "--plot", "p.png", "--out", "p.json", "--json"])
    assert (status, err) == (0, "")
    (amplitude,) = json.loads(out)["marginals"]
    assert amplitude["interval"][0] < amplitude["mean"] < amplitude["interval"][1]
    assert (tmp_path / "u.toml").read_text().count("[[uncertain]]") == 32
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert solver.load(tmp_path / "p.json")["samples"].shape == (160, 1)
    models = json.dumps({"softer": {"scene": "rig.json", "unknowns": {"structure.spring": [38, 43]}}})
    status, out, err = run("--models", models, "--plot", "m.png")
    assert (status, err) == (0, "")
    assert "softer" in out
    asked[2:3] = ["a.csv"] * 3
    status, out, err = run("--varied", "excitation.amplitude")
    assert (status, err) == (0, "")
    assert "3 assemblies" in out
    status, _, err = run("--weights", "rig=2")
    assert status == 2
    assert "`--weights`" in err


@pytest.mark.parametrize(
    ("option", "file"), [("--plot", "p.jpg"), ("--out", "p.xlsx"), ("--out", "no/p.csv")]
)
def test_a_file_that_cannot_be_written_is_refused_first(
    option: str, file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", "two-dof", option, str(tmp_path / file)]) == 2
    assert f"`{option}`" in capsys.readouterr().err


def results() -> dict[str, Any]:
    scene = solver.load_scene("two-dof")
    return {
        "solve": solver.solve(scene, frequency_hz=1.2, harmonics=3),
        "march": solver.march(scene, frequency_hz=1.2),
        "wear": solver.wear_life(
            scene, solver.Mission(1e-4), solver.WearLaw(1e-11, 2e-4, 4e6), limit=2.4, harmonics=3, points=5
        ),
        "quasi-periodic": solver.quasi_periodic(
            scene, frequency_hz=1.05, second_hz=1.3821, amplitude=60, harmonics=3, turns=24
        ),
        "transient": solver.transient(scene, begin_hz=0.9, end_hz=1.2, rate_hz_per_s=0.02),
        "map": solver.response_map(scene, "damper.N0", 50, 200, steps=3, frequencies=5, harmonics=3),
        "peaks": solver.track_peak(scene, "damper.N0", 50, 200, harmonics=3),
        "mistuning": solver.mistuning_study(
            solver.load_scene("bladed-disk"), of=["tip"], samples=2, harmonics=1, start=740, stop=780
        ),
        "worst-mistuning": solver.worst_mistuning(
            solver.load_scene("bladed-disk"),
            of=["tip"],
            contacts="stuck",
            search=solver.WorstSearch(starts=2),
            intentional=solver.IntentionalMistuning(["AB"]),
        ),
        "interference": solver.interference_diagram(solver.load_scene("bladed-disk"), speed_rpm=11e3),
        "margin": solver.margin_diagram(scene, start=20, stop=120, points=3, limit=2.0, harmonics=3),
        "modes": solver.nonlinear_mode(scene, amplitudes=(0.1, 3.0), harmonics=3),
        "pareto": optim.pareto_front(
            scene, variables={"damper.N0": (20, 500)}, limit=2.0, points=3, harmonics=3
        ),
    }


@pytest.mark.long
def test_a_stored_result_is_drawn_as_the_computed_one() -> None:
    for kind, computed in results().items():
        page = result_figure(
            kind, computed.to_json(), [], lambda _: pytest.fail("no sweep is needed"), SHIPPED
        )
        axes, wanted = page.axes[0], computed.plot().axes[0]
        if kind in ("solve", "march"):
            assert axes.get_xlabel() == "harmonic (0: mean)"
            continue
        assert axes.get_xlabel() == wanted.get_xlabel()
        assert [len(line.get_xdata()) for line in axes.lines] == [
            len(line.get_xdata()) for line in wanted.lines
        ]


@each(
    "kind",
    ["sweep", "design", "campbell", "accuracy", "pareto", "solve", "mistuning", "modes", "interference"],
)
def test_nothing_to_draw_is_said(kind: str) -> None:
    empty = {"peak": None, "orders": [], "rows": [], "points": [], "harmonics": None, "worst": None}
    empty |= {"amplitude": [], "diameters": []}
    with pytest.raises(NothingToDrawError):
        result_figure(kind, empty, [], lambda _: pytest.fail("no sweep is read"), SHIPPED)
