"""Strengths of a material, and the alternating stress that its Haigh diagram allows at a mean stress.

With the fatigue strength S under alternating stress alone and the strength R under mean stress alone (the
ultimate one; of Soderberg that of yield), a mean stress m > 0 leaves S (1 − m/R) by Goodman and Soderberg
and S (1 − (m/R)²) by Gerber; pressure is not credited. Shigley, Mechanical Engineering Design, section 6-11;
Bannantine, Comer, Handrock, Fundamentals of Metal Fatigue Analysis (Prentice Hall 1990), section 2.4.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import model_validator

from solver.contacts.fields import Name, Part, Positive
from solver.errors import Issue, Place
from solver.results.units import STRESS_UNITS

LINES = ("goodman", "gerber", "soderberg")
BENT = LINES.index("gerber")
"""The number of the line that is a parabola."""
STEEP = 1e3
"""The utilisation from which a search counts on, see `solver.balance.kernels.haigh`."""
ENDLESS = 2.0 * STEEP * (1.0 - 1e-9)
"""What it counts just before the mean stress leaves nothing."""


class Material(Part):
    """Strengths of a material, for the margins of stresses."""

    name: Annotated[Name, "What `material` of a recovered quantity calls it."]
    fatigue_strength: Annotated[Positive, "Alternating stress it endures without a mean one [Pa]."]
    ultimate_strength: Annotated[Positive | None, "Tensile strength [Pa]; of goodman and gerber."] = None
    yield_strength: Annotated[Positive | None, "Yield strength [Pa]; of soderberg."] = None
    line: Annotated[
        Literal["goodman", "gerber", "soderberg"],
        "How the alternating stress allowed falls with the mean one.",
    ] = "goodman"

    @model_validator(mode="after")
    def _with_its_strength(self) -> Self:
        if self.strength is None:
            key = "yield_strength" if self.line == "soderberg" else "ultimate_strength"
            raise ValueError(f"`line` = {self.line!r} needs `{key}` [Pa]")
        return self

    @property
    def strength(self) -> float | None:
        """Mean stress at which no alternating one is allowed [Pa]."""
        return self.yield_strength if self.line == "soderberg" else self.ultimate_strength


class Haigh(NamedTuple):
    """What a recovered stress is judged by, in its unit.

    Attributes
    ----------
    line : number of the line, see `LINES`.
    fatigue : alternating stress allowed without a mean one.
    strength : mean stress at which none is allowed.
    static : mean stress that is there without the motion.
    """

    line: int
    fatigue: float
    strength: float
    static: float


def haigh_of(scene: Any, name: str) -> Haigh:
    """Return what a recovered stress with a material is judged by; KeyError without either."""
    row = {each.name: each for each in scene.recovery}[name]
    material = {each.name: each for each in scene.materials}[row.material]
    unit = STRESS_UNITS[row.unit]
    return Haigh(
        line=LINES.index(material.line), fatigue=material.fatigue_strength / unit,
        strength=material.strength / unit, static=row.static or 0.0,
    )  # fmt: skip


def utilisation_of(counted: float) -> float:
    """Return the utilisation that a search counts as so much; inf where the mean stress leaves nothing."""
    if counted >= ENDLESS:
        return math.inf
    return counted if counted <= STEEP else STEEP / (2.0 - counted / STEEP)


def counted(utilisation: float) -> float:
    """Return what a search counts a utilisation as: the inverse of `utilisation_of`."""
    return utilisation if utilisation <= STEEP else STEEP * (2.0 - STEEP / utilisation)


def strength_issue(place: Place, row: dict[str, Any], materials: dict[str, dict[str, Any]]) -> Issue | None:
    """Return what is wrong with the `material` of a recovered quantity; None if nothing is."""
    name, unit = row["material"], row.get("unit")
    if name not in materials:
        known = ", ".join(materials) or "none"
        return Issue((*place, "material"), f"= {name!r} must be one of `materials`, which are {known}")
    if unit not in STRESS_UNITS:
        return Issue(
            (*place, "unit"),
            f"= {unit!r} must be one of {', '.join(STRESS_UNITS)} where a `material` is given",
        )
    material = materials[name]
    key = "yield_strength" if material.get("line") == "soderberg" else "ultimate_strength"
    strength, static = material.get(key), row.get("static")
    if not isinstance(strength, int | float) or not isinstance(static, int | float):
        return None
    if static * STRESS_UNITS[unit] >= strength:
        return Issue(
            (*place, "static"), f"= {static!r} {unit} must be below `{key}` of {name!r}, {strength!r} Pa"
        )
    return None
