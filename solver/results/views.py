"""What shows a result: functions named as text, because they stand above the classes they show.

A class of result says which function puts it in words, which makes arrays of it and which draws it. They are
loaded when somebody asks: computing needs no Matplotlib, and results import nothing of what shows them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True, slots=True)
class Views:
    """The functions that show a class of result.

    Parameters
    ----------
    package : where the modules ``summary``, ``to_dataset`` and ``plots.figures`` stand.
    summary, dataset : names of functions there.
    figure : that of a function of ``plots.figures``, or ``module:name`` of one in ``plots`` that draws what
        `to_json` gives; empty where there is no picture.
    """

    package: str
    summary: str
    dataset: str
    figure: str = ""

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
