"""FrictionBench: its cases are what its schema says, its answers hold, and its scorer scores."""

import json
import zipfile
from pathlib import Path

import jsonschema
import pytest

from benchmarks.frictionbench import answers, scenes, scorer
from benchmarks.frictionbench.model import HERE, load, model, names
from solver.certificate import checker

FAST = (
    "den-hartog-0.8", "den-hartog-stops", "sinha-griffin-repelling", "one-slider", "moving-load-phase",
    "case-a-peak-100-150", "elastic-normal-1.5",
)  # fmt: skip
SCHEMA = json.loads((HERE / "case.schema.json").read_text())
KNOWN = {one: answers.stored(one) for one in names() if answers.path(one).exists()}
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
    return {"value": 2.4562552541779262547 * (1 + 10.0 ** (-2 * rung["n"])), "estimate": 1e-4}
if __name__ == "__main__":
    serve(solve)
"""


def test_the_cases_are_what_their_schema_says() -> None:
    assert len(names()) >= 50
    for number, name in enumerate(names(), start=1):
        case = json.loads((HERE / "cases" / f"{name}.json").read_text())
        jsonschema.validate(case, SCHEMA)
        assert (case["name"], case["number"]) == (name, number)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long if name == "patch-122-circle" else ()) for name in names()],
)
def test_a_case_becomes_a_scene_of_the_same_matrices(name: str) -> None:
    from solver.linear.assembly import linear_model

    case = load(name)
    scene = scenes.scene(case)
    assert [one.name for one in scene.contacts] == [one["name"] for one in case["contacts"]]
    if "sectors" not in case["structure"]:
        built = linear_model(scene)
        for key, matrix in zip("MCK", (built.M, built.C0, built.K0), strict=True):
            assert matrix == pytest.approx(
                getattr(model({**case, "contacts": []}), key), rel=1e-12, abs=1e-14
            )


@pytest.mark.parametrize("name", ["one-slider", "floating-50", "two-dof-stuck", "elastic-normal-0.5"])
def test_a_proof_is_checked_by_who_knows_nothing_of_us(name: str) -> None:
    """And the answer is what it claims."""
    raw = json.loads((HERE / "proofs" / f"{name}.json").read_text())
    checker.check(raw)
    half = load(name)["asked"]["what"] == "half-peak-to-peak"
    assert KNOWN[name]["enclosure"] == raw["claims"]["half_peak_to_peak" if half else "max_abs"]


def test_an_answer_says_by_how_many_ways() -> None:
    assert set(KNOWN) == set(scorer.answered())
    for name, answer in KNOWN.items():
        assert answer["ways"] == len(answer["by"]), name
        if answer.get("enclosure"):
            low, high = (float(one) for one in answer["enclosure"])
            assert low <= float(answer["value"]) <= high or abs(high - low) < 1e-15 * abs(high), name
    assert sum(one["ways"] > 1 and one["agreed_digits"] >= answers.WANTED for one in KNOWN.values()) >= 50


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in FAST else pytest.mark.long) for n in KNOWN]
)
def test_an_answer_is_found_again_by_its_ways(name: str) -> None:
    found = answers.recompute(name, most=80 if name in FAST else answers.FAR)
    assert set(found["by"]) - {"march"} == set(KNOWN[name]["by"]) - {"march"}
    assert float(found["value"]) == pytest.approx(
        float(KNOWN[name]["value"]), rel=1e-13 if found.get("enclosure") else 1e-9
    )
    assert found["ways"] == 1 or found["agreed_digits"] >= (
        min(7.0 if name in FAST else 16.0, KNOWN[name]["agreed_digits"] - 0.5)
    )


@pytest.mark.parametrize("name", FAST)
def test_our_answer_is_within_our_own_estimate(name: str) -> None:
    found, known = scenes.answer(load(name), 21), KNOWN[name]
    error = abs(found["value"] - float(known["value"]))
    assert scorer.covers(error, found["estimate"], known), (error, found["estimate"])


def test_a_made_up_code_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "made_up.py"
    place.write_text(ADAPTER)
    process = scorer.Code(
        [
            scorer.sys.executable,
            "-c",
            f"import sys; sys.path.insert(0, {str(scorer.ADAPTERS)!r}); exec({ADAPTER!r})",
        ],
        20.0,
    )
    try:
        rungs = scorer.told(place)["RUNGS"]
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
    assert scorer.run("none", ["one-slider"]) == 1
    assert "there are nlvib, pyharm, stickslip, tmdsimpy" in capsys.readouterr().out


def test_the_archive_holds_every_case_and_its_answer(tmp_path: Path) -> None:
    with zipfile.ZipFile(scorer.archive(str(tmp_path / "all.zip"))) as packed:
        made = packed.namelist()
    assert {f"frictionbench/cases/{name}.json" for name in names()} <= set(made)
    assert {f"frictionbench/answers/{name}.json" for name in KNOWN} <= set(made)
    assert {
        "frictionbench/CITATION.cff",
        "frictionbench/checker.py",
        "frictionbench/proofs/case-a.json",
    } <= set(made)
