"""One period of a motion: its time history and the hysteresis loops of the contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from matplotlib.figure import Figure

from solver import units
from solver.plots import style
from solver.plots.curves import FloatArray

if TYPE_CHECKING:
    from solver.march_result import MarchResult
    from solver.response import Solution

MOST_LOOPS = 3
_SAMPLES = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """One contact over a period: slip motion [m] and friction force [N], (n,) each."""

    contact: str
    slip: FloatArray
    force: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """One period of a motion.

    Attributes
    ----------
    title : str
        What it is of.
    dof : str
        The observed DOF.
    time : (n,) array
        Instants from 0 to the end of the period [s].
    displacement : (n,) array
        Of the observed DOF [m].
    loops : tuple of Loop
        One for each contact; of a cyclic scene, those of one sector.
    """

    title: str
    dof: str
    time: FloatArray
    displacement: FloatArray
    loops: tuple[Loop, ...]

    @classmethod
    def of_solution(cls, solution: Solution) -> Self:
        """The motion of a converged balance; the loops have the corners of the friction law."""
        from solver.fourier import basis
        from solver.histories import hysteresis_loop

        share = np.linspace(0.0, 1.0, _SAMPLES + 1)
        functions = basis(2.0 * np.pi * share, solution.n_harmonics)
        return cls(
            title=f"{solution.scene.name} at {solution.frequency_hz:g} Hz, {solution.n_harmonics} harmonics",
            dof=solution.scene.observe.dof,
            time=share / solution.frequency_hz,
            displacement=functions @ solution.observed,
            loops=tuple(
                _loop(contact.name, *hysteresis_loop(solution, contact.name, samples=_SAMPLES))
                for contact in solution.contacts
            ),
        )

    @classmethod
    def of_march(cls, march: MarchResult, scene: str, dof: str) -> Self:
        """The last period of a time march."""
        period = 1.0 / march.frequency_hz
        # Of the whole annulus only the first sector is drawn: the others do the same later.
        first = [i for i, name in enumerate(march.contacts) if name.partition("@")[2] in ("", "0")]
        return cls(
            title=f"{scene} at {march.frequency_hz:g} Hz, time march",
            dof=dof,
            time=np.append(march.time, period),
            displacement=_closed(march.displacement),
            loops=tuple(
                _loop(march.contacts[i].partition("@")[0], march.slip[i], march.contact_force[i])
                for i in first
            ),
        )


def motion_figure(motion: Motion, *, ax: style.Into = None) -> Figure:
    """The time history of the observed DOF; beside it the hysteresis loops of the contacts, three at most."""
    loops = motion.loops[:MOST_LOOPS]
    unit = units.length_unit(float(np.abs(motion.displacement).max()))
    with style.styled():
        page, (history, *others) = style.figure(3.2 + 2.6 * len(loops), 2.9, columns=1 + len(loops), into=ax)
        scale, second = (1e3, "ms") if motion.time[-1] < 0.1 else (1.0, "s")
        history.plot(motion.time * scale, motion.displacement * unit.per_metre, color=style.BLUE)
        history.margins(x=0.0)
        history.set_title(motion.title)
        style.label(history, f"time [{second}]", f"displacement of {motion.dof} [{unit.name}]")
        for axes, loop in zip(others, loops, strict=True):
            slip = units.length_unit(float(np.abs(loop.slip).max()))
            axes.plot(loop.slip * slip.per_metre, loop.force, color=style.VERMILION)
            axes.set_title(f"contact {loop.contact}")
            style.label(axes, f"slip motion [{slip.name}]", "friction force [N]")
    return page


def _loop(contact: str, slip: FloatArray, force: FloatArray) -> Loop:
    return Loop(contact=contact, slip=_closed(slip), force=_closed(force))


def _closed(samples: FloatArray) -> FloatArray:
    """Samples of a period with the first repeated at its end."""
    return np.append(samples, samples[:1])
