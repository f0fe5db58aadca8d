"""Scenes of the common cases, made of the few things a designer knows.

All templates share a blade with one mode, its excitation, and how a scene is put together.
"""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from solver.errors import Issue, SceneError
from solver.scene.descriptions import WORDS
from solver.scene.json_schema import plain, words_of
from solver.scene.scene import Scene
from solver.scene.scene_records import LAW_TAG
from solver.scene.toml import toml_text
from solver.scene.validation import field_issues, table_of

Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+\z", max_length=100)]
# The least is small enough for every unit, and large enough for squares and quotients to be told.
Size = Annotated[float, Field(strict=True, ge=1e-9, le=1e15, allow_inf_nan=False)]
BLADE = "blade"
"""The DOF of the mode that vibrates."""
_WIDEST = 100
_BELOW, _ABOVE = 0.8, 1.2
"""The band reaches so far beyond the frequencies of the blade with its contact loose and stuck."""


def rounded(value: float) -> float:
    """A number with the digits that a person may want to read."""
    return float(f"{value:.9g}")


class Template(BaseModel):
    """A case: its fields are the questions, `tables` is the scene."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    NAME: ClassVar[str]
    TITLE: ClassVar[str]

    name: Annotated[Word, "Name of the scene."]
    frequency_hz: Annotated[Size, "Natural frequency of the blade's mode without the contact [Hz]."] = 300.0
    modal_mass: Annotated[
        Size, "Modal mass of this mode, its shape scaled to 1 where the contact is [kg]."
    ] = 0.15
    damping_ratio: Annotated[
        float,
        Field(strict=True, ge=0.0, lt=1.0),
        "Damping ratio of this mode without the contact.",
    ] = 0.001
    force: Annotated[Size, "Amplitude of the exciting force on this mode [N]."] = 20.0
    kt: Annotated[Size, "Tangential stiffness of the contact, of a face if it has several [N/m]."] = 1.0e6
    mu: Annotated[float, Field(strict=True, gt=0.0, le=2.0), "Friction coefficient."] = 0.3

    @property
    def stiffness(self) -> float:
        """Stiffness that gives the mode its frequency: m (2 pi f)² [N/m]."""
        return self.modal_mass * (2.0 * math.pi * self.frequency_hz) ** 2

    @property
    def dashpot(self) -> float:
        """Dashpot that gives the mode its damping ratio: 2 D m 2 pi f [N s/m]."""
        return 2.0 * self.damping_ratio * self.modal_mass * 2.0 * math.pi * self.frequency_hz

    @property
    def usual_load(self) -> float:
        """A load whose friction is of the size of the force, in round numbers [N]."""
        return float(f"{self.force / self.mu:.3g}")

    @property
    @abstractmethod
    def stiffening(self) -> float:
        """What the contact adds to the stiffness of the mode while it sticks, at most [N/m]."""

    @abstractmethod
    def tables(self) -> dict[str, Any]:
        """The scene, as a file has it."""

    def blade_spring(self) -> dict[str, Any]:
        """The spring and dashpot between the blade and the ground."""
        spring = {"name": BLADE, "between": [BLADE, "ground"], "k": rounded(self.stiffness)}
        return {**spring, "c": rounded(self.dashpot)} if self.dashpot else spring

    def excited(self, **more: Any) -> dict[str, Any]:
        """The tables of the force and of what is observed: the blade, from below its mode to above it."""
        stuck = self.frequency_hz * math.sqrt(1.0 + self.stiffening / self.stiffness)
        band = [float(f"{_BELOW * self.frequency_hz:.3g}"), float(f"{_ABOVE * stuck:.3g}")]
        return {
            "excitation": {"dof": BLADE, "amplitude": self.force, **more},
            "observe": {"dof": BLADE, "band": band},
        }


class DiskTemplate(Template):
    """A case of a disk of equal blades: one sector, excited by an engine order."""

    blades: Annotated[int, Field(strict=True, ge=3, le=500), "Number of blades of the disk."] = 24
    engine_order: Annotated[
        int,
        Field(strict=True, ge=1, le=1000),
        "Engine order of the excitation: so many periods of the force around the disk.",
    ] = 4
    radius: Annotated[Size, "Distance of the contact from the axis of rotation [m]."] = 0.35
    kn: Annotated[Size, "Normal stiffness of a face [N/m]."] = 1.5e6

    @property
    def half_phase(self) -> float:
        """Half the phase between neighbouring blades [rad]."""
        return math.pi * self.engine_order / self.blades

    @property
    def half_pitch(self) -> float:
        """Half the angle between neighbouring blades [rad]."""
        return math.pi / self.blades

    def between_blades(self) -> dict[str, Any]:
        """The keys that put a damper half way from the blade to the next one, pressed outward."""
        cosine, sine = rounded(math.cos(self.half_pitch)), rounded(math.sin(self.half_pitch))
        return {
            "at": [rounded(self.radius * cosine), rounded(self.radius * sine), 0.0],
            "out": [cosine, sine, 0.0],
            "axial": [0.0, 0.0, -1.0],
        }

    def sector(self, place: str, damper: Mapping[str, Any], **held: list[dict[str, Any]]) -> dict[str, Any]:
        """One sector with a damper between the `place` of a blade and that of the next one.

        Parameters
        ----------
        held : springs and dampers of the structure beside the blade's own.
        """
        structure = {
            "kind": "cyclic", "sectors": self.blades, "axis": [0.0, 0.0, 1.0],
            "masses": {BLADE: self.modal_mass},
            "springs": [self.blade_spring(), *held.get("springs", [])],
        }  # fmt: skip
        if "dampers" in held:
            structure["dampers"] = held["dampers"]
        node = {"name": place, "at": [self.radius, 0.0, 0.0], "dofs": {"y": BLADE}}
        ends = {"between": [place, f"{place}@next"]}
        return {
            "structure": structure,
            "nodes": [node],
            "dampers": [{"name": "damper", **damper, **ends, **self.between_blades()}],
            **self.excited(engine_order=self.engine_order),
        }


class GroundDamper(Template):
    """A blade with one mode and a friction damper to the ground."""

    NAME: ClassVar[str] = "ground-damper"
    TITLE: ClassVar[str] = "Blade with a damper to the ground"

    name: Word = "my-blade"
    normal_load: Annotated[
        Size | None,
        "Mean normal load [N]. Left out: friction of the size of the force, which is near the best.",
    ] = None

    @property
    def stiffening(self) -> float:
        """The whole stiffness of the contact."""
        return self.kt

    def tables(self) -> dict[str, Any]:
        """One mass, one spring, one contact."""
        load = self.normal_load or self.usual_load
        contact = {"name": "damper", "between": [BLADE, "ground"], "kt": self.kt, "mu": self.mu, "N0": load}
        masses = {BLADE: self.modal_mass}
        return {
            "name": self.name,
            "structure": {"kind": "lumped", "masses": masses, "springs": [self.blade_spring()]},
            "contacts": [contact],
            **self.excited(),
        }


class ShroudContact(DiskTemplate):
    """Blades whose shrouds touch their neighbours', pressed together by their twist."""

    NAME: ClassVar[str] = "shroud"
    TITLE: ClassVar[str] = "Shrouds that touch"

    name: Word = "my-shroud"
    angle: Annotated[
        float,
        Field(strict=True, ge=0.0, le=1.4),
        "Angle of the normal of the faces against the direction around the disk; 0: they press and do not "
        "rub [rad].",
    ] = 1.1
    radius: Size = 0.5
    normal_load: Annotated[
        Size | None, "Normal load of a face at rest [N]. Left out: friction of the size of the force."
    ] = None

    @property
    def stiffening(self) -> float:
        """Exact: what neighbours move against each other around the disk, and outward as they are turned."""
        around = self.kn * math.cos(self.angle) ** 2 + self.kt * math.sin(self.angle) ** 2
        against = 2.0 * math.sin(self.half_phase) * math.cos(self.half_pitch)
        outward = 2.0 * math.cos(self.half_phase) * math.sin(self.half_pitch)
        return around * against**2 + self.kt * outward**2

    def tables(self) -> dict[str, Any]:
        """One sector with its shroud contact."""
        load = self.normal_load or self.usual_load
        face = {
            "shape": "shroud", "law": "coulomb-3d", "angle": self.angle, "kt": self.kt, "kn": self.kn,
            "mu": self.mu, "N0": load,
        }  # fmt: skip
        return {"name": self.name, **self.sector("shroud", face)}


_LOSS = 0.02
"""Damping ratio of the body on its stuck faces: what it loses beside friction. A round number."""
_PIN = 2e-3
"""Share of its tangential stiffness that keeps a body from creeping round the disk, and a cylinder from
rolling, while it slips on both faces: nothing else tells where it is in the mean."""
_ON_A_LINE, _ON_A_FACE = 1, 2
"""Points of a face: two hold a wedge against tilting."""


class _Body(DiskTemplate):
    """A damper with a body, in the plane of the disk."""

    damper_mass: Annotated[Size, "Mass of the damper that belongs to one blade [kg]."] = 0.004
    width: Annotated[Size, "Width of the damper around the disk; of a cylinder its diameter [m]."] = 0.012
    speed: Annotated[
        Size,
        "Speed of rotation, which presses the damper outward with its mass times radius times Ω² [1/min].",
    ] = 4000.0

    @property
    def inclination(self) -> float:
        """Of the faces [rad]."""
        return 0.0

    @property
    def stiffening(self) -> float:
        """An upper bound, after Rayleigh: the body follows the mean of both blades around the disk alone.

        What is left are the halves of the difference around the disk, a motion of each blade along its face
        turned by half the pitch, and what the blades move outward against each other.
        """
        directions = (self.inclination - self.half_pitch, self.inclination + self.half_pitch)
        around = max(self._face(direction) for direction in directions)
        outward = self._face(self.inclination + 0.5 * math.pi) * math.sin(self.half_pitch) ** 2
        phase = self.half_phase
        return 2.0 * (around * math.sin(phase) ** 2 + outward * math.cos(phase) ** 2)

    def _face(self, angle: float) -> float:
        """Stiffness of a face in a direction at an angle with it [N/m]."""
        return self.kt * math.cos(angle) ** 2 + self.kn * math.sin(angle) ** 2

    def damped(self, place: str, shape: dict[str, Any], arm: float) -> dict[str, Any]:
        """The scene with a body of a shape.

        Parameters
        ----------
        arm : distance of the faces from the centre of mass, for the damping of its rotation [m].
        """
        body = {
            "law": "elastic-normal", "kt": self.kt, "kn": self.kn, "mu": self.mu, "mass": self.damper_mass,
            "plane": "xy", "radius_of_rotation": self.radius,
        }  # fmt: skip
        loss = 2.0 * _LOSS * math.sqrt(self.damper_mass * (self.kt + self.kn))
        losses = {"x": loss, "y": loss, "rz": loss * arm**2}
        pins = {
            "x": _PIN * self.kt,
            **({"rz": _PIN * self.kt * arm**2} if shape["points"] == _ON_A_LINE else {}),
        }
        held = {
            "springs": [{"between": [f"damper.{dof}", "ground"], "k": rounded(k)} for dof, k in pins.items()],
            "dampers": [
                {"between": [f"damper.{dof}", "ground"], "c": rounded(c)} for dof, c in losses.items()
            ],
        }
        return {
            "name": self.name,
            "speed": self.speed,
            **self.sector(place, {**shape, **body}, **held),
        }


class PlatformDamper(_Body):
    """A damper between the platforms of neighbouring blades, pressed outward by rotation."""

    NAME: ClassVar[str] = "platform-damper"
    TITLE: ClassVar[str] = "Damper under the platforms"

    name: Word = "my-platform-damper"
    shape: Annotated[Literal["wedge", "cylinder"], "Shape of the damper."] = "wedge"
    angle: Annotated[
        float, Field(strict=True, ge=0.0, le=1.2), "Inclination of the faces; 0 is flat [rad]."
    ] = 0.5

    @property
    def inclination(self) -> float:
        """The angle of the faces."""
        return self.angle

    def tables(self) -> dict[str, Any]:
        """One sector with a wedge or a cylinder."""
        radius = 0.5 * self.width
        if self.shape == "cylinder":
            body = {
                "shape": "cylinder", "angle": self.angle, "radius": radius, "points": _ON_A_LINE,
                "inertia": rounded(0.5 * self.damper_mass * radius**2),
            }  # fmt: skip
            return self.damped("platform", body, radius)
        body = {
            "shape": "wedge", "angle": self.angle, "width": self.width, "length": rounded(self.width / 3.0),
            "points": _ON_A_FACE, "inertia": rounded(self.damper_mass * self.width**2 / 6.0),
        }  # fmt: skip
        return self.damped("platform", body, radius)


class RingDamper(_Body):
    """A split ring under the rim: the part of a sector, pressed on its rim and on that of the next one."""

    NAME: ClassVar[str] = "split-ring"
    TITLE: ClassVar[str] = "Split ring under the rim"

    name: Word = "my-ring"
    width: Size = 0.03

    def tables(self) -> dict[str, Any]:
        """One sector with its part of the ring."""
        inertia = rounded(self.damper_mass * self.width**2 / 12.0)
        ring = {"shape": "split-ring", "width": self.width, "points": _ON_A_FACE, "inertia": inertia}
        return self.damped("rim", ring, 0.25 * self.width)


TEMPLATES: Mapping[str, type[Template]] = {
    each.NAME: each for each in (GroundDamper, PlatformDamper, ShroudContact, RingDamper)
}


def template_schema(template: type[Template]) -> dict[str, Any]:
    """The questions of a template as a JSON Schema with the words of its docstring."""
    schema: dict[str, Any] = plain(template.model_json_schema())
    words = words_of(template)
    for key, given in schema["properties"].items():
        given["description"] = words[key]
    schema["description"] = (template.__doc__ or "").partition("\n")[0]
    return schema


def template_tables(name: str, answers: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scene made of a template.

    Raises
    ------
    SceneError
        There is no such template, or an answer is out of its range: a JSON pointer and a sentence for each.
    """
    template = TEMPLATES.get(name)
    if template is None:
        raise SceneError.of((), f"no template {name!r}: there are {', '.join(TEMPLATES)}", named=False)
    questions = ", ".join(template.model_fields)
    unknown = [
        Issue((key,), f"is no question of {name!r}: there are {questions}")
        for key in answers
        if key not in template.model_fields
    ]
    if unknown:
        raise SceneError(unknown)
    try:
        return template.model_validate(dict(answers)).tables()
    except ValidationError as error:
        raise SceneError(field_issues(error, dict(answers))) from error


def commented(template: str, tables: Mapping[str, Any]) -> str:
    """The tables of a scene made of a template as a file with comments."""
    head = f'{TEMPLATES[template].TITLE}. Numbers are in SI units, or texts with a unit: "0.2 mm", "35 deg".'
    lines, seen, words = [], Counter[str](), dict[str, str]()
    for line in toml_text(tables, (head,)).splitlines():
        if header := re.fullmatch(r"\[+(\w+)\]+", line):
            row = tables[header[1]]
            row = row[seen[header[1]]] if isinstance(row, list) else row
            seen[header[1]] += 1
            words = WORDS["*"] | words_of(table_of((header[1], *_kind(row), ""))[1])
        said = words.get(line.partition(" = ")[0], "").partition(". ")[0].removesuffix(".")
        if not said or said.startswith("As of"):
            lines.append(line)
        elif len(line) + len(said) < _WIDEST:
            lines.append(f"{line} # {said}")
        else:
            lines += [f"# {said}:", line]
    return "\n".join(lines) + "\n"


def _kind(row: Mapping[str, Any]) -> tuple[str, ...]:
    """What tells the kinds of a table apart."""
    if "law" in row and "shape" not in row:
        return (LAW_TAG + row["law"],)
    return tuple(row[key] for key in ("kind", "shape") if key in row)


def new_scene(template: str, **answers: Any) -> Scene:
    """A scene of a common case, made of the few things a designer knows.

    Parameters
    ----------
    template : ``ground-damper``, ``platform-damper``, ``shroud`` or ``split-ring``.
    answers : the fields of its class here, in SI units or with one behind ("35 deg"); the rest has defaults.

    Raises
    ------
    SceneError
        There is no such template, or an answer is out of its range.
    """
    return Scene.from_dict(template_tables(template, answers))
