"""Cost against size: ports, harmonics, blades, modes and design variables, each with its fitted exponent.

`python -m benchmarks.exponents docs/img` also draws a picture of each, `cost-NAME.png`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import optim
import solver
from benchmarks.classes import lap_joint
from benchmarks.designing import FIVE
from benchmarks.harness import expect, table, timed
from benchmarks.mistuned import HARMONICS, disk_of
from benchmarks.problems import chain, graded_chain


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Work of growing size.

    Attributes
    ----------
    name, what : of the size, and what is done.
    sizes : that are measured.
    prepare : returns the call to be timed for a size; it returns whether it succeeded.
    runs : of which the shortest counts.
    """

    name: str
    what: str
    sizes: tuple[int, ...]
    prepare: Callable[[int], Callable[[], bool]]
    runs: int = 3


def _ports(size: int) -> Callable[[], bool]:
    scene = lap_joint(size // 3)
    return lambda: solver.solve(scene, frequency_hz=100.0, harmonics=3).converged


def _harmonics(size: int) -> Callable[[], bool]:
    scene = graded_chain(8)
    return lambda: solver.sweep(scene, harmonics=size).reached


def _blades(size: int) -> Callable[[], bool]:
    disk = disk_of(size, seed=10)
    return lambda: solver.blade_peaks(disk, harmonics=HARMONICS, every_branch=False).largest > 0.0


def _modes(size: int) -> Callable[[], bool]:
    scene = chain(size, sliders=False)
    return lambda: solver.sweep(scene, harmonics=5).reached


def _variables(size: int) -> Callable[[], bool]:
    variables, limits = FIVE["bladed-disk"]
    scene, some = solver.load_scene("bladed-disk"), dict(list(variables.items())[:size])
    return lambda: bool(np.isfinite(optim.design(scene, variables=some, **limits).peak.value))


FAMILIES = (
    Family(name="ports", what="lap joint in space, H = 3, a solve", sizes=(24, 48, 90, 183), prepare=_ports),
    Family(
        name="harmonics", what="8 masses with a slider each, a response", sizes=(5, 11, 21, 41),
        prepare=_harmonics,
    ),
    Family(
        name="blades", what="mistuned bladed-disk, H = 5, every blade's peak", sizes=(4, 6, 8, 12, 16),
        prepare=_blades, runs=1,
    ),
    Family(
        name="modes", what="masses with one slider, H = 5, a response", sizes=(8, 32, 128, 512),
        prepare=_modes,
    ),
    Family(
        name="variables", what="bladed-disk, peak with two limits, a design", sizes=(1, 2, 3, 4, 5),
        prepare=_variables, runs=1,
    ),
)  # fmt: skip


def measured(family: Family) -> tuple[list[float], float]:
    """Return the seconds of the process at each size, and the exponent fitted to them."""
    seconds = []
    for size in family.sizes:
        call = family.prepare(size)
        expect(f"{family.name} {size}: solved", call())
        seconds.append(timed(call, runs=family.runs, warm_up=0)[1].cpu)
    return seconds, float(np.polyfit(np.log(family.sizes), np.log(seconds), 1)[0])


def exponents(folder: Path | None = None) -> None:
    """Cost against ports, harmonics, blades, modes and variables, with fitted exponents."""
    rows = []
    for family in FAMILIES:
        seconds, exponent = measured(family)
        shown = ", ".join(f"{size}: {one:.3g}" for size, one in zip(family.sizes, seconds, strict=True))
        rows.append((family.name, family.what, shown, f"{exponent:.2f}"))
        if folder is not None:
            _draw(family, seconds, exponent, folder)
    table("Cost against size [s of the process]", ("size", "work", "seconds", "exponent"), rows)


def _draw(family: Family, seconds: list[float], exponent: float, folder: Path) -> None:
    from matplotlib.figure import Figure

    from solver.views.plots.style import BLUE, GREY, plain_log, styled

    with styled():
        page: Any = Figure(figsize=(4.2, 3.0), layout="constrained")
        axes = page.subplots()
        sizes = np.array(family.sizes, float)
        middle = np.exp(np.mean(np.log(seconds)) - exponent * np.mean(np.log(sizes)))
        axes.loglog(sizes, middle * sizes**exponent, color=GREY, linestyle="--")
        axes.loglog(sizes, seconds, color=BLUE, marker="o", linestyle="none")
        axes.set(xlabel=family.name, ylabel="time of the process [s]")
        axes.set_title(f"{family.what}\n$n^{{{exponent:.2f}}}$")
        plain_log(axes.yaxis)
        axes.set_xticks(sizes, [str(size) for size in family.sizes])
        axes.minorticks_off()
        page.savefig(folder / f"cost-{family.name}.png", dpi=90)


if __name__ == "__main__":
    exponents(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
