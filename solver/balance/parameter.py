"""Parameter paths as the compiled loops see them: what λ is, where it acts, in which unit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from solver.contacts.kernels import columns
from solver.contacts.kernels import system as kernel
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.scene.parameter_paths import has_parameter
from solver.scene.scene import ElasticNormalContact, Scene


class Kind(IntEnum):
    """What a parameter changes; the numbers are those of `solver.contacts.kernels.system` and `laws_columns`.

    OWN_1 … OWN_9 are the columns of the contact table that each law uses as it likes.
    """

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
    OWN_1 = columns.OWN_KIND
    OWN_2 = columns.OWN_KIND + 1
    OWN_3 = columns.OWN_KIND + 2
    OWN_4 = columns.OWN_KIND + 3
    OWN_5 = columns.OWN_KIND + 4
    OWN_6 = columns.OWN_KIND + 5
    OWN_7 = columns.OWN_KIND + 6
    OWN_8 = columns.OWN_KIND + 7
    OWN_9 = columns.OWN_KIND + 8


_CONTACT_KINDS = {
    "N0": Kind.NORMAL_LOAD,
    "N1": Kind.LOAD_AMPLITUDE,
    "N1_ratio": Kind.LOAD_RATIO,
    "N1_phase": Kind.LOAD_PHASE,
    "kt": Kind.STIFFNESS,
    "mu": Kind.FRICTION,
    "kn": Kind(columns.OWN_KIND + columns.KN - columns.OWN),
    "k": Kind(columns.OWN_KIND + columns.K_GAP - columns.OWN),
    "gap": Kind(columns.OWN_KIND + columns.GAP - columns.OWN),
    **{
        f"a{j + 1}": Kind(columns.OWN_KIND + columns.A_1 + j - columns.OWN)
        for j in range(columns.MOST_DEGREE)
    },
}
_UNITS = {
    "frequency": "Hz", "excitation.amplitude": "N", "excitation.phase": "rad", "N0": "N", "N1": "N",
    "N1_ratio": "", "N1_phase": "rad", "kt": "N/m", "mu": "", "kn": "N/m", "k": "N/m", "gap": "m",
    "a1": "N/m", **{f"a{j}": f"N/m^{j}" for j in range(2, columns.MOST_DEGREE + 1)},
}  # fmt: skip
# What means nothing below 0; a load amplitude may be negative (it is then in antiphase).
_NOT_NEGATIVE = ("excitation.amplitude", "N0", "kt", "mu", "kn", "k")


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
    least : float
        Smallest value that means something.
    """

    path: str
    kind: Kind
    active: Real
    name: str
    unit: str
    least: float

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
        if value < self.least:
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
        return _parameter(path, Kind.FREQUENCY, nobody, path)
    owner, _, key = path.rpartition(".")
    if owner == "excitation":
        return _parameter(path, Kind.LEVEL if key == "amplitude" else Kind.FORCE_PHASE, nobody, path)
    if owner == "structure":
        return _parameter(path, Kind.STRUCTURE, nobody, key, structural=True)
    members = [contact for contact in scene.contacts if has_parameter(contact, owner, key)]
    active = np.array([float(has_parameter(contact, owner, key)) for contact in scene.contacts])
    # A rubbing contact may stand apart at rest.
    apart = key == "N0" and all(isinstance(contact, ElasticNormalContact) for contact in members)
    parameter = _parameter(path, _CONTACT_KINDS[key], active, key)
    return replace(parameter, least=-math.inf) if apart else parameter


def _parameter(path: str, kind: Kind, active: Real, key: str, *, structural: bool = False) -> Parameter:
    return Parameter(
        path=path,
        kind=kind,
        active=active,
        name=key if structural else "",
        unit="SI" if structural else _UNITS[key],
        least=0.0 if structural or key in _NOT_NEGATIVE else -math.inf,
    )
