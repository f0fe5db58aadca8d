"""What every preview takes, and how large a scene it may be of."""

from __future__ import annotations

from pydantic import Field

from service.jobs.common.scene_requests import HarmonicRequest, require, resolve_scene
from service.jobs.common.sizes import balance_issues, coefficients, contact_motions, dofs_solved
from service.jobs.kind_registry import SceneSource
from solver.errors import Issue
from solver.scene.scene import Scene

MOST_HARMONICS = 41
MOST_UNKNOWNS = 50_000
POINT_UNKNOWNS = 500
"""Of the balance at one point."""
FEW_MOTIONS = 8
"""Of contacts: so few are quick with all harmonics."""


class PreviewRequest(HarmonicRequest):
    """What every preview takes; `client` names who asks: of its previews only the newest is computed."""

    client: str = Field(
        default="", max_length=64, description="Who asks: of its previews only the newest is computed."
    )


def scene_of(request: PreviewRequest, source: SceneSource, points: int, harmonics: int) -> Scene:
    """The scene, if it is small enough for so many points."""
    scene = resolve_scene(request, source)
    issues: list[Issue] = []
    if request.harmonics > MOST_HARMONICS:
        issues.append(
            Issue(("harmonics",), f"of a preview must be at most {MOST_HARMONICS}", request.harmonics)
        )
    unknowns = dofs_solved(scene) * (2 * request.harmonics + 1)
    if unknowns > MOST_UNKNOWNS:
        words = "DOFs × coefficients of a preview"
        issues.append(
            Issue(
                ("scene",),
                f"{words} must be at most {MOST_UNKNOWNS}, got {unknowns}: submit a job",
                named=False,
            )
        )
    require(issues or balance_issues("harmonics", scene, harmonics, points))
    return scene


def harmonics_in_time(scene: Scene, asked: int, unknowns: int) -> int:
    """The harmonics asked for; with many contacts those whose balance has at most so many unknowns.

    A disk that is solved whole has the contacts of all its sectors: too many to be followed live with all
    harmonics.
    """
    motions = contact_motions(scene)
    if motions <= FEW_MOTIONS:
        return asked
    return next((h for h in range(asked, 1, -1) if motions * coefficients(scene, h) <= unknowns), 1)
