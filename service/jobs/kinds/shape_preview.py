"""The preview `shape`: how a scene moves over a period at a frequency, or in a mode, to be drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from service.jobs.common.periods import period_of
from service.jobs.common.result_models import KindResult
from service.jobs.common.scene_requests import FrequencyHz, Number, check, require, resolved, stored_scene
from service.jobs.kind_registry import Resolved, SceneSource
from service.jobs.kinds.preview_request import (
    POINT_UNKNOWNS,
    PreviewRequest,
    harmonics_in_time,
    scene_of,
)
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.studies.modes_study import Diameter
from solver.errors import Issue, Naming

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from solver.views.shapes import Shape

SAMPLES = 96
"""Of what a contact does over the period."""
DIGITS = 6
MOST_TOLD = 2000
Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Amplitudes = list[list[list[Point]]]


class ShapeContact(BaseModel):
    """A contact that is drawn, and what it does."""

    name: str
    point: int = Field(description="Number of its point.")
    states: list[str | None] = Field(description="Of each sector that was solved.")
    motions: list[list[int] | None] = Field(
        description="The same over one period: 0 stick, 1 slip, 2 separation; null where it is not known."
    )


class DrawnShape(BaseModel):
    """Points at rest, what is drawn between them, and how they move.

    Point p of sector j is at R_j (x_p + Re Σ_k U_kp e^{ik(τ + j turn)}), where R_j turns about the axis by
    that many of the sectors. Where every sector was solved each has motions of its own.
    """

    frequency_hz: float
    unit: str = Field(description="Of the motions: m, or 1/√kg of a linear mode.")
    nodal_diameter: int | None
    sectors: int
    axis: Point
    turn: float = Field(description="Phase of harmonic 1 from a sector to the next [rad].")
    to_scale: bool = Field(description="Whether the scene tells the places; they are of unit size else.")
    points: list[Point] = Field(description="At rest [m].")
    names: list[str]
    roles: list[str] = Field(description="mesh, node, mass, body, contact or ground.")
    edges: list[tuple[int, int]] = Field(description="Lines between points.")
    ahead: list[tuple[int, int]] = Field(description="Lines to points of the next sector.")
    faces: list[tuple[int, int, int]]
    harmonics: list[int] = Field(description="Those that move something.")
    real: Amplitudes = Field(description="Sector × harmonic × point × direction.")
    imag: Amplitudes
    amplitude: list[list[float]] = Field(description="Largest motion about the mean, sector × point.")
    contacts: list[ShapeContact]
    notes: list[str] = Field(description="What is not drawn, and why.")


class ShapePreview(KindResult):
    """How everything moves over a period."""

    reached: bool
    status: str = Field(description="How it ended, and what to try if it fell short.")
    shape: DrawnShape | None


class ShapeMotion(BaseModel):
    """Harmonic 1 of every DOF over the amplitude of a nonlinear mode, as `motions` of its result has it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    dofs: Annotated[list[str], Field(min_length=1, max_length=MOST_TOLD)]
    real: Annotated[list[Number], Field(max_length=MOST_TOLD, description="[1/√kg].")]
    imag: Annotated[list[Number], Field(max_length=MOST_TOLD, description="[1/√kg].")]
    frequency_hz: FrequencyHz
    states: Annotated[dict[str, str], Field(max_length=MOST_TOLD)] = Field(
        default={}, description="What contacts do."
    )


class ShapePreviewRequest(PreviewRequest):
    """The deflection at `frequency_hz`; or a linear `mode`; or the `motion` that a result has of one."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"scene": "two-dof", "frequency_hz": 1.05},
                {"scene": "bladed-disk", "mode": 1, "nodal_diameter": 2},
            ]
        }
    )

    frequency_hz: FrequencyHz | None = Field(default=None, description="Excitation frequency [Hz].")
    mode: Annotated[int, Field(strict=True, ge=1, le=100_000)] | None = Field(
        default=None, description="In place of it: which mode, 1 the slowest, contacts as they are at rest."
    )
    motion: ShapeMotion | None = Field(
        default=None, description="In place of both: what a nonlinear mode does at a point of its curve."
    )
    nodal_diameter: Diameter | None = Field(
        default=None, description="Of a mode of a disk; that of the engine order if left out."
    )


def resolve_shape(request: ShapePreviewRequest, source: SceneSource) -> Resolved:
    """Look up the scene, check its size and what is asked, and choose the harmonics that can be kept."""
    if sum(each is not None for each in (request.frequency_hz, request.mode, request.motion)) != 1:
        named = Naming("must be given, or {mode} or {motion} in its place; one of them")
        require([Issue(("frequency_hz",), named, request.frequency_hz)])
    if request.frequency_hz is not None and request.nodal_diameter is not None:
        require([Issue(("nodal_diameter",), Naming("needs {mode} or {motion}"), request.nodal_diameter)])
    scene = scene_of(request, source, 1, request.harmonics)
    if request.mode is not None:
        from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode

        mode = request.mode
        require(check(lambda: check_mode(at_nodal_diameter(scene, request.nodal_diameter), mode)))
    motion = request.motion
    if motion is not None and not len(motion.dofs) == len(motion.real) == len(motion.imag):
        wanted = f"must have as many numbers in `real` and `imag` as `dofs` has names, {len(motion.dofs)}"
        require([Issue(("motion",), wanted, f"{len(motion.real)} and {len(motion.imag)}")])
    kept = harmonics_in_time(scene, request.harmonics, POINT_UNKNOWNS)
    given = request.model_dump(include={"frequency_hz", "mode", "motion", "nodal_diameter"})
    return resolved(scene, harmonics=kept, **given)


def run_shape(spec: Mapping[str, Any], _progress: Progress, _should_stop: ShouldStop) -> JobOutput:
    """Solve at the frequency, or find the mode, and tell how everything moves."""
    import numpy as np

    import solver
    from solver.views.shapes import deflection_shape, mode_shape, shape_of_motion

    scene, over, diameter = stored_scene(spec), dict[str, Any](), spec["nodal_diameter"]
    if (told := spec["motion"]) is not None:
        motion = np.array(told["real"]) + 1j * np.array(told["imag"])
        shape = shape_of_motion(scene, told["dofs"], motion, told["frequency_hz"], told["states"], diameter)
    elif spec["mode"] is not None:
        shape = mode_shape(scene, spec["mode"], nodal_diameter=diameter, harmonics=spec["harmonics"])
    else:
        solution = solver.solve(scene, frequency_hz=spec["frequency_hz"], harmonics=spec["harmonics"])
        if not solution.converged:
            status = solution.status.value
            return JobOutput(result={"reached": False, "status": status, "shape": None}, shortfall=status)
        shape = deflection_shape(scene, solution)
        over = {each["name"]: each["motion"] for each in period_of(solution, SAMPLES)["contacts"]}
    return JobOutput(result={"reached": True, "status": "It was found.", "shape": _told(scene, shape, over)})


def _told(scene: Scene, shape: Shape, over: Mapping[str, list[int] | None]) -> dict[str, Any]:
    """What is drawn, as JSON."""
    picture, count = shape.picture, len(shape.motions)

    def each(name: str) -> list[str]:
        return [name] if count == 1 else [f"{name}@{j}" for j in range(count)]

    return {
        "frequency_hz": shape.frequency_hz, "unit": shape.unit,
        "nodal_diameter": shape.nodal_diameter, "sectors": scene.structure.sector_count,
        "axis": list(picture.axis), "turn": shape.turn, "to_scale": picture.to_scale,
        "points": picture.points, "names": picture.names, "roles": picture.roles, "edges": picture.edges,
        "ahead": picture.ahead, "faces": picture.faces, "harmonics": shape.harmonics.tolist(),
        "real": _short(shape.motions.real), "imag": _short(shape.motions.imag),
        "amplitude": _short(shape.amplitude),
        "contacts": [
            {
                "name": name, "point": point,
                "states": [shape.states.get(one) for one in each(name)],
                "motions": [over.get(one) for one in each(name)],
            }
            for name, point in picture.contacts.items()
        ],
        "notes": picture.notes,
    }  # fmt: skip


def _short(values: Any) -> Any:
    """Numbers to so many digits of the largest: enough for a drawing."""
    import numpy as np

    largest = float(np.abs(values).max(initial=0.0))
    return np.round(values, DIGITS - math.floor(math.log10(largest)) if largest else 0).tolist()
