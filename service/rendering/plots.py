"""The picture of a job, drawn as its kind says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from service.jobs.drawing import best_sweep_figure
from service.jobs.kind_view import Json, ReadSweep, StoredSweep
from service.jobs.kinds import SHIPPED
from service.jobs.registry import Registry

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def result_figure(
    kind: str, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep, registry: Registry = SHIPPED
) -> Figure:
    """The picture of a job.

    Parameters
    ----------
    kind : of the job.
    result : what it computed, as JSON.
    sweeps : those it stored.
    read : gives a stored sweep with its arrays.
    registry : the kinds there are; the results of others are drawn as their stored sweep.

    Raises
    ------
    NothingToDrawError
        The job found nothing, or stored no sweep.
    """
    known = registry[kind].view.draw if kind in registry else None
    return (known or best_sweep_figure)(result, sweeps, read)
