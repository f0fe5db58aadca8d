"""The study `worst-mistuning`: the worst pattern of blades within bounds, and intentional patterns."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from optim.criteria.key import Name
from service.jobs.common.result_models import Table, answered
from service.jobs.common.scene_requests import LEAST, FrequencyHz, HarmonicRequest
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import band_issues
from service.jobs.kind_registry import Flag
from service.jobs.studies.mistuning_study import PartNames, blades_differ, disk_issues, part_issues
from service.jobs.study import Proposed, Question, Study
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_MOST_STARTS, _MOST_CLIMB, _MOST_PATTERNS = 1000, 200, 50
_Share = Annotated[float, Field(strict=True, ge=LEAST, le=0.9)]
_Pattern = Annotated[str, Field(pattern=r"^[A-Z]{1,100}$")]


class WorstMistuningStudy(Study, HarmonicRequest):
    """Find the worst mistuning of a disk within bounds.

    It makes the highest peak of any blade largest; Whitehead's and Martel's bounds stand beside it.
    Intentional patterns of blade types are ranked.
    """

    EXAMPLES = ({
        "scene": "bladed-disk", "of": ["tip_middle"], "within": 0.03, "patterns": ["AB", "ABB"],
        "starts": 30, "harmonics": 3,
    },)  # fmt: skip
    NAME, FUNCTION = "worst-mistuning", "solver:worst_mistuning"
    RESULT = answered(
        "stickslip.lab.worst_mistuning.worst_result:WorstMistuning", "WorstMistuningResult",
        worst=Table | None, residual=Table | None, patterns=list[Table],
    )  # fmt: skip
    ASKS = Question("What is the worst pattern of blades?", "engine", 300_000)
    TOLD = "stickslip.lab.worst_mistuning.tables:worst_mistuning"
    SHOWS = "the worst pattern with its bounds, and intentional ones ([patterns](disks.md#the-worst-pattern))"
    COUNTED = "climbs and responses"
    GROUPED: ClassVar = {"intentional": "solver:IntentionalMistuning", "search": "solver:WorstSearch"}
    EMPTY = ("worst", "the peak of no pattern is known")
    FIGURE = "stickslip.lab.worst_mistuning.pictures:worst_mistuning_figure"

    of: Annotated[PartNames, Flag(metavar="NAME")] = Field(
        description="Springs (k), dashpots (c) and masses by name, or DOFs (their mass)."
    )
    within: Annotated[_Share, Flag(metavar="D")] = Field(
        default=0.02, description="Largest deviation of a blade's factor from 1."
    )
    rms: Annotated[_Share | None, Flag(metavar="D")] = Field(
        default=None, description="Largest root mean square of the deviations."
    )
    contacts: Literal["solved", "stuck", "open", "residual"] = Field(
        default="solved",
        description="How contacts count: solved, in a linear limit, or solved with the worst forces that "
        "those which stick may hold.",
    )
    patterns: Annotated[list[_Pattern] | None, Field(max_length=_MOST_PATTERNS), Flag(metavar="AB")] = Field(
        default=None,
        description="Intentional patterns, a letter for each blade type, repeated round the disk.",
    )
    detuning: Annotated[float, Field(strict=True, ge=0.0, le=0.9), Flag(metavar="D")] = Field(
        default=0.02, description="Deviation of the factor of the first blade type, negative of the last."
    )
    worst_of_patterns: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Find the worst mistuning on top of each pattern, and rank by that."
    )
    starts: Annotated[int, Field(strict=True, ge=1, le=_MOST_STARTS), Flag(metavar="N")] = Field(
        default=60, description="Climbs in each linear limit."
    )
    climbs: Annotated[int, Field(strict=True, ge=0, le=_MOST_CLIMB), Flag(metavar="N")] = Field(
        default=4, description="Climbs with the contacts solved, half of them from drawn patterns."
    )
    climb: Annotated[int, Field(strict=True, ge=0, le=_MOST_CLIMB), Flag(metavar="N")] = Field(
        default=30, description="Responses computed on each of these, at most."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**53), Flag(metavar="N")] = Field(
        default=1, description="Of the starts that are drawn."
    )
    dof: Annotated[Name | None, Flag(metavar="DOF")] = Field(
        default=None, description="DOF of one sector whose amplitude counts; the observed one."
    )
    start: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="from", description="Lowest frequency [Hz]; the scene's band."
    )
    stop: Annotated[FrequencyHz | None, Flag(metavar="F")] = Field(
        default=None, alias="to", description="Highest frequency [Hz]; the scene's band."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Return what the blades are told apart by, contacts in their linear limit: solved takes hours."""
        told = blades_differ(scene)
        return told if isinstance(told, str) else told._replace(body={**told.body, "contacts": "stuck"})

    def issues(self, scene: Scene) -> list[Issue]:
        """Return why it is no disk, and what is wrong with DOF, range and bounds."""
        found = disk_issues(scene, self.dof)
        return (
            found or band_issues(scene, self.start, self.stop) or part_issues(partial(self._checked, scene))
        )

    def _checked(self, scene: Scene) -> None:
        from solver.studies.blades import mistuned
        from stickslip.lab.worst_mistuning.intentional import IntentionalMistuning
        from stickslip.lab.worst_mistuning.linear_disk import Contacts, check_linear
        from stickslip.lab.worst_mistuning.worst import check_bounds

        intentional = IntentionalMistuning(self.patterns or (), self.detuning)
        blades = check_bounds(scene, self.within, self.rms, intentional)
        mistuned(scene, of=self.of, values=[1.0] * len(blades))
        if self.contacts in (Contacts.STUCK.value, Contacts.OPEN.value):
            check_linear(scene, Contacts(self.contacts))

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        count = len(self.patterns or ())
        solved = (self.climbs * self.climb + 5) * (1 + self.worst_of_patterns * count) + count
        points = (
            POINTS_OF_A_SWEEP
            * (solved if self.contacts in ("solved", "residual") else 1)
            * scene.structure.sector_count
        )
        return balance_issues(
            "climb", scene, self.harmonics, points, "points of all sweeps", every_sector=True
        )
