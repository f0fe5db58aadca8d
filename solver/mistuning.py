"""Mistuned disks: blades that are not quite equal, and how much more the worst of them moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver import fourier
from solver.errors import SettingError
from solver.fourier import Real
from solver.histories import motion
from solver.kernels.events import largest
from solver.kernels.trigpoly import grid_size, grid_tables, on_grid
from solver.response import Solution
from solver.scene import CyclicStructure, Scene
from solver.scene_checks import listing, nearest
from solver.sectors import annulus


@dataclass(frozen=True, slots=True, kw_only=True)
class BladeAmplitudes:
    """The motion of one DOF in every sector.

    Attributes
    ----------
    dof : str
        Its name in one sector.
    max_abs, half_peak_to_peak : (sectors,) array
        Over the period [m].
    """

    dof: str
    max_abs: Real
    half_peak_to_peak: Real

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
    if not isinstance(scene.structure, CyclicStructure):
        raise SettingError("scene", scene.name, "must have a cyclic structure to be mistuned")
    table: dict[str, object] = {"of": [of] if isinstance(of, str) else list(of)}
    table |= {"spread": spread, "seed": seed} if values is None else {"values": list(values)}
    raw = scene.to_dict()
    raw["structure"] = {**scene.structure.model_dump(mode="json", exclude_none=True), "mistuning": table}
    return annulus(Scene.from_dict(raw))


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
    dofs, structure = solution.scene.structure.dofs, solution.scene.structure
    if isinstance(structure, CyclicStructure):
        rows = [dofs.index(name)] * structure.sectors if name in dofs else []
    else:
        rows = [i for i, each in enumerate(dofs) if name != each and name == each.partition("@")[0]]
    if not rows:
        known = tuple(dict.fromkeys(each.partition("@")[0] for each in dofs))
        needs = f"must be a DOF of every sector, one of {listing(known)}"
        raise SettingError("dof", name, needs, nearest(str(name), known))
    moves = motion(solution)
    ranges = np.array([_extremes(moves[row]) for row in rows])
    return BladeAmplitudes(
        dof=name,
        max_abs=np.abs(ranges).max(axis=1),
        half_peak_to_peak=0.5 * (ranges[:, 0] - ranges[:, 1]),
    )


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
