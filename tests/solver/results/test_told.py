"""What a field says once is in the docstring, the JSON, its schema and the text."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from each import each
from every_module import every_module

import optim
import solver
import stickslip.lab
from service.jobs.common.result_models import result_model
from solver.arrays import FloatOrNaN, Real
from solver.results.told import Piece, Told, json_keys, json_value


class Word(Enum):
    ONE = "one"


class Pair(NamedTuple):
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Part(Piece):
    """A part."""

    height: Annotated[float, 'Height [m], it\'s "high".']
    word: Annotated[Word, "Of a few."] = Word.ONE


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Whole(Piece):
    """A whole.

    And more of it.
    """

    JSON: ClassVar = "numbers first=part.height parts doubled known"

    numbers: Annotated[Real, "Speeds [1/min], (n,)."]
    part: Annotated[Part, "One of them."]
    parts: Annotated[tuple[Part, ...], "All."]
    known: Annotated[FloatOrNaN, "A time [s]; NaN if not known."]
    hidden: Annotated[
        dict[str, float],
        "Long words that go on in a second line, "
        "and end there.",
    ]  # fmt: skip

    @property
    def doubled(self) -> float:
        """Twice the height [m]."""
        return 2.0 * self.part.height


PART = Part(height=2.0)
WHOLE = Whole(
    numbers=np.array([1.0, np.nan]), part=PART, parts=(PART, Part(height=math.inf)), known=math.nan, hidden={}
)


def test_the_docstring_lists_what_fields_say() -> None:
    text = inspect.getdoc(Whole) or ""
    assert text.startswith(
        "A whole.\n\nAnd more of it.\n\nAttributes\n----------\nnumbers : Real\n    Speeds"
    )
    assert "hidden : dict[str, float]\n    Long words that go on in a second line, and end there." in text
    assert text.count("Attributes") == 1
    assert 'height : float\n    Height [m], it\'s "high".' in (inspect.getdoc(Part) or "")
    assert "Annotated" not in str(inspect.signature(Whole))


def test_the_json_has_the_keys_in_their_order() -> None:
    assert json.dumps(WHOLE.to_json(), allow_nan=False) == json.dumps({
        "numbers": [1.0, None], "first": 2.0,
        "parts": [{"height": 2.0, "word": "one"}, {"height": None, "word": "one"}],
        "doubled": 4.0, "known": None,
    })  # fmt: skip


def test_a_text_has_the_units() -> None:
    assert repr(PART) == "<Part: height 2 m, word one>"


def test_the_schema_has_types_and_words() -> None:
    found = result_model(Whole, "WholeResult", more=(int | None, None)).model_json_schema()
    told = {key: (value.get("type"), value.get("description")) for key, value in found["properties"].items()}
    assert told == {
        "numbers": ("array", "Speeds [1/min], (n,)."), "first": ("number", 'Height [m], it\'s "high".'),
        "parts": ("array", "All."), "doubled": ("number", "Twice the height [m]."),
        "known": (None, "A time [s]; NaN if not known."), "more": (None, None),
    }  # fmt: skip
    assert found["properties"]["known"]["anyOf"] == [{"type": "number"}, {"type": "null"}]
    assert found["description"] == "A whole."
    assert "more" not in found["required"]


@each(
    ("value", "wanted"),
    [
        (np.array([[1.0, 2.0]]), [[1.0, 2.0]]), (np.array([1, 2]), [1, 2]), (np.array([True]), [True]),
        (np.array(["a"]), ["a"]), (np.float64(1.5), 1.5), (np.array([[math.inf]]), [[None]]),
        (np.bool_(True), True),
        (np.int64(3), 3), (Pair(1.0, math.nan), {"low": 1.0, "high": None}), ((1, (2.0,)), [1, [2.0]]),
        ({"a": Word.ONE}, {"a": "one"}), (None, None),
    ],
)  # fmt: skip
def test_values_become_json(value: object, wanted: object) -> None:
    found = json_value(value)
    assert found == wanted
    json.dumps(found, allow_nan=False)


def _results() -> Iterator[type[Told]]:
    """Every class of results and their parts."""
    for module in every_module(solver, optim, stickslip.lab):
        for found in vars(module).values():
            if inspect.isclass(found) and issubclass(found, Told) and found.__module__ == module.__name__:
                yield found


@each("kind", _results)
def test_what_is_named_is_there(kind: type[Told]) -> None:
    """A key that is no attribute is one that `to_json` of the class gives; words are of fields."""
    assert "Annotated[" not in str(inspect.get_annotations(kind))
    if not kind.JSON:
        return
    given = "" if kind.to_json is Told.to_json else inspect.getsource(kind.to_json)
    annotated = {name for one in kind.__mro__ for name in (*inspect.get_annotations(one), *vars(one))}
    missing = [path for path in json_keys(kind).values() if path.partition(".")[0] not in annotated]
    assert [key for key in missing if f"{key}=" not in given and "**" not in given] == []
