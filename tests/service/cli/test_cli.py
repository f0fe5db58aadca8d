"""The command: what it prints, its exit statuses, bad input, and what it does not load."""

import json
import os
import pty
import re
import subprocess
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from each import each
from launch import COMMAND

import optim
import solver
from service.cli import main

Run = Callable[..., tuple[int, str, str]]
GOOD = Path(solver.__file__).parent / "scene" / "shipped" / "two-dof.toml"


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run the command in an empty folder: exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def command(arguments: str, *more: str) -> tuple[int, str, str]:
        status = main([*arguments.split(), *more])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return command


@pytest.mark.parametrize("arguments", ["scenes", "solve two-dof --frequency 1.2"])
def test_json_is_one_object_in_one_line(run: Run, arguments: str) -> None:
    """Its keys are those of tests/golden."""
    status, out, err = run(f"{arguments} --json")
    assert (status, err) == (0, "")
    assert out.endswith("}\n")
    assert out.count("\n") == 1
    assert json.loads(out)


def test_solve_is_the_solver(run: Run) -> None:
    arguments = "solve two-dof --frequency 1.1 --set damper.N0=60 --set damper.N1=5 --harmonics 7 --json"
    answer = json.loads(run(arguments)[1])
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 60.0, "damper.N1": 5.0})
    direct = solver.solve(scene, frequency_hz=1.1, harmonics=7)
    assert answer["max_abs"] == direct.max_abs
    assert answer["n_harmonics"] == 7


def test_sweep_of_a_load_is_the_solver(run: Run) -> None:
    arguments = "sweep two-dof --parameter damper.N0 --from 50 --to 60 --frequency 1.1 --harmonics 5 --json"
    answer = json.loads(run(arguments)[1])
    direct = solver.sweep(
        solver.load_scene("two-dof"), "damper.N0", 50.0, 60.0, frequency_hz=1.1, harmonics=5
    )
    assert answer["amplitude"] == direct.amplitude.tolist()
    assert answer["band_hz"] is None


def test_design_takes_several_variables(run: Run) -> None:
    variables = "--variable damper.N0 90 120 --variable damper.kt 25 30"
    status, out, _ = run(f"design two-dof {variables} --harmonics 3 --limit 2 --json")
    answer = json.loads(out)
    assert status == (0 if answer["reached"] else 1)
    assert answer["optimum"].keys() == {"damper.N0", "damper.kt"}
    assert 90.0 <= answer["optimum"]["damper.N0"] <= 120.0


@each(
    ("arguments", "words"),
    [
        ("scenes", ["bladed-disk", "cyclic", "500 to 900 Hz"]),
        ("plan bladed-disk", ["one sector for the annulus", "unknowns", "46"]),
        ("solve bladed-disk --frequency 755", ["max|x|", "0.1016 ± ", " mm", "stick and slip"]),
        ("sweep two-dof --limit 2", ["peak", "2.35 m ± 73 µm at 1.037 Hz", "Hz above 2 m"]),
        (
            "design two-dof --variable damper.N0 80 130",
            ["damper.N0", " N", "2.346 m ± ", "responses in"],
        ),
        ("march two-dof --frequency 1.2", ["1.85 m", "periods"]),
        ("--version", [version("stickslip")]),
        ("--help", ["design", "sweep", "submit", "db"]),
        ("design --help", ["PATH LO HI", "--max-band", "--problem", "--never-separates"]),
    ],
)
def test_people_read_values_with_units(run: Run, arguments: str, words: list[str]) -> None:
    status, out, err = run(arguments)
    assert (status, err) == (0, "")
    assert [word for word in words if word not in out] == []


def test_a_design_of_several_cases_names_the_one_that_holds_it(run: Run, tmp_path: Path) -> None:
    (tmp_path / "problem.toml").write_text(
        "harmonics = 3\n[variables]\n'damper.N0' = [80, 130]\n[[cases]]\nname = 'cruise'\n"
        "[[cases]]\nname = 'take-off'\n[cases.set]\n'excitation.amplitude' = 150.0\n"
    )
    out = run("design", "two-dof", "--problem", "problem.toml")[1]
    held = next(line for line in out.splitlines() if line.startswith("held by"))
    assert re.search(r"peak at [\d.]+ Hz of take-off", held) or held.endswith("(of take-off)"), held


BAD_SCENES = {
    "unknown key": ('name = "two-dof"', 'name = "two-dof"\ncolour = "red"', ["colour", "red"]),
    "negative mass": ("m1 = 1.0", "m1 = -1.0", ["m1", "-1.0"]),
    "negative friction": ("mu = 0.3", "mu = -0.3", ["mu", "-0.3"]),
    "unknown DOF": ('between = ["m2", "ground"]', 'between = ["m7", "ground"]', ["between", "m7"]),
    "zero sectors": ('kind = "lumped"', 'kind = "cyclic"\nsectors = 0', ["sectors", "0"]),
    "not a number": ("N0 = 100.0", "N0 = nan", ["N0", "nan"]),
    "empty band": ("band = [0.2, 2.6]", "band = [2.6, 0.2]", ["band", "[2.6, 0.2]"]),
    "not TOML": ("[structure]", "[structure", ["scene.toml", "TOML", "line"]),
    "a decimal comma": ("mu = 0.3", "mu = 0,3", ["scene.toml", "0,3: a decimal point, as in 0.3"]),
}


@each("case", BAD_SCENES)
@each("command", ["solve scene.toml --frequency 1", "design scene.toml --json"])
def test_bad_scenes_are_named(run: Run, tmp_path: Path, command: str, case: str) -> None:
    right, wrong, words = BAD_SCENES[case]
    text = GOOD.read_text()
    assert right in text
    (tmp_path / "scene.toml").write_text(text.replace(right, wrong))
    status, out, err = run(f"{command} --plot picture.png")
    assert (status, out) == (2, "")
    assert "Traceback" not in err
    assert [word for word in words if word not in err] == []
    assert [file.name for file in tmp_path.iterdir()] == ["scene.toml"]


@each("arguments, words", [("", ["Usage"]), ("serve --host 192.0.2.1", ["192.0.2.1", "--port"])])
def test_bad_options_are_named(run: Run, arguments: str, words: list[str]) -> None:
    """The others, with what is said of them, stand in tests/golden/data/commands.txt."""
    status, out, err = run(arguments)
    assert status == 2
    assert [word for word in words if word not in out + err] == []


FILES = {
    "not TOML": ("limit = [", ["problem.toml", "TOML"]),
    "a decimal comma": ("\ufefftolerance = 0,05", ["problem.toml", "0,05: a decimal point, as in 0.05"]),
    "not JSON": ('{"limit": NaN}', ["problem.json", "/limit", "finite"]),
    "no table": ("[1, 2]", ["problem.json", "one table"]),
    "another kind": ('kind = "sweep"', ["/kind", "design", "sweep"]),
    "unknown key": ('colour = "red"', ["problem.toml", "/colour", "is not a known key"]),
    "infinite": ("limit = inf", ["/limit", "finite", "inf"]),
    "several": ("[[cases]]\nband = [5, 1]\n[[cases]]\nobserve = 'm9'", ["/cases/0/band", "/cases/1/observe"]),
    "path": ("[variables]\n'bumper.N0' = [1, 2]", ["/variables/bumper.N0", "`bumper.N0` must be one of"]),
    "value": ("[set]\n'damper.mu' = -1", ["/set/damper.mu", "-1"]),
    "scene": ("[scene]\nname = 'mine'", ["/scene/structure", "missing"]),
}


@each("case", FILES)
def test_what_is_wrong_in_a_problem_file_is_told_by_its_key(run: Run, tmp_path: Path, case: str) -> None:
    text, words = FILES[case]
    file = tmp_path / ("problem.json" if text.startswith(("{", "[1")) else "problem.toml")
    file.write_text(text)
    scene = () if case == "scene" else ("two-dof",)
    status, out, err = run("design", *scene, "--problem", file.name)
    assert (status, out) == (2, "")
    assert "Traceback" not in err
    assert [word for word in words if word not in err] == []


def test_an_option_replaces_the_key_of_the_file(run: Run, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "mine.toml").write_text(GOOD.read_text().replace("N0 = 100.0", "N0 = 90.0"))
    (tmp_path / "deep" / "problem.toml").write_text(
        "scene = 'mine.toml'\nlimit = 1.5\nharmonics = 3\n[variables]\n'damper.N0' = [90, 120]\n"
    )
    status, out, err = run("design --problem deep/problem.toml --limit 2 --json")
    assert (status, err) == (0, "")
    answer = json.loads(out)
    assert answer["limit"] == 2.0
    assert 90.0 <= answer["optimum"]["damper.N0"] <= 120.0
    status, out, _ = run("design two-dof --problem deep/problem.toml --variable damper.N0 200 210 --json")
    assert json.loads(out)["optimum"]["damper.N0"] == pytest.approx(200.0)
    assert json.loads(out)["limit"] == 1.5


@pytest.mark.long
def test_a_robust_design_shows_both_optima_side_by_side(run: Run, tmp_path: Path) -> None:
    (tmp_path / "problem.toml").write_text(
        "samples = 4\nharmonics = 3\n[variables]\n'damper.N0' = [60, 200]\n"
        "[uncertain]\n'damper.mu' = [0.25, 0.35]\n"
    )
    status, out, err = run("design two-dof --problem problem.toml --plot picture.png")
    assert (status, err) == (0, "")
    for word in ("nominal optimum", "robust optimum", "worst peak", "damper.mu from 0.25 to 0.35", "below"):
        assert word in out
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    (tmp_path / "bad.toml").write_text("samples = 4\n[uncertain]\n'damper.mu' = [0.4, 0.3]")
    assert "bad.toml: /uncertain/damper.mu" in run("design two-dof --problem bad.toml")[2]


@pytest.mark.long
def test_a_front_is_that_of_the_design_layer(run: Run, tmp_path: Path) -> None:
    arguments = "pareto two-dof --variable damper.N0 20 1000 --limit 1.5 --points 4 --harmonics 3"
    status, out, _ = run(f"{arguments} --plot picture.svg --json")
    keys = {"variables": {"damper.N0": (20.0, 1000.0)}, "limit": 1.5, "points": 4, "harmonics": 3}
    direct = optim.pareto_front(solver.load_scene("two-dof"), **keys)  # type: ignore[arg-type]
    assert status == (0 if direct.reached else 1)
    assert json.loads(out)["points"] == direct.to_json()["points"]
    assert (tmp_path / "picture.svg").read_bytes().startswith(b"<?xml")
    out = run(arguments)[1]
    assert sum("damper.N0" in line or " Hz" in line for line in out.splitlines()) > len(direct.points)


def test_sensitivities_are_those_of_the_design_layer(run: Run, tmp_path: Path) -> None:
    status, out, err = run(
        "sensitivities two-dof --set damper.N0=150 --harmonics 5 --plot picture.png --json"
    )
    assert (status, err) == (0, "")
    answer = json.loads(out)
    direct = optim.sensitivities(solver.load_scene("two-dof"), values={"damper.N0": 150.0}, harmonics=5)
    assert answer["rows"] == direct.to_json()["rows"]
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    status, out, _ = run("sensitivities two-dof --set damper.N0=150 --harmonics 5")
    share = next(row["peak_percent"] for row in answer["rows"] if row["path"] == "structure.k1")
    row = next(line.split() for line in out.splitlines() if line.startswith("structure.k1"))
    assert float(row[3]) == pytest.approx(share, abs=1e-4)
    assert "left out" not in out


def test_an_infeasible_design_says_what_to_relax_and_by_how_much(run: Run) -> None:
    status, out, err = run(
        "design two-dof --variable damper.N0 90 110 --limit 2 --max-peak 2.3 --harmonics 3"
    )
    assert status == 1
    assert "relax" in err
    assert "not all limits can be kept" in out
    row = next(line for line in out.splitlines() if "broken by" in line)
    assert "peak at" in row
    assert "2.3 m " in row
    assert float(row.split()[-2]) == pytest.approx(46.0, abs=2.0), "mm above the limit"


def test_the_frequency_is_offered_only_where_it_can_be_swept(run: Run) -> None:
    assert "one of excitation.amplitude," in run("solve two-dof --frequency 1 --set bumper.N0=5")[2]
    assert "one of frequency," in run("sweep two-dof --parameter bumper.N0 --from 1 --to 2 --frequency 1")[2]


@pytest.mark.parametrize("as_json", [False, True])
def test_a_goal_not_reached_is_status_1_with_the_reason(run: Run, tmp_path: Path, as_json: bool) -> None:
    arguments = "march two-dof --frequency 1.2 --max-periods 3 --plot picture.png"
    status, out, err = run(arguments, *["--json"][:as_json])
    assert status == 1
    assert "allow more periods" in err
    assert not as_json or json.loads(out)["status"] in err
    assert not list(tmp_path.iterdir())


def test_a_band_nobody_can_keep_is_status_1(run: Run) -> None:
    arguments = "design two-dof --variable damper.N0 90 110 --limit 0.5 --max-band 0.01 --harmonics 3 --json"
    status, out, err = run(arguments)
    assert status == 1
    assert json.loads(out)["reached"] is False
    assert optim.DesignStatus.INFEASIBLE.value in err


def test_a_pipe_gets_no_progress() -> None:
    done = subprocess.run([*COMMAND, "sweep", "two-dof"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout


@pytest.mark.long
def test_a_terminal_gets_a_progress_bar_and_a_pipe_the_result() -> None:
    master, slave = pty.openpty()
    arguments = ["sweep", "bladed-disk", "--harmonics", "15", "--json"]
    with subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=slave, env={**os.environ, "TERM": "xterm"}
    ) as process:
        os.close(slave)
        seen = _read_all(master)
        out = process.communicate()[0]
    assert "sweep" in seen
    assert "points" in seen
    answer: dict[str, Any] = json.loads(out)
    assert answer["completed"] is True


def _read_all(terminal: int) -> str:
    seen = b""
    while True:
        try:
            some = os.read(terminal, 4096)
        except OSError:  # how Linux says that the other side is closed
            some = b""
        if not some:
            os.close(terminal)
            return seen.decode()
        seen += some


def test_each_face_says_by_its_own_name_what_is_wrong(run: Run, tmp_path: Path) -> None:
    wanted = "must have low < high, got [300.0, 20.0]"
    with pytest.raises(optim.DesignError) as caught:
        optim.design(solver.load_scene("two-dof"), variables={"damper.N0": [300.0, 20.0]})
    assert str(caught.value) == f"`variables.damper.N0` {wanted}"
    _, _, err = run("design two-dof --variable damper.N0 300 20")
    assert err == f"stickslip: `--variable damper.N0` {wanted}\n"
    file = tmp_path / "problem.json"
    file.write_text(json.dumps({"scene": "two-dof", "variables": {"damper.N0": [300, 20]}}))
    _, _, err = run(f"design --problem {file}")
    assert err == f"stickslip: {file}: /variables/damper.N0: `damper.N0` {wanted}\n"


def test_an_argument_of_python_is_an_option_of_the_command(run: Run) -> None:
    assert run("sweep two-dof --from 2 --to 2")[2].startswith("stickslip: `--to` must differ from `--from`")
    wrong = "map two-dof --parameter damper.N9 --from 1 --to 2"
    assert "`--parameter` must be one of " in run(wrong)[2]
    assert "`--set` must be one of " in run("sweep two-dof --set damper.N9=1")[2]


def test_a_front_of_what_has_nothing_to_design_asks_for_a_variable(run: Run, tmp_path: Path) -> None:
    bare = {**solver.load_scene("two-dof").to_dict(), "contacts": []}
    (tmp_path / "bare.json").write_text(json.dumps(bare))
    status, _, told = run("pareto bare.json")
    assert status == 2
    assert "`--variable` must be given" in told
