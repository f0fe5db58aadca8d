"""How a structure is driven: forces on one DOF or on many, also from a file, or a base that moves."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator

from solver.contacts.fields import Angle, DofName, Part, Signed
from solver.errors import Place, SceneError, SettingError
from solver.scene.scene_parameter import ActsOn, SceneParameter, changed

if TYPE_CHECKING:
    from solver.scene.scene import Scene

Order = Annotated[int, Field(strict=True, ge=0, le=10_000)]
HarmonicIndex = Annotated[int, Field(strict=True, ge=0, le=1_000)]
Motion = Literal["displacement", "velocity", "acceleration"]


def _rows(data: object) -> object:
    """A table of factors, or of [factor, phase], as rows of DOF, factor and phase."""
    if not isinstance(data, dict):
        return data
    return tuple(
        (dof, *given) if isinstance(given, list | tuple) else (dof, given, 0.0) for dof, given in data.items()
    )


def _table(rows: tuple[tuple[str, float, float], ...]) -> dict[str, object]:
    return {dof: [factor, phase] if phase else factor for dof, factor, phase in rows}


def _schema(value: dict[str, object]) -> WithJsonSchema:
    return WithJsonSchema({"type": "object", "minProperties": 1, "additionalProperties": value})


_PAIR = {
    "type": "array",
    "prefixItems": [{"type": "number"}, {"type": "number"}],
    "minItems": 2,
    "maxItems": 2,
}
Pattern = Annotated[
    tuple[tuple[DofName, Signed, Angle], ...],
    Field(min_length=1),
    BeforeValidator(_rows),
    PlainSerializer(_table),
    _schema({"anyOf": [{"type": "number"}, _PAIR]}),
]
Shares = Annotated[
    tuple[tuple[DofName, Signed], ...],
    Field(min_length=1),
    BeforeValidator(lambda data: tuple(data.items()) if isinstance(data, dict) else data),
    PlainSerializer(dict),
    _schema({"type": "number"}),
]


class Base(NamedTuple):
    """A prescribed motion.

    Attributes
    ----------
    ground : whether the ground moves, and `shares` is what each DOF moves along with it; else the DOFs are
        driven and it is what each moves.
    shares : DOF, its part of the motion and the phase of that [rad].
    motion : what the amplitude is of.
    """

    ground: bool
    shares: tuple[tuple[str, float, float], ...]
    motion: Motion


class Excitation(Part):
    """A force amplitude * cos(harmonic * omega t + phase), or a base that moves so; harmonic 0 is static.

    One of `dof`, `forces`, `ground` and `driven` says what it acts on.
    """

    dof: Annotated[DofName | None, "The DOF a force acts on."] = None
    forces: Annotated[
        Pattern | None,
        "Forces on many DOFs, such as a pressure: DOF to its factor of the amplitude, or to [factor, phase "
        "in rad]; in a scene file also the name of a file (CSV) with rows dof, factor and maybe phase.",
    ] = None
    ground: Annotated[
        Pattern | None,
        "The ground moves: DOF to its share of that motion when the structure moves along as a rigid body, "
        "or to [share, phase in rad]. DOFs are then counted from the moving ground, as contacts to it are.",
    ] = None
    driven: Annotated[
        Pattern | None,
        "These DOFs move as prescribed, each by its share or [share, phase in rad]; one that another "
        "excitation drives moves with both.",
    ] = None
    motion: Annotated[
        Motion | None, "What the amplitude of a base is of [m/s², m/s, m]; acceleration if left out."
    ] = None
    amplitude: Annotated[Signed, "Force [N], or amplitude of the motion of the base."]
    phase: Annotated[Angle, "Phase [rad]; 0 for a static load."] = 0.0
    harmonic: Annotated[HarmonicIndex, "Multiple of the excitation frequency."] = 1
    engine_order: Annotated[
        Order | None,
        "Cyclic structures only: sector j has harmonic * engine_order * j * 2 pi / sectors added to the "
        "phase. A wave that runs backward with the order i is the engine order sectors - i: the forces are "
        "the same.",
    ] = None
    pattern: Annotated[
        Literal["travelling", "standing"] | None,
        "Cyclic structures only: a travelling wave (also if left out), or the same angle as a factor "
        "cos(harmonic * engine_order * j * 2 pi / sectors) instead of a phase, half the sum of the two "
        "waves that run forward and backward. The loads of the contacts follow the same pattern.",
    ] = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        given = [key for key in PLACES if getattr(self, key) is not None]
        if len(given) != 1:
            got = " and ".join(f"`{key}`" for key in given) or "none"
            raise ValueError(f"an excitation needs one of {', '.join(f'`{k}`' for k in PLACES)}, got {got}")
        if self.motion is not None and self.base is None:
            raise ValueError(f"`motion` = {self.motion!r} needs `ground` or `driven`: forces have none")
        if self.harmonic == 0 and self.base is not None:
            raise ValueError("`harmonic` of a base that moves must be at least 1, got 0")
        if self.harmonic == 0 and self.phase != 0.0:
            raise ValueError(f"`phase` of a static load (harmonic = 0) must be 0, got {self.phase!r}")
        return self

    @property
    def base(self) -> Base | None:
        """The prescribed motion; None of a force."""
        shares = self.ground or self.driven
        return None if shares is None else Base(bool(self.ground), shares, self.motion or "acceleration")

    @property
    def unit(self) -> str:
        """Unit of the amplitude."""
        return "N" if self.base is None else _UNITS[self.base.motion]

    @property
    def parts(self) -> tuple[tuple[str, float, float], ...]:
        """The DOFs a force acts on, each with its factor and phase [rad]."""
        return ((self.dof, 1.0, 0.0),) if self.dof is not None else self.forces or ()

    @property
    def place(self) -> str:
        """What it acts on, in words."""
        if self.base is not None:
            return "the ground" if self.base.ground else listed(dof for dof, *_ in self.base.shares)
        return listed(dof for dof, *_ in self.parts)


AMPLITUDE = "excitation.amplitude"
PHASE = "excitation.phase"


def excitation_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what the amplitude or the phase of all forces is, if the path is one of them."""
    forces = scene.excitation
    if path == AMPLITUDE:
        return SceneParameter(
            get=lambda: scene.level, with_value=lambda new: _scaled(forces, new), unit="N",
            acts_on=ActsOn.LEVEL,
        )  # fmt: skip
    if path == PHASE:
        return SceneParameter(
            get=lambda: scene.phase, with_value=lambda new: _shifted(forces, new), unit="rad",
            least=-math.inf, acts_on=ActsOn.FORCE_PHASE,
        )  # fmt: skip
    return None


def _scaled(forces: tuple[Excitation, ...], new: float) -> dict[str, Any]:
    """Every force, scaled so that the first has the amplitude `new`."""
    first = forces[0].amplitude
    if first == 0.0 and len(forces) > 1:
        raise SettingError(AMPLITUDE, new, "scales all forces by one factor, but the first one is 0")
    scaled = [new, *(force.amplitude * (new / first) for force in forces[1:])]
    wanted = "must be a number from -1e15 to 1e15 [N]"
    pairs = zip(forces, scaled, strict=True)
    return {
        "excitation": tuple(changed(force, {"amplitude": a}, AMPLITUDE, new, wanted) for force, a in pairs)
    }


def _shifted(forces: tuple[Excitation, ...], new: float) -> dict[str, Any]:
    """Every force but static ones, shifted so that the first has the phase `new`."""
    moving = [force for force in forces if force.harmonic]
    if not moving:
        raise SettingError(PHASE, new, "has no meaning: every force of this scene is static")
    shift, wanted = new - moving[0].phase, "must be a number from -1e4 to 1e4 [rad]"
    phases = {id(force): force.phase + shift for force in moving} | {id(moving[0]): new}
    shifted = (
        changed(force, {"phase": phases[id(force)]}, PHASE, new, wanted) if force.harmonic else force
        for force in forces
    )
    return {"excitation": tuple(shifted)}


_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²"}
PLACES = ("dof", "forces", "ground", "driven")
_FEW = 3


def listed(names: object) -> str:
    """A few names, or how many there are."""
    known = list(names)  # type: ignore[call-overload]
    return ", ".join(known) if len(known) <= _FEW else f"{len(known)} DOFs"


def with_factor_files(raw: Mapping[str, object], folder: Path) -> dict[str, object]:
    """Return the tables of a scene with the files of its forces and of what is recovered read.

    Raises
    ------
    SceneError
        A file that cannot be read, or a row that is no DOF with one number, or two of a force.
    """
    found = dict(raw)
    for table, key, most in (("excitation", "forces", 2), ("recovery", "terms", 1)):
        given = raw.get(table)
        rows = given if isinstance(given, list) else [given]
        if not any(isinstance(row, dict) and isinstance(row.get(key), str) for row in rows):
            continue
        read = [
            {**row, key: _read(folder / row[key], (table, *([i] if rows is given else []), key), most)}
            if isinstance(row, dict) and isinstance(row.get(key), str)
            else row
            for i, row in enumerate(rows)
        ]
        found[table] = read if rows is given else read[0]
    return found


def _read(path: Path, place: Place, most: int) -> dict[str, list[float]] | dict[str, float]:
    """Return DOF to its numbers, up to `most` of them, of a CSV file."""

    def refused(why: str) -> SceneError:
        return SceneError.of(place, f"`{place[-1]}`: {str(path)!r} {why}", named=False)

    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise refused(f"cannot be read: {error}") from error
    table: dict[str, list[float]] = {}
    for line, row in enumerate(csv.reader(text.splitlines()), start=1):
        cells = [cell.strip() for cell in row]
        if not any(cells) or cells[0].startswith("#") or (line == 1 and cells[0].lower() == "dof"):
            continue
        try:
            numbers = [float(cell) for cell in cells[1:]]
        except ValueError:
            numbers = []
        if not 1 <= len(numbers) <= most or cells[0] in table:
            phase = " and maybe a phase" if most > 1 else ""
            raise refused(f"line {line} must be a DOF, its factor{phase}, none twice, got {row!r}")
        table[cells[0]] = [*numbers, 0.0][:most]
    if not table:
        raise refused("names no DOF")
    return table if most > 1 else {dof: numbers[0] for dof, numbers in table.items()}
