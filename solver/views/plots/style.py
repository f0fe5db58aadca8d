"""How every picture looks, and how it is written."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from solver.errors import SettingError
from solver.results import units
from solver.scene.parameter_paths import parameter_unit

# Okabe and Ito's colours, which the colour-blind can tell apart (jfly.uni-koeln.de/color).
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
SKY = "#56B4E9"
INK, GREY = "#222222", "#7A7A7A"


Into: TypeAlias = Axes | Sequence[Axes] | None
"""Axes to draw into; None makes a new figure."""

DOTS_PER_INCH = 200
_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "mathtext.fontset": "dejavusans",
    "text.color": INK,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titlepad": 8.0,
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ECECEC",
    "grid.linewidth": 0.6,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.width": 0.5,
    "ytick.minor.width": 0.5,
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 1.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "stickslip",
    "pdf.fonttype": 42,
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the house style inside the block."""
    with mpl.rc_context(_STYLE):
        yield


class Picture(Figure):
    """A figure that notebooks show, though no window system looks after it."""

    def _repr_png_(self) -> bytes:
        return written(self, "png")


def figure(
    width: float, height: float, columns: int = 1, *, rows: int = 1, into: Into = None
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Axes side by side or in rows, empty; call it inside `styled`.

    Parameters
    ----------
    width, height : inches of a new figure.
    columns, rows : how many axes.
    into : axes of the caller's to draw into, instead of a new figure; of a picture with more axes than are
        given, the first ones are drawn.
    """
    page: Figure = Picture(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(page)
    axes = list(page.subplots(rows, columns, squeeze=False).ravel())
    if into is None:
        return page, axes
    given = [into] if isinstance(into, Axes) else list(into)
    if not given or not all(isinstance(one, Axes) for one in given):
        raise SettingError("ax", into, "must be an Axes, or several of one figure")
    mine = given[0].get_figure(root=True)
    # What does not fit is drawn on the new figure, which nobody sees.
    return page if mine is None else mine, [*given[: len(axes)], *axes[len(given) :]]


def label(axes: Axes, x: str, y: str) -> None:
    """Name both axes."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def quantity(path: str, value: float, digits: int) -> str:
    """A parameter value with its unit, rounded for a picture."""
    return f"{units.number(value, digits)} {parameter_unit(path)}".rstrip()


def plain_log(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers, as many as fit."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=9))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def written(page: Figure, suffix: str) -> bytes:
    """Return the bytes of a picture in the format `svg` or `png`."""
    buffer = io.BytesIO()
    write(page, buffer, suffix)
    return buffer.getvalue()


def write(page: Figure, file: Path | io.BytesIO, suffix: str) -> None:
    """Write a picture in a format of Matplotlib."""
    # No date in the file: the same picture gives the same bytes.
    date = "CreationDate" if suffix == "pdf" else "Date"
    metadata = {} if suffix == "png" else {date: None}
    with styled():
        page.savefig(file, format=suffix, dpi=DOTS_PER_INCH, metadata=metadata)
