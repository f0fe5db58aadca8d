"""Exact orbits over one parameter: a branch that no balance of harmonics stands behind."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.balance import check_harmonics
from solver.balance.balance import Kind, Parameter, check_fixed, resolve
from solver.continuation.branch import AnyBranch
from solver.continuation.branch import Bifurcations, Mark, MarkKind
from solver.continuation.branch import Peak
from solver.jit.fourier import Real
from solver.response.plausibility import band_end_of
from stickslip.lab.proofs.exact.answer import solve_beside
from stickslip.lab.proofs.exact.orbit import Orbit
from solver.response.solve import known_of_solution
from solver.response.solution import MEAN_UNDETERMINED, Solution
from solver.results.known import Known, Stable, Verdict
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class Point:
    """A response with the value it is at, and its orbit if there is one."""

    value: float
    solution: Solution
    orbit: Orbit | None

    @property
    def height(self) -> float:
        """The amplitude that peaks and bands are of [m]: max|x|, half the range where that is observed."""
        found = self.solution
        return found.half_peak_to_peak if found.scene.observe.centred else found.max_abs

    @property
    def motions(self) -> Real:
        """Coefficients of every relative motion of the contacts (n_ports, n) [m]."""
        return np.array([motion for each in self.solution.contacts for motion in each.motions])

    def peak(self, *, interior: bool) -> Peak:
        """It as a peak."""
        return Peak(
            value=self.height, at=self.value, solution=self.motions.ravel(), interior=interior
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Orbits:
    """The exact orbits of a scene as a function of one parameter."""

    scene: Annotated[Scene, "What vibrates, with the values that stay fixed."]
    parameter: Annotated[Parameter, "What is varied."]
    n_harmonics: Annotated[int, "How many are given of each motion, at least."]
    frequency_hz: Annotated[float, "NaN if it is the parameter."]

    @classmethod
    def of(cls, scene: Scene, path: str, harmonics: int, frequency_hz: float | None) -> Orbits:
        """Return those over a path; SettingError for one unknown, a bad frequency or harmonics."""
        parameter, fixed = resolve(scene, path), math.nan
        if parameter.kind is not Kind.FREQUENCY:
            fixed = check_fixed(path, frequency_hz)
            scene = scene.at_frequency(fixed)
        return cls(
            scene=scene, parameter=parameter, n_harmonics=check_harmonics(harmonics), frequency_hz=fixed
        )  # fmt: skip

    def at(self, value: float, near: Point | None = None) -> Point:
        """Return the response at a value, looked for beside another."""
        scene, hertz = self.scene, value
        if self.parameter.kind is not Kind.FREQUENCY:
            scene, hertz = scene.with_values({self.parameter.path: value}), self.frequency_hz
        beside = None if near is None else near.orbit
        return Point(value, *solve_beside(scene, hertz, self.n_harmonics, beside))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ExactBranch(AnyBranch):
    """Exact periodic responses over one parameter, from event to event: that of scenes with rigid contacts.

    Flags are ``mean_undetermined`` and ``history_dependent`` where they hold at some point: there `amplitude`
    is that after a start from rest, or after a slow change of the parameter where rest takes long to forget.
    """

    orbits: Annotated[Orbits, "What was followed; its scene holds the values that stayed fixed."]
    solutions: Annotated[tuple[Solution, ...], "The response at each point, as `solve` gives it."]
    highest: Annotated[Solution | None, "The response at the highest peak."]
    beyond: Annotated[Solution | None, "Why the branch ended before the end of the range."]
    verdicts: Annotated[tuple[Verdict, ...], "Of the stability at each of `peaks`."]

    @property
    def posed(self) -> Orbits:
        """The orbits."""
        return self.orbits

    @property
    def coefficients(self) -> Real:
        """Coefficients of every relative motion of the contacts at each point, (P, n_ports, n) [m]."""
        return np.array([Point(0.0, each, None).motions for each in self.solutions])

    @property
    def mean_undetermined(self) -> bool | None:
        """As `solve` says it of the highest peak."""
        return None if self.highest is None else MEAN_UNDETERMINED in self.highest.flags

    @property
    def known(self) -> Known:
        """As that of the response at the highest peak; between points no peak is excluded."""
        if self.highest is None:
            return Known(flags=self.flags)
        found = known_of_solution(self.highest)
        return replace(
            found, notes=band_end_of(self), peaks_open=(self.peak_certificate.reason,)
        )  # fmt: skip

    @property
    def peak_stability(self) -> tuple[Verdict, ...]:
        """By the Floquet multipliers of each orbit."""
        return self.verdicts

    @property
    def drift_per_period(self) -> float:
        """That of the response beyond the last point."""
        return self.beyond.drift_per_period if self.ratchets and self.beyond is not None else math.nan

    @property
    def bifurcations(self) -> Bifurcations:
        """By the Floquet multipliers of every orbit; the end, if it is early, is all that is marked."""
        marks: tuple[Mark, ...] = ()
        if not self.reached and self.solutions:
            at, u = float(self.values[-1]), Point(0.0, self.solutions[-1], None).motions.ravel()
            marks = (
                Mark(kind=MarkKind.END, at=at, amplitude=float(self.amplitude[-1]),
                     solution=np.append(u, self.orbits.parameter.inside(at)), after=len(self.values) - 1,
                     why=self.status.value),
            )  # fmt: skip
        unstable = np.array([each.stable is Stable.NO for each in self.solutions], dtype=np.bool_)
        return Bifurcations(
            unstable=unstable, marks=marks, known_by="multipliers", parameter=self.parameter, seconds=0.0
        )  # fmt: skip
