"""The demonstration, on a small case: a design and sweeps through the service, read back, drawn."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import solver
from service.cli import main
from stickslip.lab.demo.demonstration import run
from stickslip.lab.demo.demo_cases import CASES, REMOVED, STUCK, DemoCase, told_without_compiler
from service.cli.failures import ShortfallError
from service.client.embedded import EmbeddedService
from service.settings.settings import load_settings

SMALL = DemoCase(scene="two-dof", contact="damper", bounds=(80.0, 130.0), shown=(90.0, 120.0), steps=3)


def test_the_demonstration_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "new" / "folder"
    pictures = run(folder, [SMALL])
    out, err = capsys.readouterr()
    assert err == ""
    assert [picture.name for picture in pictures] == ["two-dof-responses.png", "two-dof-peak.png"]
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)
    load = float(re.search(r"damper\.N0 +(\S+) N", out)[1])  # type: ignore[index]
    assert 100.0 <= load <= 110.0
    for word in (
        "peak",
        "m at 1.04",
        "band",
        "Hz above",
        "frequency responses in",
        "stored sweeps read back",
    ):
        assert word in out

    with EmbeddedService(load_settings(database=f"sqlite:///{folder}/demo.db", workers=1)) as service:
        stored = service.sweeps(limit=1000)
        loads = {sweep.contacts["damper"].N0 for sweep in stored}
        assert {REMOVED, STUCK, *SMALL.shown, *SMALL.loads} <= loads
        best = min(stored, key=lambda sweep: sweep.peak.value if sweep.peak else float("inf"))
        assert pytest.approx(load, rel=5e-4) == best.contacts["damper"].N0
        again = solver.sweep(solver.load_scene("two-dof").with_values({"damper.N0": 90.0}))
        ninety = next(sweep for sweep in stored if sweep.contacts["damper"].N0 == 90.0)
        assert service.sweep(ninety.id).arrays["amplitude"] == pytest.approx(again.amplitude)

    # Again in the same folder: the design is made anew, the responses are the stored ones.
    run(folder, [SMALL])
    with EmbeddedService(load_settings(database=f"sqlite:///{folder}/demo.db", workers=1)) as service:
        assert len([s for s in service.sweeps(limit=1000) if s.contacts["damper"].N0 == 90.0]) == 1


@pytest.mark.long
def test_where_nothing_is_compiled_the_first_optimum_comes_interpreted_and_once(tmp_path: Path) -> None:
    settings = {name: value for name, value in os.environ.items() if name != "STICKSLIP_KERNELS"}
    done = subprocess.run(
        [sys.executable, "-c", "import sys; from service.cli import process; sys.exit(process())", "demo"],
        env={**settings, "XDG_CACHE_HOME": str(tmp_path)}, cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "computed without waiting for the compiler" in done.stderr
    assert [done.stdout.count(f"Best damper of {case.scene}") for case in CASES] == [1, 1]
    assert len(list((tmp_path / "demo-output").glob("*.png"))) == 4


def test_an_early_answer_is_that_of_the_command(capfd: pytest.CaptureFixture[str]) -> None:
    assert told_without_compiler(SMALL) == 1
    assert re.search(r"damper\.N0 +104\.8 N", capfd.readouterr().out)
    with pytest.raises(ShortfallError, match="nowhere"):
        told_without_compiler(replace(SMALL, scene="nowhere"))


def test_the_limits_are_linear() -> None:
    for case in CASES:
        scene = solver.load_scene(case.scene)
        for values in case.limits:
            solution = solver.solve(
                scene.with_values(values), frequency_hz=scene.observe.band[0], harmonics=5
            )
            assert {contact.state.value for contact in solution.contacts} <= {"stuck", "separated"}


def test_a_design_that_falls_short_ends_the_demonstration(tmp_path: Path) -> None:
    # At these loads the contact never slips: the peak does not depend on them.
    hopeless = DemoCase(scene="two-dof", contact="damper", bounds=(1e8, 1e9), shown=(), steps=2)
    with pytest.raises(ShortfallError, match="two-dof is failed"):
        run(tmp_path, [hopeless])


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["demo", "--out", str(tmp_path / "file" / "below")]) == 2
    assert "--out" in capsys.readouterr().err
