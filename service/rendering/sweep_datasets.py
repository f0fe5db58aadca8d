"""Stored sweeps as the datasets that branches become: the same arrays under the same names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.db.models import Sweep
from service.db.repositories import SweepRepository
from service.jobs.arrays import decode
from service.jobs.strict_json import digest
from solver.results.dataset import Dataset
from solver.scene.parameter_paths import structure_unit
from solver.scene.scene import Scene
from solver.views.columns import attributes
from solver.views.parameter_units import parameter_unit
from solver.views.to_dataset import point_variables

_COLUMNS = ("parameter", "amplitude", "half_peak_to_peak", "mean", "residual")


def _unit(path: str, scene: Scene | None) -> str:
    """The unit of the parameter swept; a part of the structure has one only where the scene is known."""
    owner, _, name = path.partition(".")
    if owner != "structure":
        return parameter_unit(path)
    return "" if scene is None else structure_unit(scene.structure, name)


def sweep_dataset(row: Sweep, repository: SweepRepository, scene: Mapping[str, Any] | None = None) -> Dataset:
    """A stored sweep, a point a row.

    Sweeps that an earlier version stored have no column `residual` and none of the states.

    Parameters
    ----------
    scene : that of its job; it is told only if it is the one that was swept.
    """
    arrays = {name: decode(stored) for name, stored in repository.arrays(row.id).items()}
    names = [contact.name for contact in repository.parts([row.id])[row.id]]
    states = arrays.get("states")
    swept = None
    if scene is not None and digest(dict(scene)) == row.scene_hash:
        swept = Scene.from_dict(scene)
    variables = point_variables(
        row.parameter, _unit(row.parameter, swept),
        {name: arrays[name] for name in _COLUMNS if name in arrays},
        arrays.get("observed"), None if states is None else (names, states),
    )  # fmt: skip
    notes = attributes(
        row.status, swept, parameter=row.parameter, harmonics=row.harmonics,
        observed=None if swept is None else swept.observe.dof, peak=row.peak, peak_at=row.peak_at,
        band=row.band_hz, band_limit=row.limit, sweep=row.id, job=row.job_id,
    )  # fmt: skip
    return Dataset(kind="branch", rows=("point",), variables=variables, attributes=notes)
