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
    package : where ``tables``, ``summary``, ``to_dataset`` and ``plots.figures`` stand; a folder of the lab
        has its functions in ``tables`` and ``pictures``, and names them alone.
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
        if not self.package.startswith(LAB):
            return f"{self.package}.{of_json if ':' in name else of_result}{name}"
        of_json = {"told": "tables", "figure": "pictures"}.get(what, "")
        return f"{self.package}.{of_json}:{name}" if of_json else f"solver.views.{of_result}{name}"

    def call(self, what: str, result: Any, *arguments: Any, **options: Any) -> Any:
        """Show a result: `what` is ``told``, ``to_dataset`` or ``figure``."""
        place = self.place(what)
        of_result = place.rpartition(".")[2].partition(":")[0] in ("summary", "to_dataset", "figures")
        return on_demand(place)(result if of_result else result.to_json(), *arguments, **options)


def on_demand(place: str) -> Callable[..., Any]:
    """Load a function by its place, ``module:name``."""
    module, _, name = place.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function
