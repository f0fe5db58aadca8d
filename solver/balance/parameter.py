"""Parameter paths as the compiled loops see them: what λ is, where it acts, in which unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from solver.contacts.kernels import columns
from solver.contacts.kernels import system as kernel
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.scene.bodies.paths import SPEED, is_body_path, least_value, unit_of
from solver.scene.bodies.shape_parts import contact_shares, least_shape_value, shape_of, shape_unit
from solver.scene.bodies.shapes import POINTS
from solver.scene.parameter_paths import (
    changed_quantities,
    follows_speed,
    has_parameter,
    is_gas_path,
    structure_unit,
)
from solver.scene.scene import Scene


class Kind(IntEnum):
    """What a parameter changes; the numbers are those of `solver.contacts.kernels.system`.

    CONTACTS stands for any column of the contact table, which `Parameter.column` says.
    """

    FREQUENCY = kernel.FREQUENCY
    LEVEL = kernel.LEVEL
    FORCE_PHASE = kernel.FORCE_PHASE
    STRUCTURE = kernel.STRUCTURE
    CONTACTS = columns.COLUMN_KIND


_UNITS = {"frequency": "Hz", "excitation.amplitude": "N", "excitation.phase": "rad"}


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
        Its share in the number of each contact it acts on (1.0 but for faces with several points), else 0.0.
    column : int
        Of the contact table, if it is a parameter of contacts.
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
    column: int = 0

    @property
    def code(self) -> int:
        """What λ is, as a number of the compiled loops."""
        return int(self.kind) + self.column

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
    followed = follows_speed(scene, path)
    if followed is not None:
        raise SettingError("path", path, f"cannot be continued in: {followed} follows the speed")
    if path == SPEED and (scene.speed_order is not None or scene.with_speed):
        wanted = "is swept along an engine-order line (`speed_order`) alone where loads follow it"
        raise SettingError("path", path, wanted)
    if path == "frequency":
        return _parameter(path, Kind.FREQUENCY, nobody)
    shape = shape_of(scene, path)
    if shape is not None:
        return _of_shape(scene, path, shape[1])
    if is_body_path(scene, path):
        return Parameter(
            path=path, kind=Kind.STRUCTURE, active=nobody, name=path, unit=unit_of(path),
            least=least_value(path),
        )  # fmt: skip
    if is_gas_path(scene, path):
        return Parameter(
            path=path, kind=Kind.STRUCTURE, active=nobody, name=path, unit="1", least=-math.inf
        )  # fmt: skip
    owner, _, key = path.rpartition(".")
    if owner == "excitation":
        return _parameter(path, Kind.LEVEL if key == "amplitude" else Kind.FORCE_PHASE, nobody)
    if owner == "structure":
        return Parameter(
            path=path, kind=Kind.STRUCTURE, active=nobody, name=key,
            unit=structure_unit(scene.structure, key), least=0.0,
        )  # fmt: skip
    acts = [has_parameter(contact, owner, key) for contact in scene.contacts]
    members = changed_quantities(scene, path)
    if len({member.column for member in members}) > 1:
        raise SettingError("path", path, "must be of contacts whose laws mean the same by it")
    return Parameter(
        path=path, kind=Kind.CONTACTS, active=np.array(acts, dtype=np.float64), name="", unit=members[0].unit,
        least=max(member.least for member in members), column=members[0].column,
    )  # fmt: skip


def _of_shape(scene: Scene, path: str, key: str) -> Parameter:
    """Return what a path of a damper given by its shape means: its contacts' numbers, or its structure."""
    if key == POINTS:
        raise SettingError("path", path, "must be a number that changes without steps: set it in the scene")
    shares = contact_shares(scene, path)
    if shares is None:
        nobody = np.zeros(len(scene.contacts))
        return Parameter(
            path=path, kind=Kind.STRUCTURE, active=nobody, name=path, unit=shape_unit(key),
            least=least_shape_value(key),
        )  # fmt: skip
    quantity = next(c.PARAMETERS[key] for c in scene.contacts if c.name in shares)
    return Parameter(
        path=path, kind=Kind.CONTACTS, active=np.array([shares.get(c.name, 0.0) for c in scene.contacts]),
        name="", unit=quantity.unit, least=quantity.least, column=quantity.column,
    )  # fmt: skip


def _parameter(path: str, kind: Kind, active: Real) -> Parameter:
    """A parameter of the run or the forces; an amplitude means nothing below 0."""
    least = 0.0 if kind is Kind.LEVEL else -math.inf
    return Parameter(path=path, kind=kind, active=active, name="", unit=_UNITS[path], least=least)
