"""The study `controlled`: responses over the frequency at a held amplitude."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from optim.criteria.key import Name
from service.jobs.common.result_models import Table, answered
from service.jobs.common.scene_requests import FrequencyHz, HarmonicRequest, PositiveNumber
from service.jobs.common.sizes import balance_issues
from service.jobs.common.study_keys import band_issues
from service.jobs.kind_registry import Flag
from service.jobs.study import Answer, Proposed, Question, Study, Watch
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_POINTS = 200  # a curve seldom has more


class Controlled(Study, HarmonicRequest):
    """Follow the response over the frequency with one amplitude held, as rigs do.

    It says which force that takes, and what the contacts do.
    """

    EXAMPLES = ({"scene": "two-dof", "amplitude": 1.0},)
    NAME, FUNCTION = "controlled", "solver:held_amplitude"
    RESULT = answered(
        "stickslip.lab.controlled.held_result:HeldAmplitude",
        "ControlledResult",
        changes=list[Table],
        least=Table | None,
    )
    ASKS = Question("What would a test at held amplitude show?", "rig", 5_000)
    TOLD = "solver.views.tables.disks:held"
    SHOWS = "force and phase over the frequency ([a held amplitude](modes.md#a-held-amplitude))"
    EMPTY = ("frequency", "no response with this amplitude was found")
    FIGURE = "solver.views.plots.disks:held_figure"

    amplitude: Annotated[PositiveNumber, Flag(metavar="A")] = Field(
        description="Amplitude of harmonic 1 that is held [m]."
    )
    start: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="from", description="First frequency [Hz]; the scene's band if left out."
    )
    stop: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="to", description="Last frequency [Hz]."
    )
    dof: Annotated[Name | None, Flag(metavar="NAME")] = Field(
        default=None, description="Whose amplitude; what the scene observes."
    )
    no_stability: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Leave out whether responses are stable: faster."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """A quarter of the highest peak of the response, held."""
        forces = [force for force in scene.excitation if force.amplitude != 0.0]
        if not forces or any(force.harmonic != 1 for force in forces):
            return "It holds the amplitude by an excitation of harmonic 1 alone."
        return Proposed(of_peak={"amplitude": 0.25})

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with range and DOF for the scene."""
        issues = band_issues(scene, self.start, self.stop)
        if self.dof is not None and self.dof not in scene.dofs:
            issues.append(Issue(("dof",), f"must be one of {', '.join(scene.dofs)}", self.dof))
        forces = [force for force in scene.excitation if force.amplitude != 0.0]
        if not forces or any(force.harmonic != 1 for force in forces):
            wanted = "must have an excitation of harmonic 1 alone: it holds the amplitude"
            issues.append(Issue(("scene",), wanted))
        return issues

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        return balance_issues("harmonics", scene, self.harmonics, _POINTS)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Follow the responses; of large structures stability is left out unless it is asked for."""
        given = {name: value for name, value in asked.items() if name != "no_stability"}
        if asked.get("no_stability"):
            given["stability"] = False
        return super().compute(scene, given, watch)
