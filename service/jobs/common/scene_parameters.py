"""What the service says of a scene beside its tables: parameters, joints, what studies begin with."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from optim.problem.problem_keys import ABOVE, BELOW, default_variable
from service.jobs.names import there
from service.jobs.study import Proposed, rounded, study_named
from solver.contacts.laws.contact_parts import Span
from solver.scene.bodies.shape_parts import SPEED
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import Scene

_AROUND = 3.0  # of a value, the bounds between which it is identified


class StudyProposal(BaseModel):
    """A study of a scene as it would be asked."""

    model_config = ConfigDict(frozen=True)

    kind: str
    title: str = Field(description="The question that it answers, for people.")
    group: str = Field(description="damper, life, engine, rig or checks.")
    body: dict[str, Any] = Field(description="Keys beside the scene that the scene itself suggests.")
    assumed: list[str] = Field(description="Those of them that the scene does not say.")
    of_peak: dict[str, float] = Field(
        description="Further keys: which share of the highest peak of the response is proposed."
    )
    points: int | None = Field(
        description="Points of a response, as the plan prices one, that cost as much, about; null: not known."
    )
    refused: str | None = Field(description="Why the scene has no such study; null: it has.")


def proposals(scene: Scene) -> list[StudyProposal]:
    """Return what a scene suggests for the studies that come with the package, in the order of questions."""
    found = []
    for study in (study_named(name) for name in there()):
        told, asks = study.propose(scene), study.ASKS
        proposed = Proposed() if isinstance(told, str) else told
        found.append(
            StudyProposal(
                kind=study.NAME, title=asks.title, group=asks.group, body=dict(proposed.body),
                assumed=list(proposed.assumed), of_peak=dict(proposed.of_peak),
                points=None if asks.points is None else asks.points * proposed.times,
                refused=told if isinstance(told, str) else None,
            )
        )  # fmt: skip
    return found


def designed(scene: Scene) -> Mapping[str, list[float]]:
    """Return what is designed by itself, with its range; nothing where the scene suggests none."""
    path = default_variable(scene)
    if path is None:
        return {}
    part = {part.name: part for part in (*scene.contacts, *scene.dampers)}.get(path.partition(".")[0])
    bounds = _described(scene, path, part, path.rpartition(".")[2]).bounds
    return {} if bounds is None else {path: bounds}


def design_bounds(value: float, low: float, high: float, *, logarithmic: bool) -> list[float] | None:
    """Return bounds to design a parameter between, around its value and within what a slider covers.

    Parameters
    ----------
    value : of the parameter; below 0 nothing is proposed.
    low, high, logarithmic : of its slider.
    """
    if value < 0.0 or (value == 0.0 and not logarithmic):
        return None
    if value == 0.0:
        return [rounded(low), rounded(high)]
    return [rounded(value / BELOW), rounded(value * ABOVE if logarithmic else min(value * ABOVE, high))]


def around(value: float) -> list[float]:
    """Return bounds to identify a parameter between."""
    return sorted((rounded(value / _AROUND), rounded(value * _AROUND)))


GROUND = "ground"


class JointAnswer(BaseModel):
    """A contact, or a damper with the contacts it brings along."""

    model_config = ConfigDict(frozen=True)

    name: str
    law: str = Field(description="Of a damper its shape.")
    between: list[str] = Field(description="Two DOFs or the ground; of a place its first DOF.")
    at: list[float] | None = Field(description="Where it is, in a scene with places.")
    contacts: list[str] = Field(description="Contacts it stands for, as states and limits name them.")
    friction: bool = Field(description="Whether a normal load presses it, which may be kept from opening.")


def joints(scene: Scene) -> list[JointAnswer]:
    """Return every contact that stands by itself, then the dampers."""
    by_name = {contact.name: contact for contact in scene.contacts}
    brought = {damper.name: damper.contacts() for damper in scene.dampers}
    of_dampers = {table["name"] for tables in brought.values() for table in tables}
    found = []
    for name, contact in by_name.items():
        if name in of_dampers:
            continue
        at = contact.at if contact.at is not None else _place(scene, contact.between)
        found.append(
            JointAnswer(
                name=name, law=contact.LAW, between=[_dof(scene, end) for end in contact.between],
                at=None if at is None else list(at), contacts=[name], friction=contact.load is not None,
            )
        )  # fmt: skip
    for damper in scene.dampers:
        tables = brought[damper.name]
        names = [table["name"] for table in tables]
        ends = getattr(damper, "between", tables[0]["between"])
        found.append(
            JointAnswer(
                name=damper.name, law=damper.shape, between=[_dof(scene, end) for end in ends],
                at=tables[0]["at"], contacts=names,
                friction=any(by_name[name].load is not None for name in names),
            )
        )  # fmt: skip
    return found


def _dof(scene: Scene, end: str) -> str:
    """Return the first DOF of a place, with the sector it is in; a body stands still in a drawing."""
    name, at, sector = end.partition("@")
    node = next((node for node in scene.nodes if node.name == name), None)
    if node is not None:
        return f"{node.dofs[0][1]}{at}{sector}"
    return GROUND if any(body.name == name for body in scene.bodies) else end


def _place(scene: Scene, ends: Sequence[str]) -> Sequence[float] | None:
    """Return the place of the node in this sector that a contact holds."""
    own = {end for end in ends if "@" not in end}
    for node in scene.nodes:
        if node.name in own or own & {dof for _, dof in node.dofs}:
            return node.at
    return None


_INSIDE = 0.99
_FORCE, _FORCES = "excitation.amplitude", 20.0  # a slider covers the force over that, to that times it


class SliderAnswer(BaseModel):
    """What a slider covers."""

    model_config = ConfigDict(frozen=True)

    low: float
    high: float
    logarithmic: bool


class SceneParameterAnswer(BaseModel):
    """A number of a scene that may be set, swept over and designed."""

    model_config = ConfigDict(frozen=True)

    path: str
    part: str = Field(description="The contact, damper, body or load that has it.")
    name: str
    symbol: str
    unit: str = Field(description="Empty of a pure number.")
    words: str
    value: float
    otherwise: list[str] | None = Field(
        description="Paths whose product it is, where the scene leaves it out; null: it is written down."
    )
    slider: SliderAnswer | None = Field(description="What a slider covers, as values; null: it has none.")
    bounds: list[float] | None = Field(description="Between which it may be designed; null: hardly worth it.")
    around: list[float] | None = Field(description="Between which it may be identified; null: as `bounds`.")


class SceneParameterList(BaseModel):
    """What is known of a scene beside its tables."""

    items: list[SceneParameterAnswer] = Field(
        description="Those of a part one after the other: what is designed by itself first, geometry last."
    )
    joints: list[JointAnswer] = Field(description="What a drawing shows between its parts.")
    studies: list[StudyProposal] = Field(description="What its studies begin with.")


def scene_parameters(scene: Scene) -> SceneParameterList:
    """Return what can be said of every parameter of the parts of a scene, of its force and of its speed."""
    parts = {part.name: part for part in (*scene.contacts, *scene.bodies, *scene.loads, *scene.dampers)}
    items = []
    for path in sorted(scene.parameter_paths(), key=_order(scene)):
        owner, _, name = path.rpartition(".")
        if owner in parts or path == SPEED:
            items.append(_described(scene, path, parts.get(owner), name))
    if _FORCE in scene.parameter_paths():
        items.append(_force(scene))
    return SceneParameterList(items=items, joints=joints(scene), studies=proposals(scene))


def _order(scene: Scene) -> Callable[[str], tuple[int, bool, bool]]:
    """How paths are told: by their owners, as the scene has them, first what is designed by itself."""
    owners = {path.rpartition(".")[0]: i for i, path in reversed([*enumerate(scene.parameter_paths())])}
    first = (default_variable(scene) or "").rpartition(".")[2]

    def place(path: str) -> tuple[int, bool, bool]:
        owner, _, name = path.rpartition(".")
        return owners[owner], parameter_of(scene, path).moves_contacts, name != first

    return place


def _force(scene: Scene) -> SceneParameterAnswer:
    value = scene.value(_FORCE)
    size = abs(value) or 1.0
    slider = SliderAnswer(low=size / _FORCES, high=size * _FORCES, logarithmic=True)
    owner, _, name = _FORCE.rpartition(".")
    return SceneParameterAnswer(
        path=_FORCE, part=owner, name=name, symbol="f0", unit=parameter_of(scene, _FORCE).unit,
        words="Amplitude of the force.", value=value, otherwise=None, slider=slider, bounds=None,
        around=around(value) if value else None,
    )  # fmt: skip


def _described(scene: Scene, path: str, part: object, name: str) -> SceneParameterAnswer:
    found = parameter_of(scene, path)
    owner = path.rpartition(".")[0]
    value, quantity = found.get(), found.quantities[0] if found.quantities else None
    given = getattr(part, name, value) is not None
    otherwise = None if given or quantity is None else quantity.otherwise
    span, slider = found.span(name) if given or otherwise else None, None
    field = type(part).model_fields.get(name) if isinstance(part, BaseModel) else None
    if span is not None:
        slider = _slider(scene, path, span, value, _least_and_most(field))
    bounds = None
    if slider is not None:
        bounds = design_bounds(value, slider.low, slider.high, logarithmic=slider.logarithmic)
    return SceneParameterAnswer(
        path=path, part=owner or path, name=name, symbol=(quantity.symbol if quantity else "") or name,
        unit=found.unit, words=(field.description if field else None) or "", value=value,
        otherwise=None if otherwise is None else [f"{owner}.{other}" for other in otherwise],
        slider=slider, bounds=bounds, around=around(value) if value else None,
    )  # fmt: skip


def _slider(scene: Scene, path: str, span: Span, value: float, ends: tuple[float, float]) -> SliderAnswer:
    """What a slider covers as values: around the size that it is told in, on one side of a negative value."""
    if span.of is None:
        size = 1.0
    else:
        owner = path.rpartition(".")[0]
        size = abs(scene.value(f"{owner}.{span.of}" if owner else span.of)) or 1.0
    low, high = span.low * size, span.high * size
    negative = value < 0.0
    low, high = max(-high if negative else low, ends[0]), min(high, ends[1])
    return SliderAnswer(low=low, high=high, logarithmic=span.logarithmic and not negative)


def _least_and_most(field: FieldInfo | None) -> tuple[float, float]:
    """What the schema of scenes allows; of an open end, a little inside."""
    low, high = -math.inf, math.inf
    for bound in () if field is None else field.metadata:
        low = max(low, getattr(bound, "ge", low), _INSIDE * getattr(bound, "gt", low))
        high = min(high, getattr(bound, "le", high), _INSIDE * getattr(bound, "lt", high))
    return low, high
