"""The highest peak of a mistuned disk with its contacts solved, with derivatives by the blades' factors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.arrays import Real
from solver.continuation.branch import BranchStatus
from solver.errors import SettingError
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient
from solver.studies.blades import BladePeaks, blade_paths, blade_peaks, mistuned
from stickslip.lab.worst_mistuning.climbing import ALIKE, Bounds, WorstSearch
from stickslip.lab.worst_mistuning.linear_disk import TWO_PI, Contacts, DiskPeak, check_linear

FLAT = 1e-7  # rise of the logarithm of a peak at which a climb ends


class UnknownPeakError(Exception):
    """The response of a disk did not reach the end of its band, or it has none without damping."""

    def __init__(self, *, undamped: bool = False) -> None:
        super().__init__()
        self.undamped = undamped


@dataclass(frozen=True, slots=True, kw_only=True)
class Climbed:
    """What climbs with the contacts solved led to."""

    worst: Annotated[Real | None, "The worst pattern, (N,)."]
    known: Annotated[bool, "Whether every response covered the band."]
    alike: Annotated[int, "Climbs that ended at the height of the highest."]


class SolvedDisk:
    """A disk with its contacts solved, at one pattern after the other.

    Parameters
    ----------
    scene : cyclic, not mistuned.
    of : what the factors multiply.
    dof : the observed DOF of a sector.
    band : of the frequency [Hz].
    harmonics : highest one kept.
    should_stop : asked on the way.
    """

    def __init__(
        self, scene: Scene, of: Sequence[str], dof: str, band: tuple[float, float], harmonics: int,
        should_stop: ShouldStop,
    ) -> None:  # fmt: skip
        (self.scene, self.paths), self._of = blade_paths(scene, of), tuple(of)
        self.dof, self.band, self.harmonics = dof, band, harmonics
        self._should_stop = should_stop
        self._known: dict[bytes, DiskPeak] = {}
        self._last: tuple[bytes, BladePeaks] | None = None
        self.responses = 0

    @property
    def linear_limits(self) -> tuple[Contacts, ...]:
        """The linear limits it has, to begin from the worst patterns of."""
        found = []
        for contacts in (Contacts.STUCK, Contacts.OPEN) if self.scene.contacts else (Contacts.OPEN,):
            with suppress(SettingError):
                check_linear(self.scene, contacts)
                found.append(contacts)
        return tuple(found)

    def annulus(self, delta: Real) -> Scene:
        """Return the disk with the factors 1 + δ written out."""
        return mistuned(self.scene, of=self._of, values=(1.0 + delta).tolist())

    def peak(self, delta: Real) -> DiskPeak:
        """Return the highest peak of any blade; UnknownPeakError where the band is not covered."""
        key = delta.tobytes()
        if key not in self._known:
            self._peaks(delta)
        return self._known[key]

    def slopes(self, delta: Real) -> tuple[float, Real]:
        """Return the logarithm of the highest peak and its derivatives by δ, (N,); errors as `peak`."""
        found = self._peaks(delta)
        branch = found.branches[0] if len(found.branches) == 1 else found.worst_branch
        if branch is None or branch.peak is None:
            raise UnknownPeakError
        rows, here = self.paths, branch.balance.scene
        gradient = peak_gradient(Sensitivities(branch.balance, [p for row in rows for p in row]), branch.peak)
        by_path = gradient.gradient.reshape(len(rows), -1)
        moved = np.array([[here.value(path) for path in row] for row in rows])
        by_factor = (by_path * moved).sum(axis=1) / (1.0 + delta)
        return math.log(found.largest), np.asarray(by_factor / found.largest)

    def climbed(
        self,
        begins: Sequence[Real],
        drawn: Sequence[Real],
        bounds: Bounds,
        search: WorstSearch,
        go_on: Callable[[], bool],
    ) -> Climbed:
        """Return the worst pattern on climbs from the worst of some patterns, and from others.

        Parameters
        ----------
        begins : patterns, of the worst of which the climbs are that are not from drawn ones.
        drawn : patterns that are all climbed from.
        bounds : of δ.
        search : how many climbs, and how long.
        go_on : asked before each response.
        """
        tried: list[tuple[float, Real]] = []
        ends: list[float] = []
        known = True
        for delta in begins:
            if go_on():
                try:
                    tried.append((self.peak(delta).value, delta))
                except UnknownPeakError:
                    known = False
        ranked = [delta for _, delta in sorted(tried, key=lambda pair: -pair[0])]
        chosen = [*ranked[: search.climbs - len(drawn)], *drawn] if self.differentiable else []
        for begin in chosen if search.climb > 0 else []:
            found, complete = self._climb(begin, bounds, search.climb, go_on)
            tried += found
            ends += [max(value for value, _ in found)] if found else []
            known = known and complete
        worst = max(tried, key=lambda pair: pair[0])[1] if tried else None
        alike = sum(value >= (1.0 - ALIKE) * max(ends) for value in ends)
        return Climbed(worst=worst, known=known, alike=alike)

    def _climb(
        self, begin: Real, bounds: Bounds, most: int, go_on: Callable[[], bool]
    ) -> tuple[list[tuple[float, Real]], bool]:
        """Return the peaks on the way of a climb of so many responses, and whether all were known."""
        found: list[tuple[float, Real]] = []

        def rise(delta: Real) -> tuple[float, Real]:
            if len(found) >= most or not go_on():
                raise _ClimbEndedError
            value, slope = self.slopes(delta)
            found.append((math.exp(value), delta))
            return value, slope

        try:
            bounds.largest(rise, begin, most, FLAT)
        except _ClimbEndedError:
            pass
        except UnknownPeakError:
            return found, False
        return found, True

    @property
    def differentiable(self) -> bool:
        """Whether the factors are of parts with parameters: those of matrices have none."""
        return bool(self.paths)

    def _peaks(self, delta: Real) -> BladePeaks:
        key = delta.tobytes()
        if self._last is None or self._last[0] != key:
            self.responses += 1
            found = blade_peaks(
                self.annulus(delta), *self.band, dof=self.dof, harmonics=self.harmonics, every_branch=False,
                should_stop=self._should_stop,
            )  # fmt: skip
            if not math.isfinite(found.largest):
                raise UnknownPeakError(undamped=BranchStatus.UNDAMPED in found.status)
            at = TWO_PI * float(found.at_hz[found.worst])
            self._last = key, found
            self._known[key] = DiskPeak(value=found.largest, blade=found.worst, omega=at)
        return self._last[1]


class _ClimbEndedError(Exception):
    """All responses of a climb are used, or it is to be stopped."""
