"""What shows a result: functions named as text, because they stand above the classes they show.

A class of result says which function puts it in words, which makes arrays of it and which draws it. They are
loaded when somebody asks: computing needs no Matplotlib, and results import nothing of what shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any


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
    package : where the modules ``summary``, ``to_dataset`` and ``plots.figures`` stand.
    summary, dataset : names of functions there; ``described`` makes the data set that the class says.
    figure : that of a function of ``plots.figures``, or ``module:name`` of one in ``plots`` that draws what
        `to_json` gives; empty where there is no picture.
    """

    package: str
    summary: str
    figure: str = ""
    dataset: str = "described"

    def call(self, what: str, result: Any, *arguments: Any, **options: Any) -> Any:
        """Show a result: `what` is ``summary``, ``to_dataset`` or ``plots.figures``."""
        name = {"summary": self.summary, "to_dataset": self.dataset, "plots.figures": self.figure}[what]
        if ":" in name:
            return on_demand(f"{self.package}.plots.{name}")(result.to_json(), *arguments, **options)
        return on_demand(f"{self.package}.{what}:{name}")(result, *arguments, **options)


def on_demand(place: str) -> Callable[..., Any]:
    """Load a function by its place, ``module:name``."""
    module, _, name = place.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function
