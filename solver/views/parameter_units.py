"""The units of parameter paths, and their values as people read them."""

from __future__ import annotations

from solver.contacts.laws.registry import laws
from solver.results.units import number
from solver.scene.parameter_paths import AMPLITUDE, FREQUENCY, PHASE

_UNITS = {FREQUENCY: "Hz", AMPLITUDE: "N", PHASE: "rad"}


def parameter_unit(path: str) -> str:
    """The unit of the values of a parameter path; empty where there is none, or it depends on the scene."""
    owner, _, key = path.rpartition(".")
    if path in _UNITS or owner == "structure":
        return _UNITS.get(path, "")
    # A path does not say which law its contact has: laws that share a word must agree.
    found = {law.PARAMETERS[key].unit for law in laws().values() if key in law.PARAMETERS}
    return found.pop() if len(found) == 1 else ""


def parameter(path: str, value: float) -> str:
    """A value of a parameter path with its unit."""
    return f"{number(value, digits=6)} {parameter_unit(path)}".rstrip()
