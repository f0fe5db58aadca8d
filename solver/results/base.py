"""What every result can do for who looks at it: a short text, a table in a notebook, arrays, a picture."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from solver.results.views import Views

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from solver.results.dataset import Dataset

Into: TypeAlias = "Axes | Sequence[Axes] | None"
"""Axes to draw into; None makes a new figure."""

_MOST = 30
_FEW = 6
_DIGITS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """What is most worth knowing of a result: a title, and names with their values."""

    title: str
    pairs: tuple[tuple[str, str], ...]


class Told(ABC):
    """Root of everything that is looked at: a short text, and a table in a notebook."""

    __slots__ = ()

    @abstractmethod
    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""

    def __repr__(self) -> str:
        found = self.summary()
        pairs = ", ".join(f"{name} {value}" for name, value in found.pairs)
        title = f" {found.title}" if found.title else ""
        return f"<{type(self).__name__}{title}: {pairs}>"

    def _repr_html_(self) -> str:
        """Return the summary as a table, for notebooks."""
        found = self.summary()
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td style='text-align:left'>{escape(value)}"
            "</td></tr>"
            for name, value in found.pairs[:_MOST]
        )
        caption = " · ".join(escape(part) for part in (type(self).__name__, found.title) if part)
        return f"<table><caption style='text-align:left'>{caption}</caption><tbody>{rows}</tbody></table>"


class Shown(Told):
    """Root of the results: each says what is worth knowing of it, and gives its arrays."""

    __slots__ = ()
    VIEWS: ClassVar[Views]

    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""
        found: Summary = self.VIEWS.call("summary", self)
        return found

    def to_dataset(self) -> Dataset:
        """The result as named arrays with dimensions, units and attributes; SI units."""
        found: Dataset = self.VIEWS.call("to_dataset", self)
        return found

    def to_pandas(self) -> pd.DataFrame:
        """The result as a table, in SI units; needs pandas (``pip install 'stickslip[data]'``)."""
        return self.to_dataset().to_pandas()

    def to_xarray(self) -> xr.Dataset:
        """The result as arrays with coordinates, units and attributes; needs xarray (the extra ``data``)."""
        return self.to_dataset().to_xarray()


class Drawn(Shown):
    """Root of the results that have a picture."""

    __slots__ = ()

    def plot(self, ax: Into = None) -> Figure:
        """Draw the result; `ax`: axes to draw into, else a new figure."""
        figure: Figure = self.VIEWS.call("plots.figures", self, ax)
        return figure


class Piece(Told):
    """A part of a result, a dataclass of a few numbers: its fields, arrays cut short."""

    __slots__ = ()
    UNITS: ClassVar[Mapping[str, str]] = {}

    def summary(self) -> Summary:
        """Every field with its unit."""
        units = self.UNITS
        given = [(one.name, getattr(self, one.name)) for one in fields(self)]  # type: ignore[arg-type]
        pairs = tuple((name, _words(value, units.get(name, ""))) for name, value in given)
        return Summary(title="", pairs=pairs)


def _words(value: object, unit: str) -> str:
    """A field in a few words."""
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, Told):
        return repr(value)
    if isinstance(value, float | np.floating):
        return f"{value:.6g} {unit}".rstrip()
    if isinstance(value, np.ndarray):
        if value.size > _FEW:
            return f"{' x '.join(map(str, value.shape))} numbers"
        return f"{np.array2string(value, precision=_DIGITS, separator=', ')} {unit}".rstrip()
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {_words(one, unit)}" for name, one in value.items()) or "none"
    if isinstance(value, tuple | list):
        if len(value) > _FEW:
            return f"{len(value)} of them"
        names = getattr(value, "_fields", None)
        said = [_words(one, unit) for one in value]
        return ", ".join(said if names is None else map(" ".join, zip(names, said, strict=True))) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return str(value)


def progress_bar(make: Callable[..., Any], **options: Any) -> Callable[[float, int], None]:
    """Turn a tqdm-like bar into what `on_progress` takes: ``on_progress=solver.progress_bar(tqdm)``.

    Parameters
    ----------
    make : makes a bar from ``total=`` and `options`, with ``update(by)``, ``close()`` and, where there is
        one, ``set_postfix_str(text)``: ``tqdm.tqdm``, ``tqdm.auto.tqdm`` or one of your own.
    options : for the bar, for example ``desc="sweep"``.

    Returns
    -------
    A function of (share done, count so far). It makes the bar when it is first called and closes it at 1.
    """
    bar: Any = None
    done = 0.0

    def report(share: float, count: int) -> None:
        nonlocal bar, done
        if bar is None:
            bar, done = make(total=1.0, **options), 0.0
        # A share may fall a little where a branch turns back; a bar cannot.
        by = max(min(share, 1.0) - done, 0.0)
        bar.update(by)
        done += by
        if hasattr(bar, "set_postfix_str"):
            bar.set_postfix_str(str(count))
        if done >= 1.0:
            bar.close()
            bar = None

    return report
