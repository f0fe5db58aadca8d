"""One function names what amplitudes are of: on axes, in tables, in JSON, on the page."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from each import each

import optim
import solver
from solver.results.known import HALF_PEAK_TO_PEAK, MAX_ABS, WORDS, Measured
from solver.results.units import shown_unit
from solver.scene.scene import Scene

ROOT = Path(__file__).parents[3]
NAMES = {
    "max|x|": ({}, "max |m2|"),
    "half peak to peak": ({"measure": "half_peak_to_peak"}, "half peak to peak of m2"),
    "harmonic": ({"harmonic": 3}, "max |harmonic 3 of m2|"),
    "both": ({"measure": "half_peak_to_peak", "harmonic": 3}, "half peak to peak of harmonic 3 of m2"),
}
STUDIES: dict[str, Callable[[Scene], Any]] = {
    "sweep": lambda s: solver.sweep(s, harmonics=3),
    "map": lambda s: solver.response_map(
        s, "damper.N0", 50.0, 200.0, steps=3, frequencies=9, harmonics=3, ridge=False
    ),
    "campbell": lambda s: optim.campbell_diagram(s, speeds_rpm=(50.0, 80.0), harmonics=3),
}


def two_dof(observed: dict[str, Any]) -> Scene:
    raw = solver.load_scene("two-dof").to_dict()
    raw["observe"] = {"dof": "m2", "band": raw["observe"]["band"], **observed}
    return Scene.from_dict(raw)


@each("name", NAMES)
@each("study", STUDIES)
def test_axes_json_and_tables_name_what_is_measured(name: str, study: str) -> None:
    observed, words = NAMES[name]
    found = STUDIES[study](two_dof(observed))
    told = found.to_json()["measured"]
    assert told == {
        "name": words, "dof": "m2", "measure": observed.get("measure", MAX_ABS),
        "harmonic": observed.get("harmonic"), "unit": "m",
    }  # fmt: skip
    page = found.plot()
    labels = [text for axes in page.axes for text in (axes.get_xlabel(), axes.get_ylabel())]
    assert [text for text in labels if words in text]
    others = {one for _, one in NAMES.values() if one not in words}
    assert not [text for text in labels for other in others if other in text]
    said = [value for block in found.blocks() for _, value in block.pairs]
    assert said.count(words) == (0 if name == "max|x|" else 1)
    assert Measured.of_result(found.to_json()).name == words


def test_a_design_by_half_peak_to_peak_says_so() -> None:
    found = optim.design(two_dof({"measure": HALF_PEAK_TO_PEAK}), variables={"damper.N0": (50.0, 200.0)})
    assert found.to_json()["measured"]["name"] == NAMES["half peak to peak"][1]
    assert "half peak to peak of m2" in [value for block in found.blocks() for _, value in block.pairs]
    assert any("half peak to peak of m2" in axes.get_ylabel() for axes in found.plot().axes)


def test_an_earlier_result_is_named_by_what_it_knows() -> None:
    assert Measured.of_result({"dof": "tip"}).name == "max |tip|"
    assert Measured.of_result({}).name == "max |x|"
    assert Measured.of_result(
        {"measured": Measured(dof="y", measure=HALF_PEAK_TO_PEAK).to_json()}
    ) == Measured(dof="y", measure=HALF_PEAK_TO_PEAK)


def test_a_recovered_sum_is_drawn_in_its_unit() -> None:
    stress = Measured(dof="fillet", unit="MPa")
    assert stress.label("amplitude", stress.unit_for(3e-4)) == "amplitude, max |fillet| [MPa]"
    plain = Measured(dof="tip")
    assert plain.unit_for(3e-4) == shown_unit(3e-4)


def test_nobody_else_makes_such_a_name() -> None:
    """Neither Python nor the page puts `max |` before the name of a DOF by itself."""
    made = re.compile(r"max ?\|\$?\{")
    for folder in ("solver", "optim", "service", "stickslip"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix not in (".py", ".js") or "vendor" in path.parts:
                continue
            found = made.findall(path.read_text(encoding="utf-8"))
            assert not found or path.parts[-2:] in MAKERS, path


# `Measured`, and of a mode, which has `max_abs` whatever is observed.
MAKERS = {("results", "known.py"), ("modes", "charts.js"), ("modes", "view.js")}


def test_words_are_those_of_the_keys() -> None:
    assert WORDS == {"max_abs": "max|x|", "half_peak_to_peak": "half peak to peak", "mean": "mean"}
