"""A study: its keys, each said once, what it computes and what people see of it.

From one class follow the body of a request with its schema and its refusals, the kind of job, the spec that a
worker is given, the command of its name and ``submit``, and the row in the documentation. The keys have the
names of the arguments of the function that computes.

Here and elsewhere in the service, what brings SciPy or the compiled loops of the solver along is imported
where it is used: the help of a command, and a service that only lists, do not need them.
"""

from __future__ import annotations

import enum
import inspect
import math
from abc import abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from pydantic import BaseModel, ConfigDict

from service.jobs.common.scene_requests import (
    CHECKED_BY,
    SCENE,
    HarmonicRequest,
    SceneRequest,
    require,
    resolve_scene,
    resolved,
    stored_scene,
)
from service.jobs.kind_registry import (
    JobKind,
    Json,
    KindView,
    NothingToDrawError,
    ReadSweep,
    Resolved,
    SceneSource,
    StoredSweep,
    Tell,
)
from service.jobs.names import home_of
from solver.errors import Issue, SettingError
from solver.first_use import on_demand
from solver.results.watch import part_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from service.jobs.outputs import JobOutput, OnProgress, Progress, ShouldStop
    from service.jobs.stored_figures import SweepRecord
    from solver.results.files import Dataset
    from solver.results.told import Told
    from solver.scene.scene import Scene


def rounded(value: float, digits: int = 3) -> float:
    """Return a number as it is proposed."""
    return float(f"{value:.{digits}g}")


def middle_hz(scene: Scene) -> float:
    """Return the middle of the band as it is proposed."""
    low, high = scene.observe.band
    return rounded(math.sqrt(low * high) if low > 0.0 else high / 2.0, 4)


def first_order(scene: Scene) -> int:
    """Return the engine order of the first force that has one; 0 without."""
    return next((one.engine_order for one in scene.excitation if one.engine_order is not None), 0)


NO_SECTORS = "The scene is one blade: it has no sectors."


class Watch(NamedTuple):
    """Who watches a computation: how far it is, and whether it is to end."""

    on_progress: OnProgress | None = None
    should_stop: ShouldStop | None = None

    def part(self, begin: float, end: float, before: int = 0) -> Watch:
        """Return who watches a part, from `begin` to `end` of the whole, behind so many points."""
        return Watch(part_of(self.on_progress, begin, end, before), self.should_stop)


class Writable(Protocol):
    """What can be written as a table."""

    def to_dataset(self) -> Dataset:
        """The result as named arrays."""


class Drawable(Writable, Protocol):
    """What can be drawn too."""

    def plot(self) -> Figure:
        """The picture of it."""


class StudyResult(Drawable, Protocol):
    """A result of a study."""

    @property
    def reached(self) -> bool:
        """Whether it is what was asked for."""

    @property
    def status(self) -> enum.Enum:
        """How it ended; the value is a sentence that says what to try."""

    def to_json(self) -> dict[str, Any]:
        """The result as JSON."""


class Answer(NamedTuple):
    """What a study found: the result that is written, its JSON, how it ended, and what draws it."""

    result: Writable | None
    json: dict[str, Any]
    reached: bool
    status: str
    plot: Callable[[], Figure] | None = None

    @classmethod
    def of(cls, found: StudyResult) -> Answer:
        """Return what a result says of itself."""
        return cls(found, found.to_json(), found.reached, str(found.status.value), found.plot)

    @classmethod
    def told(cls, json: dict[str, Any]) -> Answer:
        """Return an answer of which there is nothing but its JSON."""
        return cls(None, json, True, "")

    def beside(self, result: Drawable, **further: Any) -> Answer:
        """Return the answer with further keys, drawn and written as another result."""
        return self._replace(result=result, json={**self.json, **further}, plot=result.plot)


class Question(NamedTuple):
    """How a designer asks for a study, and what it takes: points of a response, as the plan prices one."""

    title: str
    group: str  # damper, life, engine, rig or checks
    points: int | None = None


class Proposed(NamedTuple):
    """Keys of a body that a scene suggests: which of them it does not say itself but are assumed, those that
    are a share of the highest peak of its response, and how often it takes the points of the question."""

    body: Json = MappingProxyType({})
    assumed: Sequence[str] = ()
    of_peak: Mapping[str, float] = MappingProxyType({})
    times: int = 1


class Study(SceneRequest):
    """Root of the studies: the keys are fields, an alias is how bodies and options call one.

    A subclass says its NAME, EXAMPLES of bodies, the FUNCTION that computes (``"solver:track_peak"``), the
    model of its RESULT; which arguments of the function are GROUPED, objects of a class whose fields are keys
    (``{"search": "solver:WorstSearch"}``); for people what it SHOWS, by which function a result is TOLD,
    which SWEEPS it stores, what its progress has COUNTED; of its picture what makes the FIGURE, and the key
    that is EMPTY where there is none, with what is said then; which question it ASKS. Its docstring is the
    help of the command, the first line of which is its summary.
    """

    model_config = ConfigDict(validate_by_alias=True, defer_build=True)

    NAME: ClassVar[str]
    EXAMPLES: ClassVar[tuple[Json, ...]]
    FUNCTION: ClassVar[str]
    RESULT: ClassVar[type[BaseModel] | Callable[[], type[BaseModel]]]
    TOLD: ClassVar[str] = ""
    SHOWS: ClassVar[str]
    SWEEPS: ClassVar[str] = ""
    COUNTED: ClassVar[str] = "points"
    GROUPED: ClassVar[Mapping[str, str]] = {}
    EMPTY: ClassVar[tuple[str, str]]
    FIGURE: ClassVar[str]
    ASKS: ClassVar[Question]

    @classmethod
    def __pydantic_init_subclass__(cls, **_config: Any) -> None:
        """Let the schema of the body have the examples."""
        if "EXAMPLES" in vars(cls):
            cls.model_config["json_schema_extra"] = {"examples": [dict(one) for one in cls.EXAMPLES]}

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what is wrong for the scene, beyond the types of the keys."""
        return []

    @abstractmethod
    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large for one job."""

    @classmethod
    def propose(cls, _scene: Scene) -> Proposed | str:
        """Return what a scene suggests, or why it has no such study."""
        return Proposed()

    @classmethod
    def lacks(cls, given: Collection[str]) -> bool:
        """Return whether it can not be asked with these keys alone."""
        fields = ((name, cls.model_fields[name]) for name in cls.own_keys())
        return any(field.is_required() and name not in given for name, field in fields)

    @classmethod
    def completed(cls, scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return what was asked; where that is not enough, with what the scene suggests for all else."""
        if not cls.lacks(given):
            return dict(given)
        found = cls.propose(scene)
        if isinstance(found, str):
            why = f"{found[:1].lower()}{found[1:-1]}"
            raise SettingError("scene", scene.name, f"is not for `{cls.NAME}`: {why}")
        names = {field.alias or name: name for name, field in cls.model_fields.items()}
        body = {names[key]: value for key, value in found.body.items()}
        body.update(given)
        if missing := {names[key]: share for key, share in found.of_peak.items() if names[key] not in body}:
            branch = on_demand("solver:sweep")(scene, harmonics=body.get("harmonics", 11))
            body |= {name: rounded(share * branch.peak.value) for name, share in missing.items()}
        return body

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Compute what was asked, by keys that are the function's; left out, its own defaults count."""
        found = on_demand(cls.FUNCTION)(scene, **cls.grouped(asked), **watch._asdict())
        return Answer.of(found)

    @classmethod
    def grouped(cls, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Return what was asked as the function takes it: keys that are fields of a class in one object."""
        given = dict(asked)
        for argument, place in cls.GROUPED.items():
            made = on_demand(place)
            own = inspect.signature(made).parameters.keys() & given.keys()
            given[argument] = made(**{name: given.pop(name) for name in own})
        return given

    @classmethod
    def result_class(cls, _result: Json) -> type[Told]:
        """Return the class of a stored result: what the function is said to give."""
        function: Any = inspect.unwrap(on_demand(cls.FUNCTION))
        found: type[Told] = function.__globals__[function.__annotations__["return"]]
        return found

    @classmethod
    def sweeps(cls, _found: Any) -> tuple[SweepRecord, ...]:
        """Return the responses to be stored."""
        return ()

    @classmethod
    def tell(cls) -> Tell | None:
        """Return what puts a result in words."""
        return (lambda result: on_demand(cls.TOLD)(result)) if cls.TOLD else None

    @classmethod
    def drawn(cls) -> bool:
        """Return whether there are pictures of it."""
        return hasattr(cls, "FIGURE") or any("figure" in vars(one) for one in cls.__mro__ if one is not Study)

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw; empty if there is."""
        key, why = cls.EMPTY
        return "" if result.get(key) else why

    @classmethod
    def figure(cls, result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
        """Return the picture of a stored result that is not empty."""
        made: Figure = on_demand(cls.FIGURE)(result)
        return made

    @classmethod
    def own_keys(cls) -> list[str]:
        """Return the names of what is asked beside the scene, in order."""
        of_harmonics = [name for name in HarmonicRequest.model_fields if name in cls.model_fields]
        apart = {*SceneRequest.model_fields, *of_harmonics}
        own = [name for name in cls.model_fields if name not in apart]
        return own + [name for name in of_harmonics if name not in SceneRequest.model_fields]

    def spec(self, _scene: Scene) -> dict[str, Any]:
        """Return what a worker is given beside the scene, as JSON."""
        return self.model_dump(mode="json", include=set(self.own_keys()))

    @classmethod
    def asked(cls, spec: Mapping[str, Any]) -> tuple[Scene, dict[str, Any]]:
        """Return the scene of a spec, and the keys that were given."""
        # A job that an earlier version took may have the keys of its body.
        by_key = {field.alias or name: name for name, field in cls.model_fields.items()}
        given = {
            by_key.get(key, key): value
            for key, value in spec.items()
            if value is not None and key not in (SCENE, CHECKED_BY)
        }
        known = cls.own_keys()
        for key in given.keys() - set(known):
            raise SettingError(key, given[key], "is no key of this version: submit the job again")
        return stored_scene(spec), {name: given[name] for name in known if name in given}

    @classmethod
    def run(cls, spec: Mapping[str, Any], progress: Progress, should_stop: ShouldStop) -> JobOutput:
        """Compute a spec, in a worker."""
        answer = cls.compute(*cls.asked(spec), Watch(progress, should_stop))
        return cls.output(answer, cls.sweeps(answer.result))

    @classmethod
    def output(cls, answer: Answer, sweeps: Sequence[SweepRecord]) -> JobOutput:
        """Return what a worker gives back."""
        # Loaded here: the command stores nothing.
        from service.jobs.outputs import JobOutput

        shortfall = None if answer.reached else answer.status
        return JobOutput(result=answer.json, sweeps=tuple(sweeps), shortfall=shortfall)

    @classmethod
    def draw(cls, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
        """Return the picture of a stored result."""
        if why := cls.empty(result):
            raise NothingToDrawError(why)
        return cls.figure(result, sweeps, read)

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job."""
        summary = (inspect.getdoc(cls) or "").partition("\n")[0]
        return JobKind(
            name=cls.NAME, summary=summary, request=cls, resolve=resolve, run=cls.run, result=cls.RESULT,
            view=KindView(
                result=cls.SHOWS, sweeps=cls.SWEEPS, tell=cls.tell(), draw=cls.draw if cls.drawn() else None
            ),
        )  # fmt: skip


def resolve(request: Study, source: SceneSource) -> Resolved:
    """Look up the scene of a study and check what is asked of it; the spec has its keys."""
    scene = resolve_scene(request, source)
    require(request.issues(scene) or request.sizes(scene))
    return resolved(scene, **request.spec(scene))


def study_named(name: str) -> type[Study]:
    """Return a study that comes with the service or the lab; its module has it alone."""
    module = import_module(home_of(name))
    made: list[type[Study]] = [one for one in vars(module).values() if getattr(one, "NAME", "") == name]
    return made[-1]
