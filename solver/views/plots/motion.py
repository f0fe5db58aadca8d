"""One period of a motion: its time history, the hysteresis loops of the contacts, its Floquet multipliers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from solver.arrays import Real
from solver.results import units
from solver.results.known import Measured
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers

if TYPE_CHECKING:
    from solver.marching.march_result import MarchResult
    from solver.response.solution import Solution
    from solver.response.stability.multipliers import Stability

MOST_LOOPS = 3
_SAMPLES = 1000
_FAR_DOWN = 1e-8  # share of the largest harmonic below which there is no bar


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """One contact over a period: slip motion [m] and friction force [N], (n,) each."""

    contact: str
    slip: Real
    force: Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """One period of a motion."""

    title: Annotated[str, "What it is of."]
    dof: Annotated[str, "The observed DOF."]
    time: Annotated[Real, "Instants from 0 to the end of the period [s], (n,)."]
    displacement: Annotated[Real, "Of the observed DOF [m], (n,)."]
    loops: Annotated[tuple[Loop, ...], "One for each contact; of a cyclic scene, those of one sector."]
    harmonics: Annotated[Real | None, "|mean| and the amplitudes of the observed DOF [m], (H + 1,)."] = None

    @classmethod
    def of_solution(cls, solution: Solution) -> Self:
        """The motion of a converged balance; the loops have the corners of the friction law."""
        from solver.jit.fourier import basis
        from solver.response.time_history import hysteresis_loop

        share = np.linspace(0.0, 1.0, _SAMPLES + 1)
        functions = basis(2.0 * np.pi * share, solution.highest_harmonic)
        return cls(
            title=f"{solution.scene.name} at {units.hertz(solution.frequency_hz)}, "
            f"{solution.n_harmonics} harmonics",
            dof=solution.scene.observe.dof,
            time=share / solution.frequency_hz,
            displacement=functions @ solution.observed,
            loops=tuple(
                _loop(contact.name, *hysteresis_loop(solution, contact.name, samples=_SAMPLES))
                for contact in solution.contacts
            ),
            harmonics=solution.harmonics,
        )

    @classmethod
    def of_march(cls, march: MarchResult, scene: str = "", dof: str = "x") -> Self:
        """The last period of a time march; it does not know what it is of."""
        period = 1.0 / march.frequency_hz
        # Of the whole annulus only the first sector is drawn: the others do the same later.
        first = [i for i, name in enumerate(march.contacts) if name.partition("@")[2] in ("", "0")]
        return cls(
            title=f"{scene or 'time march'} at {units.hertz(march.frequency_hz)}"
            f"{', time march' if scene else ''}",
            dof=dof,
            time=np.append(march.time, period),
            displacement=_closed(march.displacement),
            loops=tuple(
                _loop(march.contacts[i].partition("@")[0], march.slip[i], march.contact_force[i])
                for i in first
            ),
        )


def motion_figure(motion: Motion, *, ax: Into = None) -> Figure:
    """The time history; beside it the hysteresis loops of the contacts, three at most, and the harmonics.

    Parameters
    ----------
    motion : what is drawn.
    """
    loops = motion.loops[:MOST_LOOPS]
    bars = motion.harmonics is not None
    unit = units.shown_unit(float(np.abs(motion.displacement).max()))
    with style.styled():
        panels = 1 + len(loops) + bars
        # Four side by side would be too small in a column of text.
        rows, columns = (1, panels) if panels < 4 else (2, (panels + 1) // 2)
        page, (history, *others) = style.figure(
            0.6 + (2.6 if rows == 1 else 3.1) * columns, 2.9 * rows, columns, rows=rows, into=ax
        )  # fmt: skip
        for unused in others[panels - 1 :]:
            unused.set_axis_off()
        scale, second = (1e3, "ms") if motion.time[-1] < 0.1 else (1.0, "s")
        history.plot(motion.time * scale, motion.displacement * unit.per_one, color=style.BLUE)
        history.margins(x=0.0)
        history.set_title(motion.title)
        style.label(history, f"time [{second}]", f"displacement of {motion.dof} [{unit.name}]")
        for axes, loop in zip(others, loops, strict=False):
            slip = units.shown_unit(float(np.abs(loop.slip).max()))
            axes.plot(loop.slip * slip.per_one, loop.force, color=style.VERMILION)
            axes.set_title(f"contact {loop.contact}")
            style.label(axes, f"slip motion [{slip.name}]", "friction force [N]")
        if motion.harmonics is not None:
            _draw_harmonics(others[panels - 2], motion.harmonics, motion.dof, unit)
    return page


def harmonics_figure(heights: Real, title: str, *, dof: str = "x", ax: Into = None) -> Figure:
    """The harmonics alone, of a response whose motion is not known.

    Parameters
    ----------
    heights : (H + 1,) |mean| and the amplitudes [m].
    title : what it is of.
    dof : the observed DOF.
    """
    with style.styled():
        page, (axes,) = style.figure(5.0, 3.2, into=ax)
        _draw_harmonics(axes, heights, dof, units.shown_unit(float(np.nanmax(heights))))
        axes.set_title(title)
    return page


def _draw_harmonics(axes: Axes, heights: Real, dof: str, unit: units.ShownUnit) -> None:
    """Bars on a logarithmic scale; what is far below the largest is not drawn."""
    shown = np.where(heights >= _FAR_DOWN * np.nanmax(heights), heights, np.nan) * unit.per_one
    axes.bar(np.arange(heights.size), shown, color=style.BLUE, width=0.7)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(visible=False, axis="x")
    axes.set_xlim(-0.7, heights.size - 0.3)
    style.label(axes, "harmonic (0: mean)", f"amplitude of {dof} [{unit.name}]")


def _loop(contact: str, slip: Real, force: Real) -> Loop:
    return Loop(contact=contact, slip=_closed(slip), force=_closed(force))


def _closed(samples: Real) -> Real:
    """Samples of a period with the first repeated at its end."""
    return np.append(samples, samples[:1])


def multipliers_figure(found: Stability, *, ax: Into = None) -> Figure:
    """The multipliers and the unit circle, inside which perturbations die out.

    Parameters
    ----------
    found : of one response.
    """
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    outside = np.abs(found.multipliers) > 1.0
    with style.styled():
        page, (axes,) = style.figure(3.8, 3.6, into=ax)
        axes.plot(np.cos(around), np.sin(around), color=style.GREY, linewidth=0.9)
        for these, color, marker in ((~outside, style.BLUE, "o"), (outside, style.VERMILION, "D")):
            some = found.multipliers[these]
            axes.plot(some.real, some.imag, color=color, marker=marker, markersize=4.0, linestyle="none")
        axes.set_aspect("equal", adjustable="datalim")
        style.label(axes, "real part of the multiplier", "imaginary part")
        words = "stable" if found.stable else "not stable"
        axes.set_title(f"{units.hertz(found.frequency_hz)}, {words}")
    return page


def transient_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the extremes of the motion over time, and the amplitude over the frequency while that changes.

    The result is as its `to_json` gives it, with at least one window.
    """
    time, frequency, high, low = (numbers(found[name]) for name in ("time", "frequency_hz", "high", "low"))
    unit = units.shown_unit(found["max_abs"])
    high, low = high * unit.per_one, low * unit.per_one
    largest = found["max_abs"] * unit.per_one
    with style.styled():
        page, (over_time, over_frequency) = style.figure(9.2, 3.6, columns=2, into=ax)
        over_time.fill_between(time, low, high, color=style.BLUE, alpha=0.8, linewidth=0.0)
        over_time.axvline(found["at_seconds"], color=style.VERMILION, linewidth=0.8)
        rates = numbers(found.get("rates") or [])
        if rates.size:
            sizes = numbers(found["rates_max_abs"]) * unit.per_one
            over_frequency.semilogx(rates, sizes, "o-", color=style.BLUE, markersize=4.0)
            over_frequency.set_title(
                f"slowest: {unit.show(found['max_abs'])} at {units.hertz(found['at_hz'])}"
            )
            over_time.set_title(found["scene"])
            style.label(over_time, "time [s]", f"{found['dof']} [{unit.name}]")
            style.label(over_frequency, "rate [Hz/s]", f"largest |{found['dof']}| [{unit.name}]")
            return page
        ramp = time <= found["ramp_seconds"]
        over_frequency.plot(frequency[ramp], np.maximum(high, -low)[ramp], color=style.BLUE)
        over_frequency.plot([found["at_hz"]], [largest], "o", color=style.VERMILION, markersize=4.0)
        over_time.set_title(found["scene"])
        over_frequency.set_title(f"largest {unit.show(found['max_abs'])} at {units.hertz(found['at_hz'])}")
        style.label(over_time, "time [s]", f"{found['dof']} [{unit.name}]")
        style.label(
            over_frequency, "frequency [Hz]", f"{Measured(dof=found['dof']).name} in a turn [{unit.name}]"
        )
    return page
