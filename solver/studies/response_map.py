"""The response over frequency and one parameter: `response_map`, and the ridge of its peaks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.parameter_scale import Scale, scale_of
from solver.errors import SettingError, check_count
from solver.jit.fourier import Integer, Real
from solver.jit.timer import clock
from solver.response.plausibility import band_end_at
from solver.response.solution import MEAN_UNDETERMINED
from solver.response.solve import known_of_solution, solve
from solver.results.known import NOTHING_KNOWN, Known
from solver.results.watch import part_of, shows_progress
from solver.scene.scene import Scene
from solver.studies.kernels.map_rows import GIVEN, MAX_ABS, RESIDUAL, ROW_VALUES, SOLVED, solve_row
from solver.studies.peaks.track_peak import track_peak
from solver.studies.peaks.track_results import PeakTrack, TrackStatus
from solver.studies.peaks.tracker import check_laws
from solver.studies.study_results import MapStatus, ResponseMap

MOST_POINTS = 4_000_000
OF_THE_GRID = 0.7  # share of the progress, where the peaks are tracked too
_WORK_OF_A_STRIP = 25_000  # frequencies × harmonics: 0.1 s, measured on bladed-disk
_MOST_STRIPS = 256
_SAME = 1e-6  # relative distance within which two solutions are one


@shows_progress("map")
def response_map(
    scene: Scene, parameter: str, start: float, stop: float, *, steps: int = 60, frequencies: int = 400,
    harmonics: int = 11, ridge: bool = True, effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None, should_stop: Callable[[], bool] | None = None,
) -> ResponseMap:  # fmt: skip
    """Solve the response on a grid over the scene's band and the range of one parameter.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``shroud.N0``.
    start, stop : its range in user units.
    steps, frequencies : points of the grid each way.
    harmonics : highest harmonic kept.
    ridge : track the peaks over the range too.
    effects : what is paid for though the scene does not call for it.
    on_progress : called with (share done, points so far).
    should_stop : asked between rows, and several times a second while peaks are looked for.

    Returns
    -------
    The map; every value in it is a converged solution at exactly its parameter and frequency.

    Raises
    ------
    SettingError
        A bad path, range, grid or number of harmonics, or a ridge asked for that cannot be tracked.
    """
    grid = map_grid(
        scene, parameter, start, stop, steps=steps, frequencies=frequencies, harmonics=harmonics,
        ridge=ridge, effects=effects,
    )  # fmt: skip
    strips: list[Strip] = []
    stopped = False
    of_a_row = (OF_THE_GRID if ridge else 1.0) / steps
    for first, last in grid.strips:
        progress = part_of(on_progress, first * of_a_row, last * of_a_row, first * frequencies)
        strips.append(grid.solve(first, last, on_progress=progress, should_stop=should_stop))
        stopped = strips[-1].stopped
        if stopped:
            break
    track = None
    if ridge and not stopped:
        tracked = part_of(on_progress, OF_THE_GRID, 1.0, steps * frequencies, counting=False)
        track = track_peak(
            scene, parameter, start, stop, harmonics=harmonics, effects=effects, on_progress=tracked,
            should_stop=should_stop,
        )  # fmt: skip
        stopped = track.status is TrackStatus.STOPPED
    found = grid.joined(strips, track)
    return replace(found, status=MapStatus.STOPPED) if stopped else found


@dataclass(frozen=True, slots=True, kw_only=True)
class Strip:
    """Some consecutive rows of a map."""

    first: Annotated[int, "Row of the map that is its first."]
    values: Annotated[
        Real, "Of `solver.studies.kernels.map_rows`, (rows, F, ROW_VALUES); NaN where no solution was found."
    ]
    newton_iterations: int
    seconds: float
    stopped: Annotated[bool, "Whether it was left before its last row."] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MapGrid:
    """The points of a map, in strips of rows that need nothing of each other.

    The division depends on the map alone, so that its numbers do not depend on who solves which strip.
    """

    scene: Annotated[Scene, "With the values that stay fixed."]
    scale: Annotated[Scale, "The parameter with its range."]
    steps: Annotated[int, "Points that way."]
    frequencies: Annotated[int, "Points the other way."]
    harmonics: int
    effects: Effects | None

    @property
    def band(self) -> Real:
        """(frequencies,) Hz."""
        return np.linspace(*self.scene.observe.band, self.frequencies)

    @property
    def strips(self) -> tuple[tuple[int, int], ...]:
        """First row and the one after the last of every strip; each is 0.1 s of work or more."""
        a_row = self.frequencies * max(self.harmonics, 1)
        rows = max(math.ceil(_WORK_OF_A_STRIP / a_row), math.ceil(self.steps / _MOST_STRIPS))
        return tuple((first, min(first + rows, self.steps)) for first in range(0, self.steps, rows))

    def solve(
        self,
        first: int,
        last: int,
        *,
        on_progress: Callable[[float, int], None] | None = None,
        should_stop: Callable[[], bool] | None = None,
    ) -> Strip:
        """Solve rows `first` to `last` - 1; a strip of `strips`, to get the numbers of the whole map.

        Parameters
        ----------
        first, last : rows.
        on_progress : called with (share of the strip done, its points so far).
        should_stop : asked between rows.
        """
        begun, spent = clock(), 0
        values, omegas = self.scale.spaced(self.steps), 2.0 * math.pi * self.band
        table = np.full((last - first, self.frequencies, ROW_VALUES), np.nan)
        before: tuple[Real, Integer] | None = None
        stopped = False
        for row in range(first, last):
            if should_stop is not None and should_stop():
                stopped = True
                break
            here = self.scene.with_values({self.scale.parameter.path: float(values[row])})
            workspace = Workspace.of(build(here, harmonics=self.harmonics, effects=self.effects))
            before, more = _row(workspace, omegas, before, table[row - first])
            spent += more
            if on_progress is not None:
                done = row - first + 1
                on_progress(done / (last - first), done * self.frequencies)
        return Strip(
            first=first, values=table, newton_iterations=spent, stopped=stopped,
            seconds=clock() - begun,
        )  # fmt: skip

    def joined(self, strips: Sequence[Strip], ridge: PeakTrack | None = None) -> ResponseMap:
        """Return the map of these strips; what is in none is empty. Its seconds are the sum of theirs."""
        table = np.full((self.steps, self.frequencies, ROW_VALUES), np.nan)
        for strip in strips:
            table[strip.first : strip.first + len(strip.values)] = strip.values
        solved = table[:, :, RESIDUAL][np.isfinite(table[:, :, RESIDUAL])]
        whole = bool(np.isfinite(table[:, :, MAX_ABS]).all())
        seconds = sum(strip.seconds for strip in strips) + (0.0 if ridge is None else ridge.seconds)
        return ResponseMap(
            scene=self.scene.name, parameter_path=self.scale.parameter.path, unit=self.scale.parameter.unit,
            parameter=self.scale.spaced(self.steps), frequency=self.band,
            amplitude=table[:, :, MAX_ABS].copy(), half_peak_to_peak=table[:, :, 1].copy(), ridge=ridge,
            n_harmonics=self.harmonics, largest_residual=float(solved.max(initial=0.0)),
            newton_iterations=sum(strip.newton_iterations for strip in strips),
            status=MapStatus.COMPLETED if whole else MapStatus.HOLES, seconds=seconds, given=self.scene,
            highest=self._highest(table[:, :, MAX_ABS]),
        )  # fmt: skip

    def _highest(self, amplitude: Real) -> Known:
        """Return how well the highest point is known, solved for alone; not, if that leads elsewhere."""
        if not np.isfinite(amplitude).any():
            return NOTHING_KNOWN
        row, column = np.unravel_index(int(np.nanargmax(amplitude)), amplitude.shape)
        here = self.scene.with_values({self.scale.parameter.path: float(self.scale.spaced(self.steps)[row])})
        hertz = float(self.band[column])
        if hertz == 0.0:
            return NOTHING_KNOWN
        point = solve(here, frequency_hz=hertz, harmonics=self.harmonics, effects=self.effects)
        known, height = known_of_solution(point), float(amplitude[row, column])
        same = abs(point.max_abs - height) <= _SAME * height or MEAN_UNDETERMINED in known.flags
        at_end = band_end_at(here, hertz, (float(self.band[0]), float(self.band[-1])))
        return replace(known if same else Known(flags=known.flags), notes=at_end)


def map_grid(
    scene: Scene, parameter: str, start: float, stop: float, *, steps: int = 60, frequencies: int = 400,
    harmonics: int = 11, ridge: bool = True, effects: Effects | None = None,
) -> MapGrid:  # fmt: skip
    """Return the points of `response_map`, to be solved in strips on several processors; errors as there."""
    for name, value in (("steps", steps), ("frequencies", frequencies)):
        check_count(name, value, 2)
    if steps * frequencies > MOST_POINTS:
        raise SettingError("steps", steps, f"times the frequencies must be at most {MOST_POINTS}")
    if ridge:
        check_laws(scene)
    return MapGrid(
        scene=scene, scale=scale_of(scene, parameter, start, stop), steps=steps, frequencies=frequencies,
        harmonics=harmonics, effects=effects,
    )  # fmt: skip


def _row(
    workspace: Workspace, omegas: Real, before: tuple[Real, Integer] | None, values: Real
) -> tuple[tuple[Real, Integer], int]:
    """Solve one row into `values`; return its solutions with what is known of them, and Newton iterations."""
    nt, count = workspace.balance.n_unknowns, omegas.size
    solutions, known = np.zeros((count, nt)), np.zeros(count, np.int64)
    if before is None or before[0].shape != solutions.shape:
        before = np.zeros((count, nt)), np.zeros(count, np.int64)
    at, spent = 0, 0
    while at < count:
        at, more = solve_row(
            workspace.system, workspace.linear, workspace.point, omegas, at, *before, solutions, known, values
        )
        spent += more
        if at == count:
            break
        if known[at] == GIVEN:
            # Not even from its own solution: the point stays empty.
            known[at], at = 0, at + 1
            continue
        found = workspace.solve(float(omegas[at]))
        spent += found.iterations
        if found.converged:
            solutions[at], known[at] = found.u, GIVEN
        else:
            at += 1
    for hole in np.flatnonzero((known[:-1] != SOLVED) & (known[1:] == SOLVED)).tolist():
        solutions[hole], known[hole] = solutions[hole + 1], GIVEN  # some only the next one leads to
        spent += solve_row(
            workspace.system, workspace.linear, workspace.point, omegas[: hole + 1], hole, *before, solutions,
            known, values,
        )[1]  # fmt: skip
    known[known != SOLVED] = 0
    return (solutions, known), spent
