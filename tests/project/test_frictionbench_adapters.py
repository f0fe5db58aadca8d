"""FrictionBench asks adapters: without answers within reach, timed from outside, whatever they say."""

from pathlib import Path
from typing import Any

import pytest

from benchmarks.frictionbench import asking, fence, scenes, scorer
from benchmarks.frictionbench.model import HERE, load

ADAPTER = """
from protocol import case_model, serve
NEEDS = ()
RUNGS = [{"n": 1}, {"n": 2}, {"n": 3}]
def solve(case, rung):
    if case["asked"]["what"] != "amplitude":
        raise NotImplementedError("amplitudes alone")
    if rung["n"] == 2:
        raise ArithmeticError("lost")
    assert len(case_model(case).M) == len(case["structure"]["dofs"])
    scale = case["loads"][0]["amplitude"]
    return {"value": 2.4562552541779262547 * scale * (1 + 10.0 ** (-2 * rung["n"])), "estimate": scale * 1e-4}
if __name__ == "__main__":
    serve(solve)
"""


def test_a_made_up_code_is_scored(tmp_path: Path) -> None:
    rungs, process = made_up(tmp_path, ADAPTER)
    try:
        scores = scorer.one(process, "one-slider", rungs, 20.0)
        other = scorer.one(process, "iwan-5-loss", rungs, 20.0)
    finally:
        process.close()
    assert [one.get("digits") for one in scores] == [2.0, None, 6.0]
    assert [one.get("covered") for one in scores] == [False, None, True]
    assert scores[1]["failed"] == "ArithmeticError: lost"
    assert scorer.words(scores).startswith("6.0 in ")
    assert scorer.words(scores).endswith("1 of 3 failed")
    assert scorer.words(other) == "– amplitudes alone"


def made_up(folder: Path, text: str, seconds: float = 20.0) -> tuple[list[dict[str, Any]], asking.Code]:
    """Return rungs and process of an adapter with this text."""
    place = folder / "made_up.py"
    place.write_text(text)
    return scorer.told(place)["RUNGS"], asking.Code(place, seconds)


def scored(folder: Path, body: str, seconds: float = 20.0) -> dict[str, Any]:
    """Return the score of a forged adapter on one case."""
    rungs, process = made_up(folder, FORGED.format(body=body), seconds)
    try:
        [score] = scorer.one(process, "one-slider", rungs, seconds)
    finally:
        process.close()
    return score


FORGED = """
import json, os, sys, time
from pathlib import Path
from protocol import serve
RUNGS = [{{}}]
def solve(case, rung):
{body}
if __name__ == "__main__":
    serve(solve)
"""
READS = """
    import stickslip
    begin = [__file__, stickslip.__file__, {repository!r}, "/proc/%d/cwd/x" % os.getppid(), *sys.path]
    for place in (above for one in begin for above in (Path(one), *Path(one).absolute().parents)):
        for folder in ("answers", "benchmarks/frictionbench/answers", "../benchmarks/frictionbench/answers"):
            try:
                found = json.loads((place / folder / "one-slider.json").read_text())
                return {{"value": float(found["value"])}}
            except OSError:
                pass
    raise ArithmeticError("there are none")"""
HIDES = """
    begun = time.process_time()
    if os.fork() == 0:
        if os.fork() == 0:
            while time.process_time() < 0.2:
                pass
        os._exit(0)
    os.wait()
    while time.process_time() - begun < 0.3:
        pass
    os.wait()
    scale = case["loads"][0]["amplitude"]
    return {"value": 2.4562552541779262547 * scale, "estimate": 1e300, "seconds": 1e-9}"""
REMEMBERS = """
    if not hasattr(serve, "known"):
        serve.known = 2.4562552541779262547 * case["loads"][0]["amplitude"]
    return {"value": serve.known}"""
READY = """
    sys.__stdout__.write(json.dumps({"value": 1.0}) + "\\n")
    sys.__stdout__.flush()
    time.sleep(1.0)
    return {"value": 1.0}"""


@pytest.mark.skipif(not fence.offered(), reason="the system has no Landlock")
def test_an_adapter_finds_no_answers(tmp_path: Path) -> None:
    """Neither beside itself nor in the repository, though its own packages are there."""
    score = scored(tmp_path, READS.format(repository=str(HERE / "cases")))
    assert score == {"rung": {}, "failed": "ArithmeticError: there are none"}


def test_time_and_estimate_are_not_what_an_adapter_says(tmp_path: Path) -> None:
    score = scored(tmp_path, HIDES)
    assert score["digits"] == scorer.MOST
    assert 0.45 < score["seconds"] < 2.0  # what a process that was left behind spends is counted
    assert not score["covered"]


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("body", "failed"),
    [
        ("    return {'value': float('nan')}", "value must be a finite number, got NaN"),
        ("    return {'value': [2.456]}", "value must be a finite number, got [2.456]"),
        ("    return {'value': True}", "value must be a finite number, got true"),
        ("    return {'estimate': 0.0}", "value must be a finite number, got null"),
        ("    time.sleep(100)", "no answer within 5 s"),
        ("    os._exit(0)", "its process ended"),
        ("    os.write(1, b'x' * 3000000)", "its answer is too long"),
        ("    os.write(1, b'{}\\n')", "it did not answer what it was asked"),
        ("    os.write(1, b'nonsense\\n')", "its answer is no line of JSON"),
        (READY, "it did not answer what it was asked"),
    ],
)
def test_what_is_no_answer_scores_nothing(tmp_path: Path, body: str, failed: str) -> None:
    assert scored(tmp_path, body, 0.5) == {"rung": {}, "failed": failed}


def test_an_answer_that_is_remembered_is_wrong_the_next_time(tmp_path: Path) -> None:
    score = scored(tmp_path, REMEMBERS)
    assert score["digits"] <= 0.4


def test_an_adapter_is_named_by_a_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text(ADAPTER)
    monkeypatch.chdir(tmp_path)
    assert scorer.run("mine.py", ["one-slider"], seconds=20.0) == 0
    assert "6.0 in " in capsys.readouterr().out
    assert scorer.run("none/here.py", ["one-slider"]) == 1
    told = capsys.readouterr().out
    assert str(tmp_path / "none" / "here.py") in told
    assert "there are nlvib, pyharm, stickslip, tmdsimpy" in told


@pytest.mark.parametrize("name", ["one-slider", "iwan-5-loss", "optimum-1", "flutter-0.2", "pressed-stop"])
def test_a_case_in_another_scale_has_the_same_answer(name: str) -> None:
    """Forces and motions 8 times as large: no digit of the answer changes but by rounding."""
    case, by = asking.scaled(load(name), 8.0)
    assert scenes.answer(case, 11)["value"] / by == pytest.approx(
        scenes.answer(load(name), 11)["value"], rel=1e-9
    )
