"""The response over frequency and one parameter: `response_map`, and the ridge of its peaks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from solver.balance import build
from solver.errors import SettingError
from solver.fourier import Integer, Real
from solver.kernels.rows import GIVEN, MAX_ABS, RESIDUAL, ROW_VALUES, SOLVED, solve_row
from solver.peak_tracks import PeakTrack, TrackStatus
from solver.ridges import check_laws
from solver.savings import Effects
from solver.scale import scale_of
from solver.scene import Scene
from solver.tracking import track_peak
from solver.workspace import Workspace

MOST_POINTS = 4_000_000
_OF_THE_GRID = 0.7  # share of the progress, where the peaks are tracked after it


class MapStatus(Enum):
    """How a map ended; the value is a sentence a user can act on."""

    COMPLETED = "Every point is a solution."
    HOLES = "Some points were not solved and are empty: use more harmonics or another range."
    STOPPED = "The map was stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseMap:
    """max|x| of the observed DOF over a parameter and the frequency.

    Attributes
    ----------
    scene, parameter_path, unit : str
        Name of the scene, path and unit of the parameter.
    parameter : (S,) array
        Its values, evenly spaced, or in equal ratios where the ends differ by more than a few times.
    frequency : (F,) array
        Hz, evenly spaced over the scene's band.
    amplitude, half_peak_to_peak : (S, F) arrays
        m; NaN where no solution was found.
    ridge : PeakTrack or None
        The tracked peaks over the same range, if asked for.
    largest_residual : float
        Of all points that are solved.
    """

    scene: str
    parameter_path: str
    unit: str
    parameter: Real
    frequency: Real
    amplitude: Real
    half_peak_to_peak: Real
    ridge: PeakTrack | None
    n_harmonics: int
    largest_residual: float
    newton_iterations: int
    status: MapStatus
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether every point is a solution."""
        return self.status is MapStatus.COMPLETED

    def to_json(self) -> dict[str, object]:
        """Return the map as one JSON object."""
        return {
            "scene": self.scene,
            "parameter": self.parameter.tolist(),
            "parameter_path": self.parameter_path,
            "unit": self.unit,
            "frequency": self.frequency.tolist(),
            "amplitude": _rows(self.amplitude),
            "half_peak_to_peak": _rows(self.half_peak_to_peak),
            "ridge": None if self.ridge is None else self.ridge.to_json(),
            "n_harmonics": self.n_harmonics,
            "newton_iterations": self.newton_iterations,
            "largest_residual": self.largest_residual,
            "seconds": self.seconds,
            "completed": self.completed,
            "status": self.status.value,
        }


def response_map(
    scene: Scene,
    parameter: str,
    start: float,
    stop: float,
    *,
    steps: int = 60,
    frequencies: int = 400,
    harmonics: int = 11,
    ridge: bool = True,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> ResponseMap:
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
    should_stop : asked between rows, and between the sweeps that look for peaks.

    Returns
    -------
    The map; every value in it is a converged solution at exactly its parameter and frequency.

    Raises
    ------
    SettingError
        A bad path, range, grid or number of harmonics, or a ridge asked for that cannot be tracked.
    """
    begun = time.perf_counter()
    for name, value in (("steps", steps), ("frequencies", frequencies)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 2:
            raise SettingError(name, value, "must be a whole number >= 2")
    if steps * frequencies > MOST_POINTS:
        raise SettingError("steps", steps, f"times the frequencies must be at most {MOST_POINTS}")
    if ridge:
        check_laws(scene)
    scale = scale_of(scene, parameter, start, stop)
    values = scale.spaced(steps)
    band = np.linspace(*scene.observe.band, frequencies)
    table, spent = np.full((steps, frequencies, ROW_VALUES), np.nan), 0
    before: tuple[Real, Integer] | None = None
    stopped = False
    for row, value in enumerate(values):
        if should_stop is not None and should_stop():
            stopped = True
            break
        here = scene.with_values({parameter: float(value)})
        workspace = Workspace.of(build(here, harmonics=harmonics, effects=effects))
        before, more = _row(workspace, 2.0 * math.pi * band, before, table[row])
        spent += more
        if on_progress is not None:
            on_progress((row + 1.0) / steps * (_OF_THE_GRID if ridge else 1.0), (row + 1) * frequencies)
    unsolved = not np.isfinite(table[:, :, MAX_ABS]).all()
    track = None
    if ridge and not stopped:

        def progress(share: float, _sweeps: int) -> None:
            if on_progress is not None:
                on_progress(_OF_THE_GRID + (1.0 - _OF_THE_GRID) * share, steps * frequencies)

        track = track_peak(
            scene, parameter, start, stop, harmonics=harmonics, effects=effects, on_progress=progress,
            should_stop=should_stop,
        )  # fmt: skip
        stopped = track.status is TrackStatus.STOPPED
    status = MapStatus.STOPPED if stopped else MapStatus.HOLES if unsolved else MapStatus.COMPLETED
    solved = table[:, :, RESIDUAL][np.isfinite(table[:, :, RESIDUAL])]
    return ResponseMap(
        scene=scene.name, parameter_path=parameter, unit=scale.parameter.unit, parameter=values,
        frequency=band, amplitude=table[:, :, MAX_ABS].copy(), half_peak_to_peak=table[:, :, 1].copy(),
        ridge=track, n_harmonics=harmonics, largest_residual=float(solved.max(initial=0.0)),
        newton_iterations=spent, status=status, seconds=time.perf_counter() - begun,
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
    known[known != SOLVED] = 0
    return (solutions, known), spent


def _rows(values: Real) -> list[list[float | None]]:
    """Return a grid as JSON can carry it (null for NaN)."""
    return [[value if math.isfinite(value) else None for value in row] for row in values.tolist()]
