"""What the service says of a scene beside its tables: parameters, joints, what studies begin with."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from optim.problem.problem_keys import ABOVE, BELOW, default_variable
from solver.contacts.laws.contact_parts import Span
from solver.errors import SettingError
from solver.scene.bodies.shape_parts import SPEED
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import AnyContact, Scene

_DIGITS = 3
_AROUND = 3.0  # of a value, the bounds between which it is identified
_ORDERS = 3
_MODAL = (1e-7, 0.1)  # √kg m, where nothing says at which motion contacts begin to slip
_AROUND_SLIP = (0.05, 300.0)
_ABOVE_BAND = 2.0
_EXACT_PEAKS = 8

Proposed = Mapping[str, Any] | str
"""Keys of the body, or why the scene has no such study."""


class StudyProposal(BaseModel):
    """A study of a scene as it would be asked."""

    model_config = ConfigDict(frozen=True)

    kind: str
    body: dict[str, Any] = Field(description="Keys beside the scene that the scene itself suggests.")
    points: int | None = Field(
        description="Points of a response, as the plan prices one, that cost as much, about; null: not known."
    )
    refused: str | None = Field(description="Why the scene has no such study; null: it has.")


def proposals(scene: Scene) -> list[StudyProposal]:
    """Return what a scene suggests for the studies that it can suggest anything for."""
    found = []
    for kind in dict.fromkeys((*_PROPOSED, *_POINTS)):
        keys = _PROPOSED[kind](scene) if kind in _PROPOSED else {}
        refused = keys if isinstance(keys, str) else None
        body = {} if isinstance(keys, str) else dict(keys)
        points = _POINTS.get(kind)
        if points is not None and "orders" in body:
            points *= len(body["orders"])
        found.append(StudyProposal(kind=kind, body=body, points=points, refused=refused))
    return found


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
        return [_rounded(low), _rounded(high)]
    return [_rounded(value / BELOW), _rounded(value * ABOVE if logarithmic else min(value * ABOVE, high))]


def around(value: float) -> list[float]:
    """Return bounds to identify a parameter between."""
    return sorted((_rounded(value / _AROUND), _rounded(value * _AROUND)))


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")


def _band(scene: Scene) -> tuple[float, float]:
    low, high = scene.observe.band
    return float(low), float(high)


def _middle(scene: Scene) -> float:
    low, high = _band(scene)
    return math.sqrt(low * high) if low > 0.0 else high / 2.0


def _sectors(scene: Scene) -> int | None:
    structure = scene.structure
    return structure.sector_count if structure.has_sectors else None


def _first_order(scene: Scene) -> int:
    orders = [force.engine_order for force in scene.excitation if force.engine_order is not None]
    return max(orders[0], 1) if orders else 1


def _map(scene: Scene) -> Proposed:
    """Ridges are tracked where the law of every contact lets them be."""
    from solver.studies.peaks.tracker import check_laws

    try:
        check_laws(scene)
    except SettingError:
        return {"ridge": False}
    return {"ridge": True}


def _campbell(scene: Scene) -> Proposed:
    """The running speeds that bring the engine orders into the band."""
    first, (low, high) = _first_order(scene), _band(scene)
    sectors = _sectors(scene)
    most = max(sectors // 2, first) if sectors else _ORDERS
    orders = [first + more for more in range(_ORDERS) if first + more <= max(most, first)]
    speeds = [_rounded(60.0 * low / orders[-1], 4), _rounded(60.0 * high / first, 4)]
    return {"speeds_rpm": [speeds], "orders": orders, "band_hz": [low, high]}


def _interference(scene: Scene) -> Proposed:
    """The speed that brings the order of the scene into the middle of its band."""
    if not _sectors(scene):
        return "The scene has no sectors."
    orders = [force.engine_order for force in scene.excitation if force.engine_order is not None]
    speed = scene.speed or _rounded(60.0 * _middle(scene) / max(orders[0] if orders else 0, 1))
    return {"speed_rpm": speed, "up_to_hz": _ABOVE_BAND * _band(scene)[1]}


def _slip(contact: AnyContact) -> float:
    """Return the motion at which a contact begins to slip [m]; 0 if its law does not say it."""
    friction, stiffness = (getattr(contact, key, 0.0) for key in ("mu", "kt"))
    if contact.load is None or not stiffness:
        return 0.0
    return float(friction * contact.load.mean / stiffness)


def _modes(scene: Scene) -> Proposed:
    """Amplitudes around the one at which the contacts begin to slip, as far as the scene says it."""
    slips = [_slip(contact) for contact in scene.contacts]
    slips = [slip for slip in slips if slip > 0.0]
    masses = [float(mass.m) for mass in getattr(scene.structure, "masses", ())]
    ends = _MODAL
    if slips and masses:
        root = math.sqrt(sum(masses))
        ends = (_AROUND_SLIP[0] * min(slips) * root, _AROUND_SLIP[1] * max(slips) * root)
    low, high = (_rounded(end, 2) for end in ends)
    return {"from": low, "to": high, "performance": True, "motions": True, "exact_peaks": _EXACT_PEAKS}


def _identify(scene: Scene) -> Proposed:
    """Friction and stiffness of the first part that has them."""
    paths = [path for path in scene.parameter_paths() if path.rpartition(".")[2] in ("kt", "mu")]
    first = paths[0].rpartition(".")[0] if paths else ""
    own = [path for path in paths if path.rpartition(".")[0] == first and scene.value(path) > 0.0]
    return {"unknowns": {path: around(scene.value(path)) for path in own}} if own else {}


def _mistuning(scene: Scene) -> Proposed:
    return {} if _sectors(scene) else "The scene has no sectors."


def _at_one_frequency(scene: Scene) -> Proposed:
    return {"frequency_hz": _rounded(_middle(scene), 4)}


# What a study takes in all, in points of a response as the plan prices them: measured in processor time on
# the shipped scenes, as they are asked by default. A response has its peaks polished and its errors
# estimated, a front is a search for each of its points.
_SWEEP = 350
_POINTS: Mapping[str, int] = {
    "sweep": _SWEEP, "campbell": _SWEEP, "map": 41_000, "design": 2_500, "pareto": 110_000, "modes": 4_000,
    "accuracy": 40_000, "interference": 300,
}  # fmt: skip
_PROPOSED: Mapping[str, Callable[[Scene], Proposed]] = {
    "map": _map, "campbell": _campbell, "interference": _interference, "modes": _modes,
    "identify": _identify,
    "mistuning": _mistuning, "solve": _at_one_frequency, "march": _at_one_frequency,
}  # fmt: skip


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
