"""The study `campbell`: where orders of a running speed meet the resonances of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from optim.criteria.key import BandHz, PositiveNumber, RangesRpm
from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import HarmonicRequest
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.kind_registry import Flag, Json, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.stored_figures import SweepRecord
from service.jobs.study import Proposed, Question, Study, first_order, rounded
from solver.errors import Issue

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optim.results.studies_result import CampbellDiagram
    from solver.scene.scene import Scene
    from solver.views.plots.curves import Response

_ORDERS = 3  # are proposed
_Order = Annotated[int, Field(strict=True, ge=1, le=10_000)]


class Campbell(Study, HarmonicRequest):
    """Find the speeds at which orders of the running speed meet resonances.

    The peaks are those of the response with friction; natural frequencies with all contacts stuck and all
    open are given beside them.
    """

    EXAMPLES = ({"scene": "bladed-disk", "speeds_rpm": [[40000, 50000]], "orders": [1, 2, 3], "limit": 8e-5},)
    NAME, FUNCTION = "campbell", "optim:campbell_diagram"
    RESULT = answered("optim.results.studies_result:CampbellDiagram", "CampbellResult")
    ASKS = Question("At which speeds does it resonate?", "engine", 350)
    TOLD = "optim.views.tables.studies:campbell"
    SHOWS = "crossings and speeds above the limit ([Campbell diagrams](disks.md#campbell-diagrams))"
    EMPTY = ("orders", "it stored no sweep to draw")
    SWEEPS = "one an order; one for all without sectors"

    speeds_rpm: Annotated[RangesRpm, Flag("--speeds", "LO HI")] = Field(
        description="Ranges [low, high] of the running speed [1/min]."
    )
    orders: Annotated[
        Annotated[list[_Order], Field(min_length=1, max_length=100)] | None, Flag("--order", "N")
    ] = Field(
        default=None,
        description="Excitations a revolution; in a cyclic scene the engine order. The scene's own, or 1.",
    )
    limit: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None, description="Amplitude [m] that counts as resonance; half power of each order's peak."
    )
    band_hz: Annotated[BandHz | None, Flag("--band")] = Field(
        default=None,
        description="Frequencies looked at [Hz]; the scene's band and those of the running speeds.",
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """The running speeds that bring the engine orders into the band."""
        (low, high), first = map(float, scene.observe.band), max(first_order(scene), 1)
        most = max(scene.structure.sector_count // 2, first) if scene.structure.has_sectors else _ORDERS
        orders = [order for order in range(first, first + _ORDERS) if order <= max(most, first)]
        speeds = [rounded(60.0 * low / orders[-1], 4), rounded(60.0 * high / first, 4)]
        body = {"speeds_rpm": [speeds], "orders": orders, "band_hz": [low, high]}
        return Proposed(body, ("orders",), times=len(orders))

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what is wrong with speeds and band."""
        found = [
            Issue(("speeds_rpm", i), "must have low < high [1/min]", pair)
            for i, pair in enumerate(self.speeds_rpm)
            if not pair[0] < pair[1]
        ]
        if self.band_hz is not None and not self.band_hz[0] < self.band_hz[1]:
            found.append(Issue(("band_hz",), "must have low < high [Hz]", self.band_hz))
        return found

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = len(self.orders or [1]) * POINTS_OF_A_SWEEP
        return balance_issues("orders", scene, self.harmonics, points)

    @classmethod
    def sweeps(cls, found: CampbellDiagram) -> tuple[SweepRecord, ...]:
        """Return the response of every order."""
        from service.jobs.common.sweep_records import sweep_records

        return sweep_records(one.branch for one in found.orders)

    @classmethod
    def figure(cls, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
        """Return each order with the stored response whose highest peak is its own."""
        from optim.views.plots.figures import campbell_figure
        from service.jobs.drawing import response_of
        from solver.results.known import Measured

        measured = Measured.of_result(result)
        curves = [response_of(read(sweep.id), measured) for sweep in sweeps if sweep.points]
        if not curves:
            raise NothingToDrawError(cls.EMPTY[1])

        def distance(curve: Response, order: Json) -> float:
            heights = [float(peak["value"]) for peak in order["peaks"]] or [math.nan]
            return abs(float(curve.amplitude.max()) - max(heights))

        chosen = [min(curves, key=lambda curve: distance(curve, order)) for order in result["orders"]]
        return campbell_figure(result, chosen)
