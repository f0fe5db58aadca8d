"""The units of parameter paths, and their values as people read them."""

from __future__ import annotations

from solver.results.units import number


def parameter_unit(path: str) -> str:
    """The unit of the values of a parameter path; empty where there is none, or it depends on the scene."""
    # Loaded here: help and tables of results need no laws.
    from solver.contacts.laws.harmonics import higher_quantity, order_of
    from solver.contacts.laws.registry import laws
    from solver.scene.parameter_paths import AMPLITUDE, FREQUENCY, PHASE

    units = {FREQUENCY: "Hz", AMPLITUDE: "N", PHASE: "rad"}
    owner, _, key = path.rpartition(".")
    if path in units or owner == "structure":
        return units.get(path, "")
    if order_of(key) is not None:
        return higher_quantity(key).unit
    # A path does not say which law its contact has: laws that share a word must agree.
    found = {law.PARAMETERS[key].unit for law in laws().values() if key in law.PARAMETERS}
    return found.pop() if len(found) == 1 else ""


def parameter(path: str, value: float) -> str:
    """A value of a parameter path with its unit."""
    return f"{number(value, digits=6)} {parameter_unit(path)}".rstrip()
