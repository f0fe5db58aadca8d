"""Normal loads and forces that follow the frequency along an engine-order line, as the loops read them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.contacts.kernels.columns import N0
from solver.contacts.laws.load_harmonics import is_of_variation
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.linear.contact_table import contact_table
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.parameter_paths import AMPLITUDE, follows_speed, parameter_of
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedLine:
    """Polynomials of ω in place of numbers."""

    follows: Annotated[Integer, "(m,) contacts whose N0 follows the speed."]
    least: Annotated[Real, "(m,) their N0 at rest [N]."]
    load_rise: Annotated[Real, "(2, n_contacts) what N0 gains by ω and ω²."]
    level: Annotated[Real, "(2, 3) factors of the excitation and of constant forces by 1, ω and ω²."]


def speed_line(scene: Scene) -> SpeedLine:
    """Return what follows the frequency; nothing where the scene is on no line.

    With speed = ω / (REVOLUTIONS · order) a polynomial of the speed is one of ω; centrifugal loads, written
    at 1 rad/s, go with (ω / order)².
    """
    count = len(scene.contacts)
    level = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    rise, values = np.zeros((2, count)), dict[int, float]()
    if scene.speed_order is not None:
        powers = (1.0 / (REVOLUTIONS * scene.speed_order)) ** np.arange(3)
        for each in scene.with_speed:
            found = np.array(each.coefficients) * powers
            if each.path == AMPLITUDE:
                level[0] = found / scene.excitation[0].amplitude
                continue
            for i in parameter_of(scene, each.path).contacts:
                values[i], rise[:, i] = float(found[0]), found[1:]
        if any(body.radius_of_rotation for body in scene.bodies):
            level[1] = [0.0, 0.0, scene.speed_order**-2.0]
    return SpeedLine(
        follows=np.array(list(values), dtype=np.int64), least=np.array(list(values.values())),
        load_rise=rise, level=level,
    )  # fmt: skip


def numbers_along_line(scene: Scene, highest: int) -> Real:
    """Return the numbers of all contacts, see `contact_table`, with loads that follow the speed at rest."""
    table, line = contact_table(scene, highest), speed_line(scene)
    table[line.follows, N0] = line.least
    return table


def check_given_loads(scene: Scene, paths: Iterable[str]) -> None:
    """Raise SettingError where a path is of a load that follows the frequency with its contact's N0."""
    if scene.speed_order is None:
        return
    for path in paths:
        owner, _, key = path.rpartition(".")
        if is_of_variation(key) and follows_speed(scene, f"{owner}.N0") is not None:
            raise SettingError("paths", path, f"must not be of a load that follows the speed ({owner}.N0)")


def check_no_line(scene: Scene) -> None:
    """Raise SettingError where loads, forces or matrices follow the frequency along a line."""
    if scene.speed_order is not None:
        wanted = "must not be given: along an engine-order line responses and designs are found, no tracks"
        raise SettingError("speed_order", scene.speed_order, wanted)
