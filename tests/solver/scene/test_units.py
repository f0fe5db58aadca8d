"""Numbers with a unit behind them in a scene, and how numbers are written for people."""

import math
import tomllib
from typing import Any

import pytest
from each import each

import solver
from solver.contacts.laws.law_registry import laws
from solver.results import units
from solver.scene.parameter_paths import parameter_of, parameter_unit
from solver.scene.validation import unit_of

WRITTEN = [
    (7.93687e-7, "m", None, "0.7937 µm"), (2.35, "m", 7.2e-5, "2.35 m ± 72 µm"),
    (1.0161e-4, "m", 2.7e-6, "0.1016 ± 0.0027 mm"), (5.53e6, "N/m", None, "5.53 MN/m"),
    (20_000.0, "N", None, "20 kN"), (0.05, "N", None, "50 mN"), (0.004, "kg", None, "4 g"),
    (412.3456, "Hz", None, "412.3 Hz"), (12_345.0, "Hz", None, "12.35 kHz"), (0.5, "rad", None, "0.5 rad"),
    (4000.0, "1/min", None, "4000 1/min"), (0.0123, "s", None, "12.3 ms"), (0.0, "m", None, "0 m"),
    (1e-20, "m", None, "1e-20 m"), (123_456.0, "", None, "123500"), (250.0, "MPa", 3.0, "250 ± 3 MPa"),
    (-3e-5, "m", None, "-30 µm"), (math.inf, "N/m", None, "inf N/m"), (1.5, "m", math.nan, "1.5 m"),
]  # fmt: skip


@each(("value", "unit", "error", "text"), WRITTEN)
def test_a_quantity_has_few_digits_and_the_prefix_that_fits(
    value: float, unit: str, error: float | None, text: str
) -> None:
    assert units.quantity(value, unit, error) == text


def test_both_ends_of_a_range_have_one_unit() -> None:
    assert units.span(0.2, 2.6, "Hz") == "0.2 to 2.6 Hz"
    assert units.span(900.0, 12_000.0, "N") == "0.9 to 12 kN"


def wedge(old: str, new: str) -> dict[str, Any]:
    text = solver.scene.toml.shipped_text("platform-wedge")
    assert old in text
    return tomllib.loads(text.replace(old, new, 1))


@each(
    ("old", "new"),
    [
        ("angle = 0.35", 'angle = "20.053522829578814 deg"'),
        ("width = 0.012", 'width = "12 mm"'),
        ("amplitude = 60.0", 'amplitude = "0.06 kN"'),
        ("[300.0, 420.0]", '["300 Hz", "0.42 kHz"]'),
        ("ax = 0.15", 'ax = "150 g"'),
        ("speed = 4000.0", 'speed = "4000 rpm"'),
        ("mu = 0.3", 'mu = "30 %"'),
        ("[-0.006, 0.0, 0.0]", '["-6 mm", 0.0, 0.0]'),
        ("k = 6.0e5", 'k = "600 N/mm"'),
        ("kt = 2.0e7", 'kt = "20 N/µm"'),
        ("c = 1.0 }", 'c = "1 N s/m" }'),
        ("[2.0e-7, 2.0e-7, 1.2e-7]", '["200 g mm²", "200 g*mm^2", 1.2e-7]'),
    ],
)
def test_a_number_of_a_scene_may_have_a_unit(old: str, new: str) -> None:
    meant = solver.load_scene("platform-wedge").to_dict()
    assert flat(solver.Scene.from_dict(wedge(old, new)).to_dict()) == pytest.approx(flat(meant))


def flat(raw: object, place: str = "") -> dict[str, float]:
    rows = raw.items() if isinstance(raw, dict) else enumerate(raw) if isinstance(raw, list | tuple) else ()
    found = {key: value for step, one in rows for key, value in flat(one, f"{place}/{step}").items()}
    return {**found, place: raw} if isinstance(raw, int | float) else found


def test_the_amplitude_of_a_base_is_a_length() -> None:
    raw: dict[str, Any] = solver.load_scene("two-dof").to_dict()
    force = {"ground": {"m1": 1.0, "m2": 1.0}, "amplitude": "3 mm"}
    assert solver.Scene.from_dict({**raw, "excitation": force}).level == 3e-3


def test_a_value_may_have_the_unit_of_its_path() -> None:
    scene = solver.load_scene("platform-wedge").with_values(
        {"wedge.angle": "25 deg", "structure.blade_a": "700 N/mm"}
    )  # type: ignore[dict-item]
    assert scene.value("wedge.angle") == pytest.approx(math.radians(25.0))
    assert scene.value("structure.blade_a") == pytest.approx(7e5)


def test_the_unit_of_a_number_of_a_contact_is_that_of_its_law() -> None:
    # `chi` is an exponent of Iwan's element and a time over a length of Hunt and Crossley's.
    for law, found in laws().items():
        row = {"contacts": [{"law": law}]}
        said = {key: unit_of(("contacts", 0, key), row) for key in found.PARAMETERS}
        assert said == {key: one.unit for key, one in found.PARAMETERS.items()}


def test_names_that_look_like_quantities_stay_names() -> None:
    raw: dict[str, Any] = solver.load_scene("two-dof").to_dict()
    assert solver.Scene.from_dict({**raw, "name": "3m"}).name == "3m"


def test_a_contact_is_left_out_with_what_it_alone_holds() -> None:
    two = solver.load_scene("two-dof").without(["damper"])
    assert two.contacts == ()
    platform = solver.load_scene("platform-wedge")
    free = platform.without(["wedge"])
    assert (free.contacts, free.bodies) == ((), ())
    assert [dof for dof in free.dofs if "wedge" in dof] == []
    both = solver.load_scene("bladed-disk").without(["*"])
    assert both.contacts == ()
    assert [c.name for c in solver.load_scene("bladed-disk").without(["shroud"]).contacts] == ["root"]
    with pytest.raises(solver.SettingError, match=r"must be of damper, got 'dampr'; did you mean `damper`\?"):
        solver.load_scene("two-dof").without(["dampr"])


def test_the_free_limit_is_the_linear_response() -> None:
    scene = solver.load_scene("two-dof")
    free = solver.solve(scene.without(["damper"]), frequency_hz=1.3).max_abs
    assert free == pytest.approx(
        solver.solve(scene.with_values({"damper.N0": 0.0}), frequency_hz=1.3).max_abs
    )


@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_a_path_alone_tells_the_unit_of_contacts_dampers_and_speed(name: str) -> None:
    """Tables of results have no scene: of `structure` alone the unit depends on it."""
    scene = solver.load_scene(name)
    for path in scene.parameter_paths():
        if not path.startswith("structure."):
            assert parameter_unit(path) == parameter_of(scene, path).unit, path
