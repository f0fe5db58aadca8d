"""Parameter paths as the compiled loops see them: what λ is, where it acts, in which unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from solver.errors import SettingError
from solver.fourier import Real
from solver.kernels import system as kernel
from solver.scene import Scene


class Kind(IntEnum):
    """What a parameter changes; the numbers are those of `solver.kernels.system`."""

    FREQUENCY = kernel.FREQUENCY
    LEVEL = kernel.LEVEL
    FORCE_PHASE = kernel.FORCE_PHASE
    STRUCTURE = kernel.STRUCTURE
    NORMAL_LOAD = kernel.NORMAL_LOAD
    LOAD_AMPLITUDE = kernel.LOAD_AMPLITUDE
    LOAD_RATIO = kernel.LOAD_RATIO
    LOAD_PHASE = kernel.LOAD_PHASE
    STIFFNESS = kernel.STIFFNESS
    FRICTION = kernel.FRICTION


_CONTACT_KINDS = {
    "N0": Kind.NORMAL_LOAD,
    "N1": Kind.LOAD_AMPLITUDE,
    "N1_ratio": Kind.LOAD_RATIO,
    "N1_phase": Kind.LOAD_PHASE,
    "kt": Kind.STIFFNESS,
    "mu": Kind.FRICTION,
}
_UNITS = {
    Kind.FREQUENCY: "Hz", Kind.LEVEL: "N", Kind.FORCE_PHASE: "rad", Kind.NORMAL_LOAD: "N",
    Kind.LOAD_AMPLITUDE: "N", Kind.LOAD_RATIO: "", Kind.LOAD_PHASE: "rad", Kind.STIFFNESS: "N/m",
    Kind.FRICTION: "", Kind.STRUCTURE: "SI",
}  # fmt: skip
# Smallest value that means something; a load amplitude may be negative (it is then in antiphase).
_LEAST = {
    Kind.NORMAL_LOAD: 0.0,
    Kind.STIFFNESS: 0.0,
    Kind.FRICTION: 0.0,
    Kind.STRUCTURE: 0.0,
    Kind.LEVEL: 0.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter path resolved against a scene.

    Attributes
    ----------
    path : str
        As the user wrote it, for example ``shroud.N0``.
    kind : Kind
        What it changes.
    active : (n_contacts,) array
        1.0 for the contacts it acts on, else 0.0.
    name : str
        Name of the structural parameter, else empty.
    unit : str
        Unit of the values at the user boundary.
    """

    path: str
    kind: Kind
    active: Real
    name: str
    unit: str

    def inside(self, value: float) -> float:
        """Convert a user value to the one inside (Hz to rad/s)."""
        return 2.0 * math.pi * value if self.kind is Kind.FREQUENCY else value

    def outside(self, value: float) -> float:
        """Convert an inside value to the user's (rad/s to Hz)."""
        return value / (2.0 * math.pi) if self.kind is Kind.FREQUENCY else value

    def all_outside(self, values: Real) -> Real:
        """Convert an array of inside values to the user's."""
        return values / (2.0 * math.pi) if self.kind is Kind.FREQUENCY else values

    def check(self, name: str, value: float) -> float:
        """Return `value` as a float if the parameter may have it.

        Raises
        ------
        SettingError
            Not a finite number, or out of the parameter's range; the message names `name`.
        """
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float, np.number))
            or not np.isfinite(value)
        ):
            raise SettingError(name, value, f"must be a finite number ({self.path})")
        if self.kind is Kind.FREQUENCY and value <= 0.0:
            raise SettingError(name, value, "must be a frequency > 0 Hz")
        if value < _LEAST.get(self.kind, -math.inf):
            raise SettingError(name, value, f"must be >= 0, a value of `{self.path}`")
        return float(value)


def resolve(scene: Scene, path: str) -> Parameter:
    """Return what `path` means in `scene`.

    Raises
    ------
    SettingError
        The scene has no such parameter; the message lists those it has.
    """
    scene.check_path(path)
    nobody = np.zeros(len(scene.contacts))
    if path == "frequency":
        return _parameter(path, Kind.FREQUENCY, nobody)
    owner, _, key = path.rpartition(".")
    if owner == "excitation":
        return _parameter(path, Kind.LEVEL if key == "amplitude" else Kind.FORCE_PHASE, nobody)
    if owner == "structure":
        return _parameter(path, Kind.STRUCTURE, nobody, key)
    active = np.array([1.0 if owner in (contact.name, contact.group) else 0.0 for contact in scene.contacts])
    return _parameter(path, _CONTACT_KINDS[key], active)


def _parameter(path: str, kind: Kind, active: Real, name: str = "") -> Parameter:
    return Parameter(path=path, kind=kind, active=active, name=name, unit=_UNITS[kind])
