"""The kind `identify`: parameters of a scene from measured responses and hysteresis loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

import optim
from optim.criteria.json_types import Pair
from optim.errors import DesignError
from optim.identification.result import Identification
from optim.problem.keys import MAX_VARIABLES, VariableName
from optim.problem.words import ScalingWord
from service.jobs.common.results import Table, result_model
from service.jobs.common.scenes import HarmonicRequest, Number, ParameterPath, refusal, require, resolve_scene
from service.jobs.common.scenes import resolved as spec_of
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_view import Json, KindView, NothingToDrawError, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput, Progress, ShouldStop
from service.jobs.registry import JobKind, Resolved, SceneSource
from solver.errors import Issue, SceneError, SettingError, pointer
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_TABLES, MOST_NUMBERS = 200, 200_000
EVALUATIONS = 30
"""Of all points one identification seldom has more."""
_EXAMPLE: dict[str, Any] = {
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
}


def _small(value: object) -> object:
    """Lists of numbers and tables of words, not too many; what they mean the design layer looks at."""
    if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
        raise ValueError("must be a list of tables: files are read by the command")
    lists = [item for table in value for item in table.values() if isinstance(item, list)]
    if sum(map(len, lists)) > MOST_NUMBERS:
        raise ValueError(f"must hold at most {MOST_NUMBERS} numbers")
    return value


class IdentifyRequest(HarmonicRequest):
    """An identification, in the words of the command; data are tables in place of files."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    data: Annotated[
        list[dict[str, Any]], BeforeValidator(_small), Field(min_length=1, max_length=MOST_TABLES)
    ] = Field(
        description="Measured runs: tables of columns (lists), `conditions` (path to value), `units` "
        "(column to unit) and words such as `dof`."
    )
    unknowns: Annotated[dict[VariableName, Pair], Field(min_length=1, max_length=MAX_VARIABLES)] = Field(
        description="Parameters looked for: path to [low, high]."
    )
    scaling: dict[VariableName, ScalingWord] | None = Field(
        default=None,
        max_length=MAX_VARIABLES,
        description="Whether equal steps or equal ratios of an unknown count equally; by its bounds.",
    )
    priors: dict[VariableName, Pair] | None = Field(
        default=None,
        max_length=MAX_VARIABLES,
        description="What was known before: path to [mean, standard deviation].",
    )
    noise: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] | None = Field(
        default=None, description="Noise relative to the amplitude; found from the data if left out."
    )
    robust: bool = Field(default=False, description="Let outliers weigh less (Huber).")
    candidates: dict[ParameterPath, Annotated[list[Number], Field(min_length=1, max_length=100)]] | None = (
        Field(
            default=None,
            max_length=10,
            description="Conditions of measurements that could be made next: path to values.",
        )
    )
    starts: Annotated[int, Field(strict=True, ge=1, le=1000)] = Field(
        default=16, description="Places within the bounds that are tried."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**53)] = Field(
        default=0, description="Of those places."
    )


class EstimateResult(BaseModel):
    """An unknown with how sure it is; bounds in place of an interval where the data do not tell it."""

    model_config = ConfigDict(extra="allow", defer_build=True)

    name: str
    unit: str
    value: float
    standard_error: float | None
    interval: list[float]
    told: bool
    at_bound: bool


IdentifyResult = result_model(
    Identification, "IdentifyResult", estimates=list[EstimateResult], correlated=list[Table],
    covariance=list[list[float]], correlation=list[list[float]],
)  # fmt: skip
_ARGUMENTS = ("scaling", "priors", "noise", "robust", "candidates", "starts", "seed", "harmonics")


def resolve(request: IdentifyRequest, source: SceneSource) -> Resolved:
    """Look up the scene, read data and unknowns against it, check the size."""
    scene = resolve_scene(request, source)
    points = sum(
        max((len(v) for v in table.values() if isinstance(v, list)), default=0) for table in request.data
    )
    require(
        balance_issues("/data", scene, request.harmonics, EVALUATIONS * max(points, 1), "points of all runs")
    )
    require(_issues(request, scene))
    given = {key: getattr(request, key) for key in _ARGUMENTS}
    return spec_of(scene, data=request.data, unknowns=request.unknowns, **given)


def _issues(request: IdentifyRequest, scene: Scene) -> list[Issue]:
    """Read the whole description, as a run will; what is refused has the pointer of its field."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.identification.next_measurement import read_candidates
    from optim.identification.reading import read_data
    from optim.identification.unknowns import read_unknowns

    try:
        known = read_unknowns(scene, request.unknowns, request.scaling, request.priors)
        runs = read_data(scene, request.data, known.paths)
        read_candidates(scene, runs, known, request.candidates)
    except SceneError as error:
        return [Issue(pointer=pointer("data"), message=issue.message) for issue in error.issues]
    except (DesignError, SettingError) as error:
        return [refusal(pointer(*(error.place or ("data",))), str(error))]
    return []


def run(spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
    """Identify, in a worker."""
    found = optim.identify(
        Scene.from_dict(spec["scene"]), spec["data"], spec["unknowns"],
        **{key: spec[key] for key in _ARGUMENTS}, on_progress=progress, should_stop=should_stop,
    )  # fmt: skip
    return JobOutput.of(found, reached=found.reached)


def draw(result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
    """The fit over the data."""
    from optim.views.plots.identification import identification_figure

    if not result["runs"]:
        raise NothingToDrawError("there is no fit to draw")
    return identification_figure(result)


IDENTIFY = JobKind(
    name="identify",
    summary="Parameters from measured responses and hysteresis loops, with how sure they are.",
    request=IdentifyRequest,
    resolve=resolve,
    run=run,
    result=IdentifyResult,
    view=KindView(
        result="estimates, intervals, what the data do not tell ([identification](identification.md))",
        flags={"unknowns": "--unknown", "priors": "--prior", "candidates": "--candidate"},
        draw=draw,
    ),
)
