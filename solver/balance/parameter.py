"""Parameter paths as the compiled loops see them: what λ is, where it acts, in which unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

import numpy as np

from solver.contacts.fields import LARGEST
from solver.contacts.kernels import columns
from solver.contacts.kernels import system as kernel
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.scene.bodies.shape_parts import SPEED
from solver.scene.parameter_paths import FREQUENCY, check_frequency, follows_speed, parameter_of
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter path resolved against a scene."""

    path: Annotated[str, "As the user wrote it, for example ``shroud.N0``."]
    kind: Annotated[Kind, "What it changes."]
    active: Annotated[
        Real,
        "Its share in the number of each contact it acts on (1.0 but for faces with several points), else "
        "0.0, (n_contacts,).",
    ]
    unit: Annotated[str, "Unit of the values at the user boundary."]
    least: Annotated[float, "Smallest value that means something."]
    column: Annotated[int, "Of the contact table, if it is a parameter of contacts."] = 0

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
        """Return a value that the parameter may have as a float; SettingError, which names `name`, else."""
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float, np.number))
            or not np.isfinite(value)
        ):
            raise SettingError(name, value, f"must be a finite number ({self.path})")
        if self.kind is Kind.FREQUENCY:
            return check_frequency(name, value)
        if value < self.least:
            raise SettingError(name, value, f"must be >= 0, a value of `{self.path}`")
        if abs(value) > LARGEST:
            raise SettingError(name, value, f"must be at most {LARGEST:g}, a value of `{self.path}`")
        return float(value)


def resolve(scene: Scene, path: str) -> Parameter:
    """Return what `path` means in `scene`; SettingError with those that it has if it is none of them."""
    active = np.zeros(len(scene.contacts))
    if path == FREQUENCY:
        return Parameter(path=path, kind=Kind.FREQUENCY, active=active, unit="Hz", least=-math.inf)
    scene.check_path(path)
    followed = follows_speed(scene, path)
    if followed is not None:
        raise SettingError("path", path, f"cannot be continued in: {followed} follows the speed")
    if path == SPEED and (scene.speed_order is not None or scene.with_speed):
        wanted = "is swept along an engine-order line (`speed_order`) alone where loads follow it"
        raise SettingError("path", path, wanted)
    found = parameter_of(scene, path)
    if found.in_steps:
        raise SettingError("path", path, "must be a number that changes without steps: set it in the scene")
    columns_set = {quantity.column for quantity in found.quantities} or {0}
    if len(columns_set) > 1:
        raise SettingError("path", path, "must be of contacts whose laws mean the same by it")
    active[list(found.contacts)] = list(found.contacts.values())
    return Parameter(
        path=path, kind=Kind[found.acts_on.name], active=active, unit=found.unit, least=found.least,
        column=columns_set.pop(),
    )  # fmt: skip


def check_fixed(path: str, frequency_hz: float | None) -> float:
    """Return the frequency [Hz] at which another parameter is followed; SettingError without a good one."""
    if frequency_hz is None:
        raise SettingError("frequency_hz", None, f"is needed when the parameter is `{path}`")
    return check_frequency("frequency_hz", frequency_hz)
