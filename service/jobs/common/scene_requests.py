"""What every kind that works on a scene shares: the words of the request and their resolution."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from functools import cache, lru_cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any, Protocol

from pydantic import BeforeValidator, Field, WithJsonSchema

from optim.criteria.key import LEAST as LEAST
from optim.criteria.key import FrequencyHz as FrequencyHz
from optim.criteria.key import Harmonics as Harmonics
from optim.criteria.key import NotNegative as NotNegative
from optim.criteria.key import Number as Number
from optim.criteria.key import ParameterPath as ParameterPath
from optim.criteria.key import PositiveNumber as PositiveNumber
from service.errors import InvalidRequestError
from service.jobs.kind_registry import Flag, JobRequest, Resolved, SceneSource
from service.jobs.strict_json import digest
from solver.errors import Issue, SceneError, SettingError
from solver.scene.descriptions import DAMPER_LOAD
from solver.scene.toml import shipped_scenes
from solver.wording import nearest

if TYPE_CHECKING:
    from solver.scene.scene import Scene


MOST_SET = 1000
UPLOAD = "upload:"
"""What stands before the id of an upload where a scene file names a file."""
FILE_KEYS = ("M", "K", "C", "G", "K_omega2", "modes", "mapping", "diameters", "nodes")
"""Of a structure of kind `matrices`; files also stand in its tables `cyclic` and `parts`."""

Place = tuple[str, ...]
"""Keys that lead to a value in a structure."""
SCENE, CHECKED_BY = "scene", "checked_by"
"""Keys of a spec."""

_SCENE_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")


def _scene_reference(value: object) -> object:
    """A name or an object; a path never: the service reads no files for its clients."""
    if isinstance(value, dict) or (isinstance(value, str) and _SCENE_NAME.fullmatch(value)):
        return value
    raise ValueError("must be the name of a shipped or stored scene, or a scene as an object")


def _few(value: object) -> object:
    """Too many are not looked at one by one, to be told what is wrong with each."""
    if isinstance(value, dict) and len(value) > MOST_SET:
        raise ValueError(f"must have at most {MOST_SET} values, got {len(value)}")
    return value


SceneReference = Annotated[
    Any,
    BeforeValidator(_scene_reference),
    WithJsonSchema({"anyOf": [{"type": "string", "pattern": _SCENE_NAME.pattern}, {"type": "object"}]}),
]


SetValues = Annotated[dict[ParameterPath, Number], BeforeValidator(_few)]


class SceneRequest(JobRequest):
    """A request about a scene."""

    scene: SceneReference = Field(description="Name of a shipped or stored scene, or the scene as an object.")
    set: SetValues = Field(
        default={}, max_length=MOST_SET, description=f'Values of parameters, {{"{DAMPER_LOAD}": 100}}.'
    )


class HarmonicRequest(SceneRequest):
    """A request answered by harmonic balance."""

    harmonics: Annotated[Harmonics, Flag(metavar="H")] = Field(
        default=11, description="Highest harmonic of the balance."
    )


class OfScene(Protocol):
    """What names a scene and sets values of it."""

    @property
    def scene(self) -> Any:
        """Its name, or the scene as an object."""

    @property
    def set(self) -> Mapping[str, float]:
        """Values by their paths."""


def resolve_scene(request: OfScene, source: SceneSource) -> Scene:
    """The scene of a request with its values set.

    InvalidRequestError with pointers below ``/scene`` and ``/set``.
    """
    scene = _read(request.scene, source)
    issues: list[Issue] = []
    for path, value in request.set.items():
        try:
            scene = scene.with_values({path: value})
        except SettingError as error:
            issues.append(error.issue.at("set", path))
    if issues:
        raise InvalidRequestError(issues)
    return scene


@lru_cache(maxsize=64)
def shipped_scene(name: str) -> Scene | None:
    """The scene of this name that comes with the package, read once; None for another one."""
    from solver.scene.scene import load_scene

    return load_scene(name) if name in shipped_scenes() else None


def _read(reference: object, source: SceneSource) -> Scene:
    shipped = shipped_scene(reference) if isinstance(reference, str) else None
    if shipped is not None:
        return shipped
    body = source.scene_body(reference) if isinstance(reference, str) else reference
    if not isinstance(body, Mapping):
        hint = nearest(str(reference), shipped_scenes())
        raise InvalidRequestError.of(
            ("scene",), f"{reference!r} is neither a shipped scene nor a stored one{hint}"
        )
    if body is reference and refers_to_uploads(body):
        try:
            body = source.with_uploads(body)
        except InvalidRequestError as error:
            raise InvalidRequestError([issue.below(SCENE) for issue in error.issues]) from error
    return read_scene(body, SCENE)


def refers_to_uploads(body: Mapping[str, object]) -> bool:
    """Whether the structure of a scene names uploads."""
    structure = body.get("structure")
    return isinstance(structure, Mapping) and any(
        name.startswith(UPLOAD) for name in named_files(structure).values()
    )


def named_files(structure: Mapping[str, Any]) -> dict[Place, str]:
    """What stands in a structure where a file may be named, in place of numbers: text by its place."""
    places: list[Place] = [(key,) for key in FILE_KEYS]
    places += [("cyclic", "nodes")]
    parts = structure.get("parts")
    places += [("parts", name) for name in parts] if isinstance(parts, Mapping) else []
    found = {}
    for place in places:
        table = structure if len(place) == 1 else structure.get(place[0])
        given = table.get(place[-1]) if isinstance(table, Mapping) else None
        if isinstance(given, str):
            found[place] = given
    return found


def with_named(structure: Mapping[str, Any], names: Mapping[Place, str]) -> dict[str, Any]:
    """A structure with other names of files at these places."""
    changed = dict(structure)
    for place, name in names.items():
        changed[place[0]] = name if len(place) == 1 else {**changed[place[0]], place[1]: name}
    return changed


def read_scene(body: Mapping[str, object], *place: str) -> Scene:
    """A scene from a request body.

    InvalidRequestError with everything that is wrong, with subjects below `place`.
    """
    from solver.scene.scene import Scene

    try:
        return Scene.from_dict(body)
    except SceneError as error:
        raise InvalidRequestError([issue.below(*place) for issue in error.issues]) from error


def check(attempt: Callable[[], object], *place: str | int) -> list[Issue]:
    """Nothing if `attempt` goes through; its SettingError otherwise, of `place` if one is given."""
    try:
        attempt()
    except SettingError as error:
        return [error.issue.at(*place) if place else error.issue]
    return []


def require(issues: list[Issue]) -> None:
    """Raise InvalidRequestError if there are issues."""
    if issues:
        raise InvalidRequestError(issues)


def resolved(scene: Scene, **settings: object) -> Resolved:
    """The spec of a request about `scene`, which says what version checked it; the settings are JSON."""
    body = scene.to_dict()
    spec = {SCENE: body, CHECKED_BY: installed(), **settings}
    return Resolved(spec=spec, scene_name=scene.name, scene_hash=digest(body))


def stored_scene(spec: Mapping[str, Any]) -> Scene:
    """The scene of a spec; it is checked again if another version did so.

    SceneError if it does not fit this version.
    """
    from solver.scene.scene import Scene

    if spec.get(CHECKED_BY) == installed():
        return Scene.from_checked(spec[SCENE])
    try:
        return Scene.from_dict(spec[SCENE])
    except SceneError as error:
        said = "was stored by another version and does not fit this one: submit the job again"
        raise SceneError([Issue((SCENE,), said), *(one.below(SCENE) for one in error.issues)]) from error


@cache
def installed() -> str:
    """The version of the package."""
    return version("stickslip")


# A load, in units of all forces together, under which nothing slips: resonances magnify the forces less, and
# the forces of the contacts keep enough digits beside it.
_HOLDS = 1e8


def linear_limit(scene: Scene, removed: Collection[str]) -> Scene:
    """The scene without the friction of some contacts, and with every other friction contact stuck.

    Contacts of other laws stay as they are.

    Parameters
    ----------
    scene : what vibrates.
    removed : names of the contacts that are removed.
    """
    load = _HOLDS * (sum(abs(force.amplitude) for force in scene.excitation) or 1.0)
    raw: dict[str, Any] = scene.to_dict()
    for table, contact in zip(raw["contacts"], scene.contacts, strict=True):
        changed = contact.linear_limit(load, gone=contact.name in removed) or {}
        table |= changed
        for key in (key for key, value in changed.items() if value is None):
            del table[key]
    return scene.from_dict(raw)
