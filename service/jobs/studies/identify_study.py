"""The study `identify`: parameters of a scene from measured responses and hysteresis loops."""

from __future__ import annotations

from functools import cache
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field

from optim.criteria.key import LARGEST, Pair, Share
from optim.problem.checks import ScalingWord
from optim.problem.problem_keys import MAX_VARIABLES, VariableName
from service.jobs.common.result_models import KindResult, Table, answered
from service.jobs.common.scene_requests import HarmonicRequest, Number, ParameterPath
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_registry import Flag
from service.jobs.study import Proposed, Question, Study
from solver.errors import Issue, SceneError, SettingError

if TYPE_CHECKING:
    from optim.identification.data.measured import MeasuredRows
    from optim.identification.fit import Unknowns
    from solver.scene.scene import Scene

MOST_TABLES, MOST_NUMBERS = 200, 200_000
EVALUATIONS = 30
"""Of all points one identification seldom has more."""


_Values = Annotated[list[Number], Field(min_length=1, max_length=100)]


def _small(value: object) -> object:
    """Lists of numbers and tables of words, not too many; what they mean the design layer looks at."""
    if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
        raise ValueError("must be a list of tables: files are read by the command")
    lists = [item for table in value for item in table.values() if isinstance(item, list)]
    if sum(map(len, lists)) > MOST_NUMBERS:
        raise ValueError(f"must hold at most {MOST_NUMBERS} numbers")
    if any(isinstance(one, int | float) and abs(one) > LARGEST for one in chain(*lists)):
        raise ValueError(f"must hold numbers from {-LARGEST:g} to {LARGEST:g}")
    return value


@cache
def identify_result() -> type[KindResult]:
    """Return the schema of an identification."""
    estimate: Any = answered("optim.identification.identification_result:Estimate", "EstimateResult")()
    return answered(
        "optim.identification.identification_result:Identification", "IdentifyResult", correlated=list[Table],
        covariance=list[list[float]], correlation=list[list[float]], estimates=list[estimate],
    )()  # fmt: skip


class Measured(Study, HarmonicRequest):
    """Root of the studies that ask measured data about unknowns."""

    EVALUATIONS: ClassVar[int] = EVALUATIONS

    data: Annotated[
        list[dict[str, Any]],
        BeforeValidator(_small),
        Field(min_length=1, max_length=MOST_TABLES),
        Flag(metavar="JSON|FILE.csv"),
    ] = Field(
        description="Measured runs: tables of columns (lists), `conditions` (path to value), `units` "
        "(column to unit) and words such as `dof`."
    )
    unknowns: Annotated[
        dict[VariableName, Pair],
        Field(min_length=1, max_length=MAX_VARIABLES),
        Flag("--variable", "PATH LO HI"),
    ] = Field(description="Parameters looked for: path to [low, high].")
    scaling: Annotated[dict[VariableName, ScalingWord] | None, Flag(metavar="PATH=HOW")] = Field(
        default=None,
        max_length=MAX_VARIABLES,
        description="Whether equal steps or equal ratios of an unknown count equally; by its bounds.",
    )
    priors: Annotated[dict[VariableName, Pair] | None, Flag("--prior", "PATH MEAN SD")] = Field(
        default=None,
        max_length=MAX_VARIABLES,
        description="What was known before: path to [mean, standard deviation].",
    )
    noise: Annotated[Share | None, Flag(metavar="R")] = Field(
        default=None, description="Noise relative to the amplitude; found from the data if left out."
    )
    starts: Annotated[int, Field(strict=True, ge=1, le=1000), Flag(metavar="N")] = Field(
        default=16, description="Places within the bounds that are tried."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**53), Flag(metavar="N")] = Field(
        default=0, description="Of those places."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Friction and stiffness of the first part that has them."""
        from service.jobs.common.scene_parameters import around

        paths = [path for path in scene.parameter_paths() if path.rpartition(".")[2] in ("kt", "mu")]
        first = paths[0].rpartition(".")[0] if paths else ""
        own = [path for path in paths if path.rpartition(".")[0] == first and scene.value(path) > 0.0]
        if not own:
            return "The scene has no contact whose friction and stiffness a rig could measure."
        return Proposed({"unknowns": {path: around(scene.value(path)) for path in own}})

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large; what is not is read, as a run will read it, to see what is wrong."""
        columns = [[v for v in table.values() if isinstance(v, list)] for table in self.data]
        points = sum(max(map(len, lists), default=0) for lists in columns)
        needed, words = self.EVALUATIONS * max(points, 1), "points of all runs"
        return balance_issues("data", scene, self.harmonics, needed, words) or self.read_issues(scene)

    def read_issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the whole description, by the pointer of its field."""
        from optim.identification.fit import read_unknowns
        from optim.identification.reading import read_data

        try:
            known = read_unknowns(scene, self.unknowns, self.scaling, self.priors)
            self.look_further(scene, read_data(scene, self.data, known.paths), known)
        except SceneError as error:
            return [issue.at("data") for issue in error.issues]
        except SettingError as error:
            return [error.issue.at(*(error.place or ("data",)))]
        return []

    def look_further(self, _scene: Scene, _runs: tuple[MeasuredRows, ...], _unknowns: Unknowns) -> None:
        """Raise SceneError or SettingError for what is wrong beyond that."""


class Identify(Measured):
    """Find parameters from measured responses and hysteresis loops.

    Least squares over whole responses, from many starts: estimates with 95 % intervals, what the data do not
    tell, and which measurement would tell most.
    """

    EXAMPLES = (
        {
            "scene": "two-dof",
            "harmonics": 3,
            "starts": 2,
            "data": [
                {
                    "frequency": [1.0, 1.1, 1.2, 1.3, 1.4],
                    "amplitude": [1.93, 2.12, 1.77, 1.48, 1.25],
                    "conditions": {"excitation.amplitude": 100.0, "damper.N0": 100.0},
                }
            ],
            "unknowns": {"damper.mu": [0.1, 0.6]},
        },
    )
    NAME, FUNCTION, RESULT = "identify", "optim:identify", identify_result
    ASKS = Question("Which values do my measurements give?", "rig")
    TOLD = "optim.views.tables.studies:identification"
    SHOWS = "estimates, intervals, what the data do not tell ([identification](identification.md))"
    EMPTY, COUNTED = ("runs", "there is no fit to draw"), "places"
    FIGURE = "optim.views.plots.figures:identification_figure"

    robust: bool = Field(default=False, description="Let outliers weigh less (Huber).")
    candidates: Annotated[dict[ParameterPath, _Values] | None, Flag("--candidate", "PATH=V,V,…")] = Field(
        default=None,
        max_length=10,
        description="Conditions of measurements that could be made next: path to values.",
    )

    def look_further(self, scene: Scene, runs: tuple[MeasuredRows, ...], unknowns: Unknowns) -> None:
        """Raise what is wrong with the candidates."""
        from optim.identification.information import read_candidates

        read_candidates(scene, runs, unknowns, self.candidates)
