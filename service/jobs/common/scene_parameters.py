"""What the service says of a scene beside its tables: parameters, joints, what studies begin with."""

from __future__ import annotations

import math
from collections.abc import Callable

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from optim.problem.problem_keys import default_variable
from service.jobs.common.proposals import StudyProposal, around, design_bounds, proposals
from service.jobs.common.scene_parts import JointAnswer, joints
from solver.contacts.laws.contact_parts import Span
from solver.scene.bodies.paths import SPEED
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import Scene

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
        path=path, part=owner or path, name=name,
        symbol=(quantity.symbol if quantity else "") or name, unit=found.unit,
        words=(field.description if field else None) or "", value=value,
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
