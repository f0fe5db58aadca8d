"""What every result can do for who looks at it: a short text, a table in a notebook, arrays, a picture."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar

from solver.first_use import on_demand
from solver.lab import LAB
from solver.results.known import Known, Note, worst_of
from solver.results.told import Block, Summary, Told

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from solver.results.files import Dataset


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
    """The functions that show a class of result, named as text: they stand above the classes they show.

    They are loaded when somebody asks: computing needs no Matplotlib, and results import nothing of them.

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


class Shown(Told):
    """Root of the results: each says what is worth knowing of it, and gives its arrays."""

    __slots__ = ()
    VIEWS: ClassVar[Views]
    DATA: ClassVar[Data]
    status: Any
    """How it ended, of those that may fall short; the first of its kind says that nothing is missing."""

    @property
    def reached(self) -> bool:
        """Whether all that was asked for is there, as the status says."""
        kinds: type[Enum] = type(self.status)
        return self.status is next(iter(kinds))

    @property
    def completed(self) -> bool:
        """`reached`, as it was called before; goes with 0.2."""
        import warnings

        warnings.warn("result.completed is result.reached now", DeprecationWarning, stacklevel=2)
        return self.reached

    def blocks(self) -> Sequence[Block]:
        """What people read of it: names with values, and tables."""
        return tuple(self.VIEWS.call("told", self)) if hasattr(self, "VIEWS") else super().blocks()

    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units; the last line is the status."""
        blocks = self.blocks()
        pairs = [(name.strip(), value) for block in blocks for name, value in block.pairs]
        status = getattr(self, "status", None)
        ended = [("status", status.value)] if isinstance(status, Enum) else []
        return Summary(blocks[0].title, (*pairs, *ended))

    def to_dataset(self) -> Dataset:
        """The result as named arrays with dimensions, units and attributes; SI units."""
        found: Dataset = self.VIEWS.call("to_dataset", self)
        return found

    def to_pandas(self) -> pd.DataFrame:
        """The result as a table, in SI units; needs pandas (``pip install 'stickslip[data]'``)."""
        return self.to_dataset().to_pandas()

    def to_polars(self) -> pl.DataFrame:
        """The result as a table of polars, in SI units (``pip install 'stickslip[polars]'``)."""
        return self.to_dataset().to_polars()

    def to_xarray(self) -> xr.Dataset:
        """The result as arrays with coordinates, units and attributes; needs xarray (the extra ``data``)."""
        return self.to_dataset().to_xarray()


class MadeOfResponses(Shown):
    """Root of the results made of responses: their errors and flags are in every form it is given in.

    A class says of which responses it is made; it cannot leave them out.
    """

    __slots__ = ()
    READ: ClassVar = {"known": Known.of_result}

    @abstractmethod
    def known_parts(self) -> Iterable[Known]:
        """How well each of the responses is known that the numbers stand on."""

    @property
    def of_scene(self) -> tuple[Note, ...]:
        """What of the scene is hardly meant, where a study is the first to be asked of one."""
        return ()

    @property
    def known(self) -> Known:
        """How well the numbers are known: the largest error of a response relative to its peak, all flags."""
        found = worst_of(self.known_parts())
        return replace(found, notes=(*found.notes, *self.of_scene))

    def blocks(self) -> Sequence[Block]:
        """What people read of it: names with values, and tables."""
        blocks = super().blocks()
        said = {value for block in blocks for _, value in block.pairs}
        further = [pair for pair in self.known.pairs() if pair[1] not in said]
        return (*blocks, Summary("", further)) if further else blocks

    def to_dataset(self) -> Dataset:
        """The result as named arrays with dimensions, units and attributes; SI units."""
        found = super().to_dataset()
        told = {name: value for name, value in self.known.to_json().items() if value is not None}
        notes: dict[str, Any] = {
            name: _in_words(value) if isinstance(value, list) else value for name, value in told.items()
        }
        return replace(found, attributes={**found.attributes, **notes})

    def _json(self, **others: object) -> dict[str, Any]:
        return super()._json(**others) | self.known.to_json()


def _in_words(several: Sequence[Any]) -> str:
    """Flags, notes or reasons as an attribute."""
    return " ".join(one["words"] if isinstance(one, dict) else one for one in several)


class Drawn(Shown):
    """Root of the results that have a picture."""

    __slots__ = ()

    def plot(self, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw the result; `ax`: axes to draw into, else a new figure."""
        figure: Figure = self.VIEWS.call("figure", self, ax=ax)
        return figure


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
