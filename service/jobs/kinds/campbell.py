"""The kind `campbell`: where orders of a running speed meet the resonances of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import optim
from optim.errors import DesignError
from service.jobs.common.problem import Pair, Ranges
from service.jobs.common.records import sweep_records
from service.jobs.common.scenes import (
    HarmonicRequest,
    PositiveNumber,
    refusal,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.kinds.registry.results import Amplitude, EndedResult, KnownResult, Table
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue, pointer
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.views.plots.curves import Response

_EXAMPLE: dict[str, Any] = {
    "scene": "bladed-disk",
    "speeds_rpm": [[40000, 50000]],
    "orders": [1, 2, 3],
    "limit": 8e-5,
}
_MOST_ORDERS = 100
_MOST_RPM = 6e10  # a revolution at the highest frequency that is accepted anywhere
_Order = Annotated[int, Field(strict=True, ge=1, le=10_000)]


class CampbellRequest(HarmonicRequest):
    """A Campbell diagram, in the words of the command.

    Attributes
    ----------
    speeds_rpm : list
        Ranges [low, high] of the running speed [1/min].
    orders : list or None
        Excitations a revolution.
    limit : float or None
        Amplitude [m] that counts as resonance.
    band_hz : list or None
        Frequencies [low, high] looked at [Hz].
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    speeds_rpm: Ranges = Field(description="Ranges [low, high] of the running speed [1/min].")
    orders: Annotated[list[_Order], Field(min_length=1, max_length=_MOST_ORDERS)] | None = Field(
        default=None,
        description="Excitations a revolution; in a cyclic scene the engine order. The scene's own, or 1.",
    )
    limit: PositiveNumber | None = Field(
        default=None, description="Amplitude [m] that counts as resonance; half power of each order's peak."
    )
    band_hz: Pair | None = Field(
        default=None,
        description="Frequencies looked at [Hz]; the scene's band and those of the running speeds.",
    )


class CampbellResult(KnownResult, EndedResult):
    """Crossings of every order with the peaks of its response, and speeds above the limit."""

    scene: str
    speeds_rpm: list[list[float]]
    limit: Amplitude
    clear: bool | None = Field(description="Whether no running speed is above the limit.")
    orders: list[Table]
    n_harmonics: int
    seconds: float


def resolve(request: CampbellRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check speeds, orders and band."""
    scene = resolve_scene(request, source)
    sweeps = len(request.orders or [1]) * POINTS_OF_A_SWEEP
    require(_speed_issues(request) + balance_issues("/orders", scene, request.harmonics, sweeps))
    return resolved(
        scene,
        speeds_rpm=request.speeds_rpm,
        orders=request.orders,
        limit=request.limit,
        band_hz=request.band_hz,
        harmonics=request.harmonics,
    )


def _speed_issues(request: CampbellRequest) -> list[Issue]:
    """What is wrong with the ranges of speed and frequency."""
    issues: list[Issue] = []
    for i, pair in enumerate(request.speeds_rpm):
        where = pointer("speeds_rpm", i)
        try:
            optim.forbidden_hz([pair], 1)
        except DesignError as error:
            issues.append(refusal(where, str(error).replace("speeds_rpm[0]", f"speeds_rpm[{i}]", 1)))
        else:
            if pair[1] > _MOST_RPM:
                issues.append(refusal(where, f"`speeds_rpm[{i}]` must be at most {_MOST_RPM:g}, got {pair}"))
    if request.band_hz is not None and not 0.0 < request.band_hz[0] < request.band_hz[1]:
        issues.append(
            refusal("/band_hz", f"`band_hz` must have 0 < low < high [Hz], got {request.band_hz!r}")
        )
    return issues


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Follow the response of every order; all are stored."""
    diagram = optim.campbell_diagram(
        Scene.from_dict(spec["scene"]),
        speeds_rpm=spec["speeds_rpm"],
        orders=spec["orders"],
        limit=spec["limit"],
        band_hz=spec["band_hz"],
        harmonics=spec["harmonics"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput.of(
        diagram,
        reached=diagram.completed,
        sweeps=sweep_records(one.branch for one in diagram.orders),
    )


def draw(result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
    """Each order with the stored response whose highest peak is its own."""
    from optim.views.plots.campbell import campbell_figure
    from service.jobs.stored_curves import response_of

    curves = [response_of(read(sweep.id)) for sweep in sweeps if sweep.points]
    if not curves:
        raise NothingToDrawError("it stored no sweep to draw")

    def distance(curve: Response, order: Json) -> float:
        heights = [float(peak["value"]) for peak in order["peaks"]] or [math.nan]
        return abs(float(curve.amplitude.max()) - max(heights))

    chosen = [min(curves, key=lambda curve: distance(curve, order)) for order in result["orders"]]
    return campbell_figure(result, chosen)


CAMPBELL = JobKind(
    name="campbell",
    summary="Where orders of a running speed meet the resonances of a scene.",
    request=CampbellRequest,
    resolve=resolve,
    run=run,
    result=CampbellResult,
    view=KindView(
        result="crossings and speeds above the limit ([Campbell diagrams](campbell.md))",
        sweeps="one an order; one for all without sectors",
        flags={"speeds_rpm": "--speeds", "orders": "--order", "band_hz": "--band"},
        draw=draw,
    ),
)
