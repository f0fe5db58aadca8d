"""Headings of rigs' exports: what a column is said to be, what it is likely to be, and what it cannot be."""

from __future__ import annotations

import re
from dataclasses import dataclass

from optim.identification.data.measured import known_columns
from optim.identification.data.measured_units import Dimension, Scaling, known_units, no_motion, unit_of
from optim.identification.readers.number_texts import is_number
from optim.identification.readers.text_layout import Layout, heading_unit
from optim.problem.checks import DataError

LEFT_OUT = ""
FORCE = "excitation.amplitude"
# What a heading says of itself, in the languages rigs are set to, the most telling first.
_WORDS: tuple[tuple[str, str], ...] = (
    (r"half.*peak|halbe.*spitze", "half_peak_to_peak"),
    (r"phas", "phase"),
    (r"freq|fréq", "frequency"),
    (r"spitze|peak|max|scheitel", "max_abs"),
    (r"real", "real"),
    (r"imag", "imag"),
    (r"ampl|weg|auslenk|displ|déplac|depl|beschl|accel|accél|geschw|veloc|vitesse|schwing", "amplitude"),
    (r"kraft|force|erreg", FORCE),
)
_PEAK_TO_PEAK = r"(?:pe?a?k|spitze|crête|p)[\s-]?(?:to|zu|à|2)?[\s-]?(?:pe?a?k|spitze|crête|p)\b"
_SCALINGS = (
    (Scaling.RMS, re.compile(r"\brms|\beff(?:ekti[vf]\w*|icace)?\b|\bRMS", re.IGNORECASE)),
    (Scaling.PEAK_TO_PEAK, re.compile(rf"(?<!half )(?<!halbe )(?<!half_)\b{_PEAK_TO_PEAK}", re.IGNORECASE)),
)
# What is no response at a DOF, whatever its unit.
_NO_RESPONSE = (
    ("a coherence", r"coher|kohär|cohér"),
    (
        "a spectral density",
        r"\bpsd\b|\basd\b|\besd\b|spectral.density|leistungsdichte|spektraldichte|densité",
    ),
    ("an auto spectrum, of squares", r"auto.?(?:spec|spek|pow)|power.spec|leistungsspek|interspec|\bgxx\b"),
    ("a cross spectrum, of products", r"cross.?(?:spec|pow)|kreuz.?(?:spek|leis)|\bgxy\b"),
    ("a transmissibility, a motion over a motion", r"transmiss|übertragungsfaktor"),
    ("in decibels", r"\bdB\b"),
)
_BY_FORCE = re.compile(
    r"\bfrf\b|frequency.response|frequenzgang|recept|complian|nachgieb|mobili|accelerance|inertance",
    re.IGNORECASE,
)
_ORDERS = ((2, r"accel|accél|beschl"), (1, r"veloc|vitesse|geschw"), (0, r"displ|déplac|auslenk|\bweg\b"))
_NOT_OVER = re.compile(r"\btime\b|\bzeit\b|\btemps\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Choice:
    """What a column is: a name of `known_columns`, a parameter path, or nothing; its unit, None for SI."""

    quantity: str
    unit: str | None = None

    @classmethod
    def told(cls, text: str) -> tuple[str, Choice]:
        """Return heading and choice of ``HEADING=QUANTITY[:UNIT]``.

        Raises
        ------
        DataError
            It has another form.
        """
        heading, sign, rest = text.rpartition("=")
        if not sign or not heading.strip():
            raise DataError("column", text, "must be HEADING=QUANTITY:UNIT, such as Weg=amplitude:mm")
        quantity, _, unit = rest.partition(":")
        return heading.strip(), cls(quantity.strip(), unit.strip() or None)


def guesses(layout: Layout, paths: frozenset[str]) -> tuple[Choice, ...]:
    """Return what the columns are likely to be, each once; those that say nothing are left out."""
    known, taken, found = known_columns(), set[str](), []
    for index, heading in enumerate(layout.heads):
        name, unit = heading_unit(heading)
        numeric = any(map(is_number, layout.column(index)))
        quantity = name if name in known or name in paths else _guess(name, unit, paths)
        scaling = _scaling(name)
        if quantity in ("amplitude", "max_abs") and scaling and unit and unit_of(Dimension.MOTION, unit):
            quantity = "amplitude" if scaling is Scaling.RMS else "half_peak_to_peak"
            unit = f"{unit} {scaling.value}"
        if (
            quantity in taken
            or not numeric
            or not _fits(quantity, unit, paths)
            or contradiction(heading, quantity, unit)
        ):
            quantity = LEFT_OUT
        taken.add(quantity)
        found.append(Choice(quantity, unit if quantity else None))
    return tuple(found)


def _guess(name: str, unit: str | None, paths: frozenset[str]) -> str:
    for pattern, quantity in _WORDS:
        if re.search(pattern, name, re.IGNORECASE) and _fits(quantity, unit, paths):
            return quantity
    by_unit = (
        (Dimension.FREQUENCY, "frequency"),
        (Dimension.ANGLE, "phase"),
        (Dimension.LENGTH, "amplitude"),
    )
    return next((quantity for dimension, quantity in by_unit if unit and unit_of(dimension, unit)), LEFT_OUT)


def _fits(quantity: str, unit: str | None, paths: frozenset[str]) -> bool:
    """Whether a quantity is known here and may have the unit."""
    if quantity in paths:
        return quantity != FORCE or unit_of(Dimension.FORCE, unit) is not None
    known = known_columns()
    return quantity in known and unit_of(known[quantity].dimension, unit) is not None


def _scaling(name: str) -> Scaling | None:
    return next((each for each, pattern in _SCALINGS if pattern.search(name)), None)


def contradiction(heading: str, quantity: str, unit: str | None) -> str:
    """Return what is wrong with taking a column for a quantity, as far as its heading says; empty if nothing.

    Parameters
    ----------
    heading : as it stands there.
    quantity : that it is to be, in a unit.
    """
    known = known_columns()
    name = heading_unit(heading)[0]
    if quantity in ("frequency", "resonance_frequency") and _NOT_OVER.search(name):
        return "is a time by its heading: a response is over the frequency"
    if name == quantity or quantity not in known or known[quantity].dimension is not Dimension.MOTION:
        return ""
    motion = unit_of(Dimension.MOTION, unit)
    for what, pattern in _NO_RESPONSE:
        if re.search(pattern, name, re.IGNORECASE):
            return f"is {what} by its heading, not a motion at a DOF: leave it out"
    if motion is None or no_motion(unit or ""):
        return ""  # the unit itself is refused
    scaling = _scaling(name)
    if scaling is not None and motion.scaling is None:
        there = unit or "m"
        return (
            f"is {scaling.value} by its heading: say so by the unit, `{there} {scaling.value}`, which is "
            f"{'√2 times' if scaling is Scaling.RMS else 'halved to'} the amplitude, or `{there} pk`"
        )
    if _BY_FORCE.search(name) and not motion.per_force:
        return "is a motion by a force by its heading: give its unit, such as mm/N or m/s2/N"
    said = [order for order, pattern in _ORDERS if re.search(pattern, name, re.IGNORECASE)]
    if said and motion.order not in said:
        what = ("a displacement", "a velocity", "an acceleration")[said[0]]
        return f"is {what} by its heading: give its unit, such as {('mm', 'mm/s', 'm/s2')[said[0]]}"
    if unit is None and re.search(r"phas|kraft|force", name, re.IGNORECASE):
        return "is no motion by its heading: give its unit"
    return ""


def units_for(quantity: str, paths: frozenset[str]) -> tuple[str, ...]:
    """Return the units a column of a quantity may be in; none of a parameter but a force, which is in SI."""
    if quantity in paths:
        return known_units(Dimension.FORCE) if quantity == FORCE else ()
    known = known_columns()
    return known_units(known[quantity].dimension) if quantity in known else ()
