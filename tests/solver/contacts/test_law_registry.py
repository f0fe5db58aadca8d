"""What every registered law says of itself fits together, and a scene is read from it without Numba."""

import ast
import math
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from each import each
from law_scene_cases import CUBIC, GAP, PLANE, RUB, scene

from solver.contacts.kernels import columns
from solver.contacts.kernels.laws import law_number
from solver.contacts.laws import law_registry as registry
from solver.contacts.laws.law_registry import laws, register
from solver.errors import SettingError
from solver.scene.json_schema import scene_schema

COULOMB: dict[str, Any] = {"kt": 2.0, "mu": 0.4, "N0": 1.0, "N1": 0.3, "N1_phase": 0.2}
CONTACTS = {
    "coulomb": COULOMB, "tied": {"kt": 2.0, "mu": 0.4, "N0": 1.0, "N1_ratio": 0.3}, "elastic-normal": RUB,
    "coulomb-2d": PLANE, "gap": GAP, "polynomial": CUBIC,
    "coulomb-3d": {**RUB, **PLANE, "law": "coulomb-3d", "kt_second": 3.0},
}  # fmt: skip
LEFT_OUT = {**CONTACTS, "one stiffness": {**PLANE, "law": "coulomb-3d"}, "no N1": {**COULOMB, "N1": None}}


def test_every_law_says_what_each_port_begins_with() -> None:
    for law in laws().values():
        assert len(law.HELD) == len(law.END_KEYS) == len(set(law.END_KEYS))
        assert set(law.RUBBING) < set(range(len(law.END_KEYS) + 1))


def test_no_two_parameters_of_a_law_share_a_column() -> None:
    for law in laws().values():
        taken = [quantity.column for quantity in law.PARAMETERS.values()]
        assert len(taken) == len(set(taken))
        assert all(0 <= column < columns.COLUMNS for column in taken)


def test_every_parameter_is_a_field_of_the_scene() -> None:
    for law in laws().values():
        assert law.PARAMETERS.keys() <= law.model_fields.keys()


@each("case", LEFT_OUT)
def test_what_is_left_out_is_the_product_said(case: str) -> None:
    (contact,) = scene(LEFT_OUT[case]).contacts
    for key, quantity in contact.PARAMETERS.items():
        if quantity.otherwise is not None and getattr(contact, key) is None:
            product = math.prod(getattr(contact, other) or 0.0 for other in quantity.otherwise)
            assert contact.value_of(key) == pytest.approx(product)


@each("case", LEFT_OUT)
def test_sliders_cover_values_that_a_scene_may_have(case: str) -> None:
    found = scene(LEFT_OUT[case])
    (contact,) = found.contacts
    for key, quantity in contact.PARAMETERS.items():
        span = quantity.span(key)
        if span is not None and (quantity.otherwise is not None or getattr(contact, key) is not None):
            size = 1.0 if span.of is None else abs(contact.value_of(span.of))
            for end in (span.low * size, span.high * size):
                path = f"{contact.name}.{key}"
                assert found.with_values({path: end}).value(path) == pytest.approx(end)


def test_kernels_of_the_package_have_numbers_that_stay() -> None:
    for number in (0, 2, 3):
        assert law_number(columns.KERNELS[number]) == number


@pytest.mark.parametrize("case", CONTACTS)
def test_a_contact_comes_back_from_its_row(case: str) -> None:
    (contact,) = scene(CONTACTS[case]).contacts
    row = np.full(columns.COLUMNS, np.nan)
    contact.fill(row, 5)
    again = np.full(columns.COLUMNS, np.nan)
    contact.with_numbers(row).fill(again, 5)
    np.testing.assert_array_equal(again, row)


@pytest.mark.parametrize("case", CONTACTS)
def test_a_row_changes_the_contact_it_is_read_into(case: str) -> None:
    (contact,) = scene(CONTACTS[case]).contacts
    for key, quantity in contact.PARAMETERS.items():
        row = np.zeros(columns.COLUMNS)
        contact.fill(row, 5)
        row[quantity.column] += 0.25
        if not np.isnan(row[quantity.column]):
            tied = contact.load is not None and contact.load.ratio is not None and key == "N1"
            assert tied or contact.with_numbers(row).value_of(key) == pytest.approx(row[quantity.column])


def test_two_laws_of_one_word_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Another(laws()["gap"]):  # type: ignore[misc]
        """A law that takes the word of another."""

    with pytest.raises(ValueError, match="gap"):
        register(Another)
    monkeypatch.setattr(registry.LAWS, "added", [Another])
    with pytest.raises(SettingError, match=r"`law` must be the word of one law, not of Another too"):
        laws()


def test_the_schema_lists_the_laws_in_their_order() -> None:
    items = scene_schema()["properties"]["contacts"]["items"]
    named = [one["$ref"].rpartition("/")[2] for one in items["oneOf"]]
    assert named == [law.__name__ for law in laws().values()]


def test_nothing_outside_the_laws_asks_for_a_class_of_contact() -> None:
    """Of files that name no class of contact none is parsed."""
    root = Path(__file__).resolve().parents[3]
    house = runpy.run_path(str(root / "docs" / "house.py"))
    texts = {
        ".".join(path.relative_to(root).with_suffix("").parts): path.read_text("utf-8")
        for package in house["PACKAGES"]
        for path in (root / package).rglob("*.py")
    }
    named = ("Contact", "GapSpring", "PolynomialSpring")
    trees = {
        name: ast.parse(text)
        for name, text in texts.items()
        if "isinstance(" in text and any(word in text for word in named)
    }
    assert len(trees) > 5
    assert house["House"].checks_of_laws(SimpleNamespace(trees=trees)) == 0


def test_a_scene_is_read_without_numba() -> None:
    code = (
        "import sys; from solver.scene.scene import load_scene; scene = load_scene('two-dof');"
        "scene.contacts[0].rows(); sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
