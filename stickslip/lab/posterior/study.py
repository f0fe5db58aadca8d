"""The study `posterior`: what is known of parameters after measurements, of one model or of several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel

from optim.criteria.key import Name, Pair, PositiveNumber
from optim.problem.problem_keys import MAX_VARIABLES, VariableName
from service.errors import InvalidRequestError
from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import (
    MOST_SET,
    SceneReference,
    SetValues,
    require,
    resolve_scene,
    resolved,
)
from service.jobs.kind_registry import Flag, JobKind, Json, Resolved, SceneSource
from service.jobs.studies.identify_study import MOST_TABLES, Measured
from service.jobs.study import Answer, Question, Watch
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.results.told import Told
    from solver.scene.scene import Scene

_OF_VARIANTS = ("models", "weights", "varied", "assemblies")


class CompetingModel(BaseModel):
    """Another model of what was measured."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, defer_build=True)

    scene: SceneReference = Field(description="Name of a shipped or stored scene, or the scene as an object.")
    set: SetValues = Field(default={}, max_length=MOST_SET, description="Values of its parameters.")
    unknowns: dict[VariableName, Pair] = Field(
        min_length=1, max_length=MAX_VARIABLES, description="Its parameters looked for: path to [low, high]."
    )


@cache
def posterior_result() -> type[BaseModel]:
    """Return the schema of a posterior, of a choice between models, or of a population of assemblies."""
    samples = {"samples": list[list[float]]}
    one: Any = answered("optim:Posterior", "PosteriorResult", **samples)()
    choice: Any = answered("optim:ModelChoice", "ModelChoiceResult")()
    population: Any = answered("optim:Population", "PopulationResult", **samples)()

    class SampledResult(RootModel[one | choice | population]):
        """A posterior; with `models` a choice between them, with `varied` a population of assemblies."""

    return SampledResult


class PosteriorStudy(Measured):
    """Sample what is known of parameters after measurements.

    Samples with a diagnosis and the evidence of the model. With `models` the probability of each; with
    `varied` what differs from assembly to assembly.
    """

    EXAMPLES = ({
        "scene": "two-dof", "harmonics": 3, "starts": 2, "draws": 200,
        "data": [{
            "frequency": [1.0, 1.1, 1.2, 1.3, 1.4], "amplitude": [1.93, 2.12, 1.77, 1.48, 1.25],
            "conditions": {"excitation.amplitude": 100.0, "damper.N0": 100.0},
        }],
        "unknowns": {"damper.mu": [0.1, 0.6]},
    },)  # fmt: skip
    NAME, FUNCTION, RESULT = "posterior", "optim:posterior", posterior_result
    ASKS = Question("How sure are the values of my measurements?", "rig")
    TOLD, COUNTED = "stickslip.lab.posterior.tables:told", "places"
    SHOWS = "samples with intervals and evidence ([identification](identification.md#the-posterior-and-how-well-a-model-explains-the-data))"  # noqa: E501 - a link
    GROUPED: ClassVar = {"sampling": "optim:Sampling"}
    FIGURE = "stickslip.lab.posterior.pictures:drawn"
    EVALUATIONS = 1000

    draws: Annotated[int, Field(strict=True, ge=100, le=100_000), Flag(metavar="N")] = Field(
        default=600, description="Samples that are drawn."
    )
    sampler: Literal["auto", "importance", "nuts"] = Field(
        default="auto",
        description="Importance sampling, the no-U-turn sampler, or the latter where the former fails.",
    )
    models: dict[Name, CompetingModel] | None = Field(
        default=None, min_length=1, max_length=20,
        description="Further models to be compared with that of the scene, each with its scene and unknowns.",
    )  # fmt: skip
    weights: Annotated[dict[Name, PositiveNumber] | None, Flag(metavar="NAME=X")] = Field(
        default=None,
        description="How probable each of the `models` and the scene are before the data; equally.",
    )
    varied: Annotated[list[VariableName] | None, Field(max_length=MAX_VARIABLES), Flag(metavar="PATH")] = (
        Field(default=None, description="Unknowns that each assembly has a value of its own of.")
    )
    assemblies: Annotated[
        list[Annotated[int, Field(strict=True, ge=0, lt=MOST_TABLES)]] | None,
        Field(max_length=MOST_TABLES),
        Flag(metavar="N"),
    ] = Field(default=None, description="Number of the assembly that each of `data` is of; each its own.")

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what does not go together."""
        alone = {"weights": "models", "assemblies": "varied"}
        found = [
            Issue((key,), f"is for `{other}`", getattr(self, key))
            for key, other in alone.items()
            if getattr(self, key) is not None and getattr(self, other) is None
        ]
        kept = {"models": ("varied", "scaling", "priors"), "varied": ("priors",)}
        found += [
            Issue((key,), f"is not for `{other}`", getattr(self, key))
            for other, keys in kept.items()
            for key in keys
            if getattr(self, other) is not None and getattr(self, key) is not None
        ]
        return found

    def read_issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the whole description, of every model."""
        from optim.problem.checks import DesignError

        found = super().read_issues(scene)
        for name, one in (self.models or {}).items():
            if name == scene.name:
                found.append(Issue(("models", name), "is the name of the scene: call it otherwise", name))
            other = self.model_copy(update={"unknowns": one.unknowns, "models": None})
            found += [issue.below("models", name) for issue in other.read_issues(_scene_of(one.model_dump()))]
        if not found and self.assemblies is not None:
            try:
                _by_assembly(self.data, self.assemblies)
            except DesignError as error:
                found.append(error.issue)
        return found

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Sample the posterior, compare models, or find what differs from assembly to assembly."""
        from optim import compare_models, reassemblies

        variant = {key: asked[key] for key in _OF_VARIANTS if key in asked}
        given = cls.grouped({key: value for key, value in asked.items() if key not in variant})
        whole = {"sampling": given["sampling"], **watch._asdict()}
        if "models" in variant:
            models = {name: _model(name, one) for name, one in variant["models"].items()}
            models = {scene.name: (scene, given["unknowns"]), **models}
            found: Any = compare_models(models, given["data"], weights=variant.get("weights"), **whole)
        elif "varied" in variant:
            data = _by_assembly(given.pop("data"), variant.get("assemblies"))
            found = reassemblies(scene, data, varied=variant["varied"], **given, **watch._asdict())
        else:
            return super().compute(scene, asked, watch)
        return Answer.of(found)

    @classmethod
    def result_class(cls, result: Json) -> type[Told]:
        """Return the class of a stored result."""
        from optim import ModelChoice, Population, Posterior

        return Population if "assemblies" in result else ModelChoice if "models" in result else Posterior

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        if "models" in result:
            return "" if result["models"][0]["probability"] is not None else "no probabilities are known"
        return "" if result["samples"] else "there are no samples"

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job."""
        return replace(super().as_kind(), resolve=_resolve)


def _resolve(request: PosteriorStudy, source: SceneSource) -> Resolved:
    """Look up the scenes of all models, and check what is asked of them; the spec has them whole."""
    scene, models = resolve_scene(request, source), {}
    for name, one in (request.models or {}).items():
        try:
            other = resolve_scene(one, source).to_dict()
        except InvalidRequestError as error:
            raise InvalidRequestError([issue.below("models", name) for issue in error.issues]) from error
        models[name] = one.model_copy(update={"scene": other, "set": {}})
    filled = request.model_copy(update={"models": models or None})
    require(filled.issues(scene) or filled.sizes(scene))
    return resolved(scene, **filled.spec(scene))


def _model(name: str, given: Any) -> tuple[Scene, Mapping[str, Any]]:
    """Return scene and unknowns of another model."""
    from optim.problem.checks import DesignError

    if not isinstance(given, Mapping) or not {"scene", "unknowns"} <= given.keys():
        raise DesignError(("models", name), given, "must be a table with `scene`, `unknowns`, perhaps `set`")
    return _scene_of(given), given["unknowns"]


def _scene_of(given: Mapping[str, Any]) -> Scene:
    """Return the scene of another model: a table, or by its name or file where the command computes."""
    from solver.scene.scene import Scene, load_scene

    named = given["scene"]
    scene = Scene.from_dict(named) if isinstance(named, Mapping) else load_scene(named)
    return scene.with_values(given.get("set") or {})


def _by_assembly(data: list[Any], assemblies: list[int] | None) -> list[list[Any]]:
    """Return the data of each assembly; without numbers each table is one of its own."""
    from optim.problem.checks import DesignError

    numbers = list(range(len(data))) if assemblies is None else assemblies
    if len(numbers) != len(data):
        raise DesignError("assemblies", assemblies, f"must be {len(data)} numbers, one for each of `data`")
    found: dict[int, list[Any]] = {}
    for number, one in zip(numbers, data, strict=True):
        found.setdefault(number, []).append(one)
    return list(found.values())
