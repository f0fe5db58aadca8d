"""The kind `interference`: natural frequencies over the nodal diameter, and the orders that meet them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

import solver
from service.jobs.common.results import EndedResult, Table
from service.jobs.common.scenes import PositiveNumber, SceneRequest, refusal, require, resolve_scene, resolved
from service.jobs.common.sizes import memory_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import SettingError, pointer
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EXAMPLE: dict[str, Any] = {"scene": "bladed-disk", "speed_rpm": 11000}
_MOST_ORDERS = 1000
_MOST_FAMILIES = 100
_MOST_RPM = 6e10  # a revolution at the highest frequency that is accepted anywhere
_Order = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]


class InterferenceRequest(SceneRequest):
    """An interference diagram, in the words of the command.

    Attributes
    ----------
    speed_rpm : float or None
        Speed of rotation [1/min].
    orders : list or None
        Excitations a revolution.
    families : int
        Natural frequencies at each nodal diameter.
    up_to_hz : float or None
        Families that begin above are left out [Hz].
    within : float
        Relative distance up to which an order counts as near a family.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    speed_rpm: Annotated[PositiveNumber, Field(le=_MOST_RPM)] | None = Field(
        default=None, description="Speed of rotation [1/min]; the scene's own, and without one no orders."
    )
    orders: Annotated[list[_Order], Field(min_length=1, max_length=_MOST_ORDERS)] | None = Field(
        default=None, description="Excitations a revolution; all that reach the frequencies if left out."
    )
    families: Annotated[int, Field(strict=True, ge=1, le=_MOST_FAMILIES)] = Field(
        default=6, description="How many natural frequencies at each nodal diameter."
    )
    up_to_hz: PositiveNumber | None = Field(
        default=None, description="Families that begin above are left out [Hz]."
    )
    within: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=0.05,
        description="Relative distance of an order from a family that counts.",
    )


class InterferenceResult(EndedResult):
    """Natural frequencies at each nodal diameter, what the orders excite, and where they meet."""

    scene: str
    sectors: int
    speed_rpm: float | None
    within: float
    diameters: list[Table] = Field(description="Frequencies with all contacts open, and all stuck.")
    orders: list[Table] = Field(description="Nodal diameter and frequency of each order at the speed.")
    crossings: list[Table] = Field(description="Orders that meet a family or are near one.")
    missing: list[int] = Field(description="Nodal diameters that a reduced sector was not built for.")
    seconds: float


def resolve(request: InterferenceRequest, source: SceneSource) -> Resolved:
    """Look up the scene; check that it is a disk, and its size."""
    # Loaded here: they bring the compiled loops along, which a service that only lists does not need.
    from solver.studies.interference import checked_speed
    from solver.studies.mistuning import without_mistuning

    scene = resolve_scene(request, source)
    try:
        checked_speed(scene, request.speed_rpm, request.orders)
    except SettingError as error:
        require([refusal(pointer(error.name), str(error))])
    require(memory_issues(without_mistuning(scene), 1))
    return resolved(
        scene,
        speed_rpm=request.speed_rpm,
        orders=request.orders,
        families=request.families,
        up_to_hz=request.up_to_hz,
        within=request.within,
    )


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Compute the frequencies of every nodal diameter."""
    diagram = solver.interference_diagram(
        Scene.from_dict(spec["scene"]),
        speed_rpm=spec["speed_rpm"],
        orders=spec["orders"],
        families=spec["families"],
        up_to_hz=spec["up_to_hz"],
        within=spec["within"],
        on_progress=progress,
        should_stop=should_stop,
    )
    return JobOutput.of(diagram, reached=diagram.completed)


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The frequencies over the nodal diameter, with the orders."""
    from solver.views.plots.interference import interference_figure

    if not any(point["open_hz"] for point in result["diameters"]):
        raise NothingToDrawError("it has no natural frequency to draw")
    return interference_figure(result)


INTERFERENCE = JobKind(
    name="interference",
    summary="Natural frequencies of a disk over the nodal diameter, and the engine orders that meet them.",
    request=InterferenceRequest,
    resolve=resolve,
    run=run,
    result=InterferenceResult,
    view=KindView(
        result="frequencies at each nodal diameter, orders that meet them ([interference](disks.md))",
        flags={"speed_rpm": "--speed", "orders": "--order", "up_to_hz": "--up-to"},
        draw=draw,
    ),
)
