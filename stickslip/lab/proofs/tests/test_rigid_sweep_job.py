"""A sweep over rigid contacts as a job and as a command."""

import json
import math
from pathlib import Path

import pytest

from service.cli import main
from service.jobs.outputs import Silent
from service.jobs.studies.sweep_study import Sweep, sweep_result
from solver.scene.scene import Scene
from solver.scene.toml import toml_text

SCENE = {
    "name": "den-hartog",
    "structure": {
        "kind": "lumped", "masses": {"x": 1.0},
        "springs": [{"between": ["x", "ground"], "k": 1.0, "c": 0.05}],
    },
    "contacts": [{"name": "f", "between": ["x", "ground"], "kt": "inf", "mu": 1.0, "N0": 0.4}],
    "excitation": {"dof": "x", "amplitude": 1.0}, "observe": {"dof": "x", "band": [0.12, 0.2]},
}  # fmt: skip


def test_a_job_gives_the_result_and_the_stored_sweep() -> None:
    spec = {
        "scene": SCENE, "parameter": "frequency", "start": 0.12, "stop": 0.2, "frequency_hz": None,
        "harmonics": 5, "limit": None, "stability": True,
    }  # fmt: skip
    output = Sweep.run(spec, Silent(), lambda: False)
    told = json.loads(json.dumps(output.result, allow_nan=False))
    sweep_result().model_validate(told)
    assert output.shortfall is None
    record = output.sweeps[0]
    assert record.points == told["points"] == len(told["parameter"])
    assert record.peak == told["peak"]["value"]
    assert not record.peaks_known
    assert {"coefficients", "observed", "states", "residual"} <= record.arrays.keys()


@pytest.mark.long
def test_the_command_prints_draws_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(toml_text(Scene.from_dict(SCENE).to_dict()))
    picture, table = tmp_path / "response.svg", tmp_path / "response.csv"
    main(["sweep", str(scene), "--plot", str(picture), "--out", str(table)])
    words = capsys.readouterr().out
    assert "den-hartog, frequency from 0.12 Hz to 0.2 Hz" in words
    assert "die out" in words
    assert picture.stat().st_size > 1000
    assert table.read_text().count("\n") > 20
    main(["sweep", str(scene), "--stability", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told["completed"]
    assert told["stability_known_by"] == "multipliers"
    assert math.isfinite(told["peak"]["value"])
