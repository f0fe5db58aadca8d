"""What accuracy costs: error against time, one line for each way to evaluate the contact forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from solver.results import units
from solver.results.known import MAX_ABS, WORDS
from solver.views.plots import style
from solver.views.plots.style import Into

Row = Mapping[str, Any]

_CLOSED = (style.BLUE, "o", "-")
# From few samples to many; shape and dash tell them apart without colour.
_SAMPLED = (
    ("#B0B0B0", "v", ":"), (style.SKY, "s", "--"), (style.GREEN, "^", "-."), (style.VERMILION, "D", "--"),
    (style.INK, "P", ":"),
)  # fmt: skip


def accuracy_figure(study: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The rows of an accuracy study, as the JSON object a program reads."""
    rows: Sequence[Row] = study["rows"]
    least = max(study["reference_error"] or 0.0, 1e-15 * study["reference"])
    with style.styled():
        page, (axes,) = style.figure(6.6, 4.0, into=ax)
        exact = [row for row in rows if row["evaluator"] == "exact"]
        rows = [row for row in rows if row["evaluator"] != "exact"]
        counts = sorted({row["samples"] for row in rows})
        looks = [_CLOSED if count == 0 else _SAMPLED[i % len(_SAMPLED)] for i, count in enumerate(counts, -1)]
        for count, look in zip(counts, looks, strict=True):
            _draw(axes, [row for row in rows if row["samples"] == count], look, study["reference"], least)
        for row in exact:
            share = max(row["error"], least) / study["reference"]
            axes.plot(
                [row["milliseconds"]], [share], color=style.INK, marker="*", markersize=11,
                linestyle="none", label="exact",
            )  # fmt: skip
        axes.axhspan(
            0.0, least / study["reference"], color=style.GREY, alpha=0.15, linewidth=0.0, label="not known"
        )  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        style.plain_log(axes.xaxis)
        axes.yaxis.set_major_locator(LogLocator(numticks=12))
        axes.yaxis.set_minor_formatter(NullFormatter())
        style.label(
            axes, "processor time of a point by Newton's method [ms]", f"relative error of {WORDS[MAX_ABS]}"
        )
        axes.set_title(
            f"{study['scene']} at {units.hertz(study['frequency_hz'])}: {units.length(study['reference'])};"
            " the numbers are harmonics"
        )
        axes.margins(x=0.08, y=0.06)
        axes.legend(title="contact forces", loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")
    return page


def _draw(
    axes: Axes, rows: Sequence[Row], look: tuple[str, str, str], size: float, least: float
) -> None:  # fmt: skip
    """Draw one evaluator's rows in the order of their harmonics."""
    color, marker, dashes = look
    count = rows[0]["samples"]
    name = "closed form" if count == 0 else f"{count} samples"
    times = [row["milliseconds"] for row in rows]
    errors = [max(row["error"], least) / size for row in rows]
    axes.plot(
        times, errors, color=color, marker=marker, linestyle=dashes, markersize=4.5, label=name,
        linewidth=2.0 if count == 0 else 1.1, zorder=3 if count == 0 else 2,
    )  # fmt: skip
    if count == 0:
        for row, x, y in zip(rows, times, errors, strict=True):
            axes.annotate(
                str(row["harmonics"]), (x, y), xytext=(-3, -4), textcoords="offset points", ha="right",
                va="top", fontsize=7.5, color=color,
            )  # fmt: skip
