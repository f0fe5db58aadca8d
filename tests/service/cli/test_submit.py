"""The commands that talk to a service, against one that runs as `stickslip serve`."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fe_files import coordinate
from matrix_cases import beam, write_scene

import solver
from service.cli import main

Run = Callable[[str], tuple[int, str, str]]


@pytest.fixture
def run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, server: str
) -> Run:
    """Run the command against the service: exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICKSLIP_URL", server)

    def command(arguments: str) -> tuple[int, str, str]:
        status = main(arguments.split())
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return command


def test_a_design_from_submission_to_picture(run: Run, tmp_path: Path) -> None:
    status, out, err = run("submit design two-dof --variable damper.N0 80 130 --harmonics 5")
    assert (status, err) == (0, "")
    job = out.strip()

    status, out, err = run(f"watch {job}")
    assert (status, err) == (0, "")
    assert out.split() == [job, "design", "successful"]

    status, out, err = run(f"results {job} --json --out results.json --plot optimum.png")
    assert (status, err) == (0, "")
    answer = json.loads(out)
    assert answer == json.loads((tmp_path / "results.json").read_text())
    assert 80.0 <= answer["result"]["optimum"]["damper.N0"] <= 130.0
    assert (tmp_path / "optimum.png").read_bytes().startswith(b"\x89PNG")
    assert {file.name for file in tmp_path.iterdir()} == {"results.json", "optimum.png"}

    status, out, err = run(f"results {job}")
    assert (status, err) == (0, "")
    assert "damper.N0" in out
    assert answer["sweeps"][0]["id"] in out


@pytest.mark.long
def test_a_problem_file_goes_with_the_job_and_the_design_is_listed(run: Run, tmp_path: Path) -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 70.0}).to_dict()
    (tmp_path / "mine.json").write_text(json.dumps({**scene, "name": "mine"}))
    problem = {
        "scene": "mine.json",
        "variables": {"damper.N0": [90, 120]},
        "harmonics": 3,
        "method": "minimax",
    }
    (tmp_path / "problem.json").write_text(json.dumps(problem))
    status, out, err = run("submit design --problem problem.json --limit 2 --max-band 1 --wait --json")
    assert (status, err) == (0, "")
    answer = json.loads(out)
    status, out, err = run(
        "results --scene mine --variable damper.N0 --peak-max 3 --band-max 1 --reached --json"
    )
    assert (status, err) == (0, "")
    (item,) = json.loads(out)["items"]
    assert item["id"] == answer["job"]
    assert item["peak"] == answer["result"]["peak"]
    assert "damper.N0 = " in run("results --scene mine")[1]
    assert json.loads(run("results --scene mine --missed --json")[1]) == {"items": []}
    assert "--scene" in run(f"results {answer['job']} --scene mine")[2]
    assert "/sort" in run("results --sort colour")[2]


def test_an_export_of_a_rig_is_submitted_by_its_columns(run: Run, tmp_path: Path) -> None:
    """The same file, with the same conditions, as the command computes it here."""
    rows = zip(("1,0", "1,2", "1,4"), ("1930,0", "1770,0", "1250,0"), strict=True)
    text = "Weg[mm];f[Hz]\n" + "".join(f"{height};{frequency}\n" for frequency, height in rows)
    (tmp_path / "rig.csv").write_text(text)
    file, columns = "rig.csv:damper.N0=100", "--column Weg[mm]=amplitude:mm --column f[Hz]=frequency:Hz"
    asked = f"--unknown damper.mu 0.1 0.6 --starts 1 --harmonics 3 {columns} --json"
    status, out, err = run(f"submit identify two-dof --data {file} {asked} --wait")
    assert (status, err) == (0, "")
    status, here, err = run(f"identify two-dof {file} {asked}")
    assert (status, err) == (0, "")
    assert json.loads(out)["result"]["values"] == pytest.approx(json.loads(here)["values"], rel=1e-6)
    status, _, err = run("submit identify two-dof --data [] --column a=b:c --unknown damper.mu 0.1 0.6")
    assert status == 2
    assert "`--column` is for a file" in err


@pytest.mark.long
def test_a_front_is_submitted_and_drawn(run: Run, tmp_path: Path) -> None:
    status, out, _ = run("submit pareto two-dof --limit 1.5 --points 3 --harmonics 3 --wait --json")
    assert status == 0
    answer = json.loads(out)
    assert len(answer["result"]["points"]) >= 2
    status, out, err = run(f"results {answer['job']} --plot front.png")
    assert (status, err) == (0, "")
    assert "peak for 0.01 Hz less band" in out
    assert (tmp_path / "front.png").read_bytes().startswith(b"\x89PNG")


def test_a_scene_file_goes_with_the_job(run: Run, tmp_path: Path) -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 70.0})
    (tmp_path / "mine.json").write_text(json.dumps(scene.to_dict()))
    status, out, _ = run("submit solve mine.json --frequency 1.2 --wait --json")
    assert status == 0
    direct = solver.solve(scene, frequency_hz=1.2)
    assert json.loads(out)["result"]["max_abs"] == pytest.approx(direct.max_abs, rel=1e-12)


@pytest.mark.parametrize(
    "arguments",
    [
        "sweep two-dof --from 0.5 --to 1.5 --set damper.N0=60 --limit 1",
        "sweep two-dof --parameter damper.N0 --from 50 --to 60 --frequency 1.2",
        "solve two-dof --frequency 1.2",
        "march two-dof --frequency 1.2",
        "map two-dof --parameter damper.N0 --from 60 --to 90 --steps 4 --frequencies 9 --harmonics 3",
        "campbell two-dof --speeds 60 100 --order 2 --order 1 --harmonics 3 --band 0.5 2.5",
        "peaks two-dof --parameter damper.N0 --from 60 --to 90 --checks 1 --harmonics 3 --set damper.mu=0.35",
    ],
)
def test_waiting_prints_what_the_command_prints(run: Run, arguments: str) -> None:
    status, waited, err = run(f"submit {arguments} --wait")
    assert (status, err) == (0, "")
    here = run(arguments)[1]
    assert _without_time(waited)[: len(_without_time(here))] == _without_time(here)


def _without_time(report: str) -> list[str]:
    lines = [line.rstrip() for line in report.splitlines()]
    return [line for line in lines if line and not line.startswith("time")]


@pytest.mark.long
def test_a_study_of_accuracy_is_submitted_and_drawn(run: Run, tmp_path: Path) -> None:
    status, out, err = run("submit accuracy two-dof --frequency 1.2 --wait --json")
    assert (status, err) == (0, "")
    answer = json.loads(out)
    assert answer["result"]["frequency_hz"] == 1.2
    status, out, err = run(f"results {answer['job']} --plot cost.png")
    assert (status, err) == (0, "")
    assert "closed form" in out
    assert (tmp_path / "cost.png").read_bytes().startswith(b"\x89PNG")


def test_a_study_of_mistuned_disks_is_submitted_and_drawn(run: Run, tmp_path: Path) -> None:
    disk = solver.load_scene("bladed-disk").to_dict()
    disk["structure"] = {**disk["structure"], "sectors": 3}  # type: ignore[dict-item]
    (tmp_path / "disk.json").write_text(json.dumps(disk))
    words = "mistuning disk.json --of tip_middle --samples 3 --from 700 --to 850 --harmonics 1"
    status, out, err = run(f"submit {words} --wait")
    assert (status, err) == (0, "")
    here = run(words)[1]
    assert _without_time(out)[: len(_without_time(here))] == _without_time(here)
    assert "seed " in here
    job = json.loads(run(f"submit {words} --json")[1])["id"]
    assert run(f"results {job} --plot worst.png")[0] == 0
    assert (tmp_path / "worst.png").read_bytes().startswith(b"\x89PNG")


def test_submitted_jobs_can_be_read_by_programs(run: Run) -> None:
    status, out, _ = run("submit solve two-dof --frequency 1.25 --json")
    job = json.loads(out)
    assert status == 0
    assert job["kind"] == "solve"
    status, out, _ = run(f"watch {job['id']} --json")
    assert (status, json.loads(out)["status"]) == (0, "successful")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("submit solve two-duf --frequency 1", ["/scene", "two-duf"]),
        ("submit solve two-dof --frequency -1", ["/frequency_hz", "-1"]),
        ("submit sweep two-dof --from 1 --to 1", ["/to", "1.0"]),
        ("submit design two-dof --variable bumper.N0 1 2", ["bumper.N0"]),
        ("submit solve two-dof --frequency 1 --set damper.mu=-1", ["damper.mu", "-1"]),
        ("submit peaks two-dof --parameter damper.N9 --from 1 --to 2", ["/parameter", "N9"]),
        ("submit campbell two-dof --speeds 100 60", ["/speeds_rpm/0", "60"]),
        ("submit mistuning two-dof --of tip", ["/scene", "cyclic"]),
        ("submit map two-dof --parameter damper.N0 --from 1 --to 2 --steps 1", ["/steps", "1"]),
        ("watch nobody", ["nobody"]),
        ("results nobody", ["nobody"]),
    ],
)
def test_what_the_service_refuses_is_status_2(run: Run, arguments: str, words: list[str]) -> None:
    status, out, err = run(arguments)
    assert (status, out) == (2, "")
    assert [word for word in words if word not in err] == []


def test_a_job_that_falls_short_is_status_1(run: Run) -> None:
    arguments = "submit march two-dof --frequency 1.2 --max-periods 3"
    status, out, err = run(f"{arguments} --wait --json")
    assert status == 1
    assert json.loads(out)["status"] == "failed"
    assert "allow more periods" in err
    job = run(arguments)[1].strip()
    assert run(f"watch {job}")[0] == 1
    assert run(f"results {job}")[0] == 1


def test_a_service_that_is_not_there_is_status_1(run: Run) -> None:
    status, out, err = run("submit solve two-dof --frequency 1 --url http://127.0.0.1:1")
    assert (status, out) == (1, "")
    assert "http://127.0.0.1:1 cannot be reached" in err


def test_files_of_matrices_beside_a_scene_are_uploaded(run: Run, tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    arguments = f"solve {scene} --frequency 1 --harmonics 3 --json"
    status, here, _ = run(arguments)
    assert status == 0
    status, there, errors = run(f"submit {arguments} --wait")
    assert status == 0, errors
    assert json.loads(there)["result"]["max_abs"] == pytest.approx(json.loads(here)["max_abs"], rel=1e-12)
    (tmp_path / "K.npz").unlink()
    status, _, errors = run(f"submit {arguments}")
    assert status == 2
    assert "`K` of the scene" in errors
    (tmp_path / "K.npz").write_bytes(b"no matrix")
    status, _, errors = run(f"submit {arguments}")
    assert status == 2
    assert "not a .npz file" in errors


def test_files_that_name_the_rows_go_with_the_matrices(run: Run, tmp_path: Path) -> None:
    """CalculiX: the file of labels stands beside the matrices under their name."""
    for suffix, A in zip(("mas", "sti"), beam(8), strict=True):
        (tmp_path / f"job.{suffix}").write_text(coordinate(A))
    (tmp_path / "job.dof").write_text("".join(f"{node}.{dof}\n" for node in range(1, 9) for dof in (2, 6)))
    assert run("import job.sti job.mas --out scene.toml --dof tip=8.UY --units mm")[0] == 0
    arguments = "solve scene.toml --frequency 1 --harmonics 3 --json"
    status, here, _ = run(arguments)
    assert status == 0
    status, there, errors = run(f"submit {arguments} --wait")
    assert status == 0, errors
    assert json.loads(there)["result"]["max_abs"] == pytest.approx(json.loads(here)["max_abs"], rel=1e-12)
