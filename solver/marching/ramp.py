"""A scene whose frequency changes linearly in time: its equations, and what changes with the frequency.

Time is the angle τ = ω₁ t of the highest frequency f₁ of the run, ω₁ = 2π f₁. From f₀ on at the rate a [Hz/s]
the excitation turns by φ = 2π (f₀ t + a t²/2). Along an engine-order line loads, forces and matrices are
polynomials of the second degree of the frequency, and so of τ: three scenes on the line give them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.arrays import Real
from solver.errors import SettingError
from solver.marching.contacts import as_sparse
from solver.marching.kernels import march_state as kernel
from solver.marching.march import whole
from solver.marching.march_base import base_over
from solver.marching.march_equations import MarchEquations, equations_of_motion
from solver.scene.scene import Scene

_POWERS = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [2.0, -4.0, 2.0]])
"""Coefficients of a polynomial of the second degree from its values at 0, 1/2 and 1."""
_BETWEEN = 2.0  # more than such a polynomial is between them, over the largest of the three


@dataclass(frozen=True, slots=True)
class Ramp:
    """A part of a run in which the frequency changes linearly."""

    begin_hz: Annotated[float, "Frequency where it begins [Hz]."]
    end_hz: Annotated[float, "Frequency where it ends [Hz]."]
    seconds: Annotated[float, "How long it takes [s]."]
    driven: Annotated[bool, "Whether forces of harmonics from 1 on act."] = True

    def cycles(self, seconds: NDArray[Any]) -> Real:
        """Turns of the excitation since it began, at times since then [s]."""
        rate = (self.end_hz - self.begin_hz) / self.seconds
        return np.asarray((self.begin_hz + 0.5 * rate * seconds) * seconds)

    def frequency(self, seconds: NDArray[Any]) -> Real:
        """Frequency [Hz] at times since it began [s]."""
        return np.asarray(self.begin_hz + (self.end_hz - self.begin_hz) / self.seconds * seconds)


def check(scene: Scene) -> None:
    """Raise SettingError where a scene cannot be followed while its frequency changes."""
    scene.observe.check_whole("a run through a range of frequencies")
    if scene.rigid_contact is not None:
        wanted = "must have a finite stiffness in a run through a range of frequencies"
        raise SettingError("scene", f"contact {scene.rigid_contact}", wanted)


def equations_over(scene: Scene, ramp: Ramp, omega: float, turned: float) -> MarchEquations:
    """Return the equations of a ramp.

    Parameters
    ----------
    omega : of the unit of time, τ = omega t [rad/s].
    turned : cycles of the excitation before.

    Raises
    ------
    SettingError
        The scene cannot be marched.
    """
    end = ramp.seconds * omega
    hertz = np.linspace(ramp.begin_hz, ramp.end_hz, 3)
    first = equations_of_motion(whole(scene.at_frequency(float(hertz[0]))), omega, swept=ramp.driven)
    system = first.system
    rate = 0.5 * (ramp.end_hz - ramp.begin_hz) / ramp.seconds * 2.0 * math.pi / omega**2
    turn = np.array([2.0 * math.pi * math.fmod(turned, 1.0), 2.0 * math.pi * ramp.begin_hz / omega, rate])
    system = system._replace(turn=turn)
    if scene.speed_order is not None and ramp.begin_hz != ramp.end_hz:
        rest = (
            equations_of_motion(whole(scene.at_frequency(float(f))), omega, swept=ramp.driven).system
            for f in hertz[1:]
        )
        system = _following([system, *rest], end)
    if ramp.driven and any(force.base for force in scene.excitation):
        ends = [[e.amplitude for e in scene.at_frequency(f).excitation if e.base] for f in hertz[[0, 2]]]
        if ends[0] != ends[1]:
            wanted = "must not follow the speed in a run through a range of frequencies"
            raise SettingError("excitation", "amplitude of a base", wanted)
        system = base_over(whole(scene), system, float(turn[1]), 2.0 * rate)
    if not ramp.driven:
        off = np.where(system.force_harmonic == 0, system.force_amplitude, 0.0)
        system = system._replace(force_amplitude=off)
    return replace(first, system=system)


def _following(systems: list[kernel.System], end: float) -> kernel.System:
    """Return the first of three systems, evenly from τ = 0 to `end`, with what changes from there on."""
    scale = end ** -np.arange(3.0)

    def polynomial(values: Sequence[Real]) -> Real:
        found = np.tensordot(_POWERS, np.array(values), axes=1)
        return np.asarray(found * scale.reshape(-1, *[1] * (found.ndim - 1)))

    def gained(name: str) -> Real:
        return polynomial([getattr(each, name) for each in systems])[1:]

    first = systems[0]
    A, A_course = _matrices([each.A for each in systems], polynomial)
    B, B_course = _matrices([each.B for each in systems], polynomial)
    swing = np.max([each.swing + np.abs(each.N0 - first.N0) for each in systems], axis=0)
    return first._replace(
        A=A, B=B, A_course=A_course, B_course=B_course, N0_course=gained("N0"), rest_course=gained("rest"),
        waves_course=gained("waves"), force_course=gained("force_amplitude"), swing=_BETWEEN * swing,
    )  # fmt: skip


def _matrices(
    given: list[kernel.SparseRows], polynomial: Callable[[Sequence[Real]], Real]
) -> tuple[kernel.SparseRows, Real]:
    """The first of three matrices on the pattern of all, and its coefficients; none if all are equal."""
    n = given[0].start.size - 1
    found = [as_sparse(each, n) for each in given]
    if all(abs(each - found[0]).nnz == 0 or abs(each - found[0]).max() == 0.0 for each in found[1:]):
        return given[0], np.empty((2, 0))
    pattern = csr_array(sum(abs(each) for each in found))
    pattern.sort_indices()
    row, column = pattern.nonzero()
    values = [each.toarray()[row, column] for each in found]
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    return kernel.SparseRows(start.astype(np.int64), column.astype(np.int64), values[0].copy()), polynomial(
        values
    )
