"""What shows a result: functions named as text, because they stand above the classes they show.

A class of result says which function puts it in words, which makes arrays of it and which draws it. They are
loaded when somebody asks: computing needs no Matplotlib, and results import nothing of what shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from solver.lab import LAB


@dataclass(frozen=True, slots=True)
class Data:
    """The data set of a class of result: its attributes with their units and words.

    Parameters
    ----------
    kind : of data set.
    columns : dimensions to the names of what stands along them, ``name=path.of.attribute`` where they differ.
        ``"way=rows"``: a dimension along the parts in `rows`, whose attributes are meant. Along ``harmonic``
        stand coefficients.
    notes : names of attributes of the whole, likewise.
    status, scene : where they stand; a status is else a word, a scene left out.
    index : a dimension that is counted.
    rows : dimensions that make the rows of a table, the first of `columns` if left out.
    """

    kind: str
    columns: Mapping[str, str]
    notes: str = ""
    status: str = "status"
    scene: str = "scene"
    index: str = ""
    rows: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Views:
    """The functions that show a class of result.

    Parameters
    ----------
    package : where ``tables``, ``summary``, ``to_dataset`` and ``plots.figures`` stand, or a folder of the
        lab, whose ``module:name`` is the whole place in it.
    told : ``module:name`` of a function in ``tables`` that puts in words what `to_json` gives, or the name of
        one of ``summary``.
    dataset : name of a function; ``described`` makes the data set that the class says.
    figure : ``module:name`` of a function in ``plots`` that draws what `to_json` gives, or the name of one of
        ``plots.figures``; empty where there is no picture.
    """

    package: str
    told: str
    figure: str = ""
    dataset: str = "described"

    def place(self, what: str) -> str:
        """Where the function stands that makes ``told``, ``to_dataset`` or ``figure``: ``module:name``."""
        of_json, of_result, name = {
            "told": ("tables.", "summary:", self.told),
            "to_dataset": ("", "to_dataset:", self.dataset),
            "figure": ("plots.", "plots.figures:", self.figure),
        }[what]
        in_lab = self.package.startswith(LAB)
        if ":" in name:
            return f"{self.package}.{'' if in_lab else of_json}{name}"
        return f"{'solver.views' if in_lab else self.package}.{of_result}{name}"

    def call(self, what: str, result: Any, *arguments: Any, **options: Any) -> Any:
        """Show a result: `what` is ``told``, ``to_dataset`` or ``figure``."""
        named = {"told": self.told, "to_dataset": self.dataset, "figure": self.figure}[what]
        given = result.to_json() if ":" in named else result
        return on_demand(self.place(what))(given, *arguments, **options)


def on_demand(place: str) -> Callable[..., Any]:
    """Load a function by its place, ``module:name``."""
    module, _, name = place.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function
