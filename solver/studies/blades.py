"""Mistuned disks: blades that are not quite equal, and how much more the worst of them moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from solver.contacts.kernels.stick_slip_events import largest
from solver.continuation.branch import Branch, BranchStatus
from solver.continuation.branches.observation import highest_peaks, observing
from solver.continuation.branches.sweep import sampled, sweep
from solver.continuation.walk import ContinuationSettings
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.trig_polynomial import grid_size, grid_tables, on_grid
from solver.response.solution import Solution
from solver.response.time_history import motion
from solver.results.base import Data, Drawn, MadeOfResponses, Views
from solver.results.known import NOTHING_KNOWN, OF_X, Known, Measured
from solver.results.watch import shows_progress
from solver.scene.cyclic.annulus import annulus, sectors_needed
from solver.scene.parameter_paths import STRUCTURE, named_parts
from solver.scene.scene import Scene
from solver.scene.scene_records import CyclicStructure, LumpedStructure, Mass, MatricesStructure
from solver.wording import listing, nearest

_ONE_MASS = LumpedStructure(kind="lumped", masses=(Mass(dof="x", m=1.0),))  # stands in for a large structure
_OF_THE_SWEEP = 0.4  # share of the time; the rest looks for the peaks of the other blades


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BladeAmplitudes(Drawn):
    """The motion of one DOF in every sector."""

    VIEWS: ClassVar = Views("solver.views", "of_amplitudes", "of_amplitudes")
    DATA: ClassVar = Data(
        "blades", {"sector": "max_abs half_peak_to_peak"}, status="solved", scene="", index="sector",
    )  # fmt: skip

    dof: Annotated[str, "Its name in one sector."]
    max_abs: Annotated[Real, "Over the period [m], (sectors,)."]
    half_peak_to_peak: Annotated[Real, "Over the period [m], (sectors,)."]

    @property
    def largest(self) -> float:
        """Largest max|x| of all blades [m]."""
        return float(self.max_abs.max())

    @property
    def worst(self) -> int:
        """The sector that has it."""
        return int(self.max_abs.argmax())

    def magnification(self, tuned: Solution | BladeAmplitudes) -> float:
        """Largest amplitude relative to that of another disk, usually the tuned one."""
        return self.largest / (tuned.largest if isinstance(tuned, BladeAmplitudes) else tuned.max_abs)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BladePeaks(MadeOfResponses, Drawn):
    """The highest peak of one DOF in every sector over a range of the frequency."""

    VIEWS: ClassVar = Views("solver.views", "of_blade_peaks", "of_blade_peaks")
    DATA: ClassVar = Data(
        "blade-peaks", {"sector": "peak=value frequency=at_hz status"}, status="solved", scene="",
        index="sector",
    )  # fmt: skip
    JSON: ClassVar = "dof measured peaks=value at_hz status"

    dof: Annotated[str, "Its name in one sector."]
    value: Annotated[
        Real, "Largest max|x| [m]; NaN where the branch did not reach the end of the range, (sectors,)."
    ]
    at_hz: Annotated[Real, "Where [Hz], (sectors,)."]
    status: Annotated[tuple[BranchStatus, ...], "How each sector's branch ended."]
    branches: Annotated[
        tuple[Branch, ...],
        "The response of each blade, the same one where all are alike; without those that were not "
        "reached. Where no more was asked for, of the blade with the highest peak alone, with the peaks "
        "that may be it.",
    ]
    highest: Annotated[Known, "How well the highest peak of all is known."] = NOTHING_KNOWN
    measured: Annotated[Measured, "What the peaks are of."] = OF_X

    @property
    def reached(self) -> bool:
        """Whether the peak of every blade is known."""
        return all(status is BranchStatus.COMPLETED for status in self.status)

    @property
    def largest(self) -> float:
        """Highest peak of all blades [m]; NaN if one is not known."""
        return float(self.value.max())

    @property
    def worst(self) -> int:
        """The sector that has it."""
        return int(self.value.argmax())

    @property
    def worst_branch(self) -> Branch | None:
        """The response of the blade with the highest peak; None if one is not known or none moves."""
        if not self.largest > 0.0:
            return None
        if len(self.branches) == len(self.value):
            return self.branches[self.worst]
        return observing(self.branches[0], self.branches[0].balance.scene.observe.dof)

    def known_parts(self) -> Iterable[Known]:
        """The response of the blade with the highest peak."""
        return (self.highest,)

    def magnification(self, tuned: BladePeaks) -> float:
        """The amplitude magnification factor: the highest peak relative to that of the tuned disk."""
        return self.largest / tuned.largest


@shows_progress("blades")
def blade_peaks(
    scene: Scene,
    start: float | None = None,
    stop: float | None = None,
    *,
    dof: str | None = None,
    harmonics: int = 11,
    settings: ContinuationSettings | None = None,
    every_branch: bool = True,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> BladePeaks:
    """Return the highest peak of every blade, all from one sweep of the frequency.

    Parameters
    ----------
    scene : an annulus, or a cyclic scene.
    start, stop : the range [Hz], the scene's band if left out.
    dof : name of the DOF in one sector; the observed one if left out.
    harmonics : highest harmonic kept.
    settings : of the continuation.
    every_branch : whether to make the whole response of every blade, with all of its peaks and its error
        estimate; else `branches` has that of one blade alone, in a fraction of the time.
    on_progress : called with (share done, blades so far).
    should_stop : asked between stretches of the sweep and between blades.

    Raises
    ------
    SettingError
        No sector has such a DOF, or a bad range or number of harmonics.
    """
    name = scene.observe.dof.partition("@")[0] if dof is None else dof
    names, repeats = _of_blades(scene, name)

    def progress(share: float, _points: int) -> None:
        if on_progress is not None:
            on_progress(share if len(names) == 1 else _OF_THE_SWEEP * share, 0)

    whole, seen = every_branch or len(names) == 1, _observing(scene, names[0])
    branch = None if whole or settings is not None else sampled(seen, start, stop, harmonics, should_stop)
    if branch is not None and branch.reached:
        progress(1.0, len(branch.values))
    if branch is None:
        given = settings or ContinuationSettings()
        branch = sweep(
            seen, start=start, stop=stop, harmonics=harmonics,
            settings=replace(given, peaks=whole and given.peaks, errors=whole and given.errors),
            on_progress=progress, should_stop=should_stop,
        )  # fmt: skip
    if not whole and branch.reached:
        peaks, highest = highest_peaks(branch, names)
        if not highest.reached:  # known by its peaks to have no damping
            return _of_every_blade(name, names[:1], highest, len(names), on_progress, should_stop)
        return BladePeaks(
            dof=name, value=np.array([peak.value for peak in peaks]),
            at_hz=np.array([peak.at for peak in peaks]), status=(branch.status,) * len(names),
            branches=(highest,), highest=highest.known, measured=replace(scene.measured, dof=name),
        )  # fmt: skip
    return _of_every_blade(name, names, branch, repeats, on_progress, should_stop)


def _of_blades(scene: Scene, dof: str) -> tuple[list[str], int]:
    """Return the DOFs of blades whose responses differ, and how many blades each of them stands for."""
    names, count = [scene.dofs[i] for i in blade_rows(scene, dof)], scene.structure.sector_count
    if not scene.structure.has_sectors:
        return names, 1
    if sectors_needed(_observing(scene, dof)).sectors > 1:
        return [f"{dof}@{j}" for j in range(count)], 1
    return [dof], count


def _of_every_blade(
    name: str, names: list[str], branch: Branch, repeats: int,
    on_progress: Callable[[float, int], None] | None, should_stop: Callable[[], bool] | None,
) -> BladePeaks:  # fmt: skip
    """Return the peaks of all blades with their branches: every blade moves in the same solutions."""
    branches = [branch] * repeats
    for done, each in enumerate(names[1:], 1):
        if should_stop is not None and should_stop():
            break
        branches.append(observing(branch, each))
        if on_progress is not None:
            on_progress(_OF_THE_SWEEP + (1.0 - _OF_THE_SWEEP) * (done + 1.0) / len(names), done)
    missing = len(names) * repeats - len(branches)
    known = [each.peak if each.reached else None for each in branches] + [None] * missing
    found = BladePeaks(
        dof=name,
        value=np.array([math.nan if peak is None else peak.value for peak in known]),
        at_hz=np.array([math.nan if peak is None else peak.at for peak in known]),
        status=tuple(each.status for each in branches) + (BranchStatus.STOPPED,) * missing,
        branches=tuple(branches),
        measured=replace(branch.scene.measured, dof=name),
    )
    worst = found.worst_branch
    return found if worst is None else replace(found, highest=worst.known)


def _observing(scene: Scene, dof: str) -> Scene:
    return scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})})


def mistuned(
    scene: Scene,
    *,
    of: str | Sequence[str],
    spread: float = 0.02,
    seed: int = 1,
    values: Sequence[float] | None = None,
) -> Scene:
    """Write a cyclic scene out as an annulus whose blades are not quite equal.

    Sector j has the parts in `of` multiplied by its factor. The same as ``[structure.mistuning]`` in a scene
    file, which `solve` and `sweep` write out by themselves.

    Parameters
    ----------
    scene : a cyclic scene; mistuning that it has is replaced.
    of : names of springs (k), dashpots (c) and masses, or DOFs (their mass).
    spread : standard deviation of the factors 1 + spread z, with independent normal z.
    seed : of the random numbers (numpy's Generator with PCG64), so that a disk can be had again.
    values : the factors themselves, one for each sector, instead of `spread` and `seed`.

    Raises
    ------
    SettingError
        The scene is not cyclic.
    SceneError
        A part that does not exist, factors that are not one for each sector or not above 0.
    """
    table: dict[str, object] = {"of": [of] if isinstance(of, str) else list(of)}
    table |= {"spread": spread, "seed": seed} if values is None else {"values": list(values)}
    return annulus(with_mistuning(scene, table))


def with_mistuning(scene: Scene, table: Mapping[str, object]) -> Scene:
    """Return a cyclic scene with another ``[structure.mistuning]``, one sector still.

    Raises
    ------
    SettingError
        The scene is not cyclic.
    SceneError
        A part that does not exist, or values that do not fit.
    """
    structure = scene.structure
    if isinstance(structure, LumpedStructure) or not structure.has_sectors:
        raise SettingError("scene", scene.name, "must have a cyclic structure to be mistuned")
    if isinstance(structure, MatricesStructure):
        # Its matrices as they are: written out as numbers and read again they would take seconds.
        given = {key: getattr(structure, key) for key in structure.model_fields_set}
        plain = {key: value for key, value in given.items() if value is not None}
        small = scene.model_copy(update={"structure": _ONE_MASS})
    else:
        plain, small = structure.model_dump(mode="json", exclude_none=True), scene
    raw = small.to_dict()
    raw["structure"] = {**plain, "mistuning": dict(table)}
    return Scene.from_dict(raw)


def blade_paths(scene: Scene, of: Sequence[str]) -> tuple[Scene, list[tuple[str, ...]]]:
    """Return a cyclic scene whose mistuned masses have names, and the paths that each blade's factor moves.

    The paths are those of its annulus (`mistuned`), one tuple for each sector; none of a structure given by
    matrices, whose parts are no parameters.
    """
    structure = scene.structure
    if not isinstance(structure, CyclicStructure):
        return scene, []

    def named(mass: Mass) -> Mass:
        if mass.name is not None or mass.dof not in of:
            return mass
        return mass.model_copy(update={"name": f"mass-of-{mass.dof}"})

    structure = structure.model_copy(update={"masses": tuple(map(named, structure.masses))})
    dofs = set(of) - {part.name for part in named_parts(structure)}
    parts = [x for x in named_parts(structure) if x.name in of or getattr(x, "dof", None) in dofs]
    rows = [tuple(f"{STRUCTURE}{x.name}@{j}" for x in parts) for j in range(structure.sector_count)]
    return scene.model_copy(update={"structure": structure}), rows


def blade_amplitudes(solution: Solution, dof: str | None = None) -> BladeAmplitudes:
    """Return the amplitudes of a DOF in every sector.

    Parameters
    ----------
    solution : of an annulus, mistuned or not, or of the one sector that stands for all.
    dof : name of the DOF in one sector; the observed one if left out.

    Raises
    ------
    SettingError
        The solution did not converge, or no sector has such a DOF.
    """
    name = solution.scene.observe.dof.partition("@")[0] if dof is None else dof
    rows = blade_rows(solution.scene, name)
    moves = motion(solution)
    ranges = np.array([_extremes(moves[row]) for row in rows])
    return BladeAmplitudes(
        dof=name,
        max_abs=np.abs(ranges).max(axis=1),
        half_peak_to_peak=0.5 * (ranges[:, 0] - ranges[:, 1]),
    )


def blade_rows(scene: Scene, name: str) -> list[int]:
    """Return the index of a DOF in each sector, in a cyclic scene the same; SettingError if there is none."""
    dofs, structure = scene.dofs, scene.structure
    if structure.has_sectors:
        rows = [dofs.index(name)] * structure.sector_count if name in dofs else []
    else:
        rows = [i for i, each in enumerate(dofs) if name != each and name == each.partition("@")[0]]
    if not rows:
        known = tuple(dict.fromkeys(each.partition("@")[0] for each in dofs))
        needs = f"must be a DOF of every sector, one of {listing(known)}"
        raise SettingError("dof", name, needs, nearest(str(name), known))
    return rows


def _extremes(x: Real) -> tuple[float, float]:
    """Return max and min over the period of a motion with full coefficients `x`."""
    amplitudes = fourier.to_complex(x)
    c, s = amplitudes.real.copy(), -amplitudes.imag
    top = c.size - 1
    tables = grid_tables(grid_size(max(top, 1)), max(top, 1))
    value, slope = (np.empty(2 * (tables[0].shape[1] - 1)) for _ in range(2))
    on_grid(c, s, top, *tables, value, slope)
    high, _ = largest(c, s, top, value, slope)
    low, _ = largest(-c, -s, top, -value, -slope)
    return high, -low
