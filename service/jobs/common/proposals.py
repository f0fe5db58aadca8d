"""What a study is asked with before anybody changes anything: the keys that a scene itself suggests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from optim.problem.problem_keys import ABOVE, BELOW
from solver.errors import SettingError
from solver.scene.scene import AnyContact, Scene

_DIGITS = 3
_AROUND = 3.0  # of a value, the bounds between which it is identified
_ORDERS = 3
_MODAL = (1e-7, 0.1)  # √kg m, where nothing says at which motion contacts begin to slip
_AROUND_SLIP = (0.05, 300.0)
_ABOVE_BAND = 2.0
_EXACT_PEAKS = 8

Proposed = Mapping[str, Any] | str
"""Keys of the body, or why the scene has no such study."""


class StudyProposal(BaseModel):
    """A study of a scene as it would be asked."""

    model_config = ConfigDict(frozen=True)

    kind: str
    body: dict[str, Any] = Field(description="Keys beside the scene that the scene itself suggests.")
    points: int | None = Field(
        description="Points of a response, as the plan prices one, that cost as much, about; null: not known."
    )
    refused: str | None = Field(description="Why the scene has no such study; null: it has.")


def proposals(scene: Scene) -> list[StudyProposal]:
    """Return what a scene suggests for the studies that it can suggest anything for."""
    found = []
    for kind in dict.fromkeys((*_PROPOSED, *_POINTS)):
        keys = _PROPOSED[kind](scene) if kind in _PROPOSED else {}
        refused = keys if isinstance(keys, str) else None
        body = {} if isinstance(keys, str) else dict(keys)
        points = _POINTS.get(kind)
        if points is not None and "orders" in body:
            points *= len(body["orders"])
        found.append(StudyProposal(kind=kind, body=body, points=points, refused=refused))
    return found


def design_bounds(value: float, low: float, high: float, *, logarithmic: bool) -> list[float] | None:
    """Return bounds to design a parameter between, around its value and within what a slider covers.

    Parameters
    ----------
    value : of the parameter; below 0 nothing is proposed.
    low, high, logarithmic : of its slider.
    """
    if value < 0.0 or (value == 0.0 and not logarithmic):
        return None
    if value == 0.0:
        return [_rounded(low), _rounded(high)]
    return [_rounded(value / BELOW), _rounded(value * ABOVE if logarithmic else min(value * ABOVE, high))]


def around(value: float) -> list[float]:
    """Return bounds to identify a parameter between."""
    return sorted((_rounded(value / _AROUND), _rounded(value * _AROUND)))


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")


def _band(scene: Scene) -> tuple[float, float]:
    low, high = scene.observe.band
    return float(low), float(high)


def _middle(scene: Scene) -> float:
    low, high = _band(scene)
    return math.sqrt(low * high) if low > 0.0 else high / 2.0


def _sectors(scene: Scene) -> int | None:
    structure = scene.structure
    return structure.sector_count if structure.has_sectors else None


def _first_order(scene: Scene) -> int:
    orders = [force.engine_order for force in scene.excitation if force.engine_order is not None]
    return max(orders[0], 1) if orders else 1


def _map(scene: Scene) -> Proposed:
    """Ridges are tracked where the law of every contact lets them be."""
    from solver.studies.peaks.tracker import check_laws

    try:
        check_laws(scene)
    except SettingError:
        return {"ridge": False}
    return {"ridge": True}


def _campbell(scene: Scene) -> Proposed:
    """The running speeds that bring the engine orders into the band."""
    first, (low, high) = _first_order(scene), _band(scene)
    sectors = _sectors(scene)
    most = max(sectors // 2, first) if sectors else _ORDERS
    orders = [first + more for more in range(_ORDERS) if first + more <= max(most, first)]
    speeds = [_rounded(60.0 * low / orders[-1], 4), _rounded(60.0 * high / first, 4)]
    return {"speeds_rpm": [speeds], "orders": orders, "band_hz": [low, high]}


def _interference(scene: Scene) -> Proposed:
    """The speed that brings the order of the scene into the middle of its band."""
    if not _sectors(scene):
        return "The scene has no sectors."
    orders = [force.engine_order for force in scene.excitation if force.engine_order is not None]
    speed = scene.speed or _rounded(60.0 * _middle(scene) / max(orders[0] if orders else 0, 1))
    return {"speed_rpm": speed, "up_to_hz": _ABOVE_BAND * _band(scene)[1]}


def _slip(contact: AnyContact) -> float:
    """Return the motion at which a contact begins to slip [m]; 0 if its law does not say it."""
    friction, stiffness = (getattr(contact, key, 0.0) for key in ("mu", "kt"))
    if contact.load is None or not stiffness:
        return 0.0
    return float(friction * contact.load.mean / stiffness)


def _modes(scene: Scene) -> Proposed:
    """Amplitudes around the one at which the contacts begin to slip, as far as the scene says it."""
    slips = [_slip(contact) for contact in scene.contacts]
    slips = [slip for slip in slips if slip > 0.0]
    masses = [float(mass.m) for mass in getattr(scene.structure, "masses", ())]
    ends = _MODAL
    if slips and masses:
        root = math.sqrt(sum(masses))
        ends = (_AROUND_SLIP[0] * min(slips) * root, _AROUND_SLIP[1] * max(slips) * root)
    low, high = (_rounded(end, 2) for end in ends)
    return {"from": low, "to": high, "performance": True, "motions": True, "exact_peaks": _EXACT_PEAKS}


def _identify(scene: Scene) -> Proposed:
    """Friction and stiffness of the first part that has them."""
    paths = [path for path in scene.parameter_paths() if path.rpartition(".")[2] in ("kt", "mu")]
    first = paths[0].rpartition(".")[0] if paths else ""
    own = [path for path in paths if path.rpartition(".")[0] == first and scene.value(path) > 0.0]
    return {"unknowns": {path: around(scene.value(path)) for path in own}} if own else {}


def _mistuning(scene: Scene) -> Proposed:
    return {} if _sectors(scene) else "The scene has no sectors."


def _at_one_frequency(scene: Scene) -> Proposed:
    return {"frequency_hz": _rounded(_middle(scene), 4)}


# What a study takes in all, in points of a response as the plan prices them: measured in processor time on
# the shipped scenes, as they are asked by default. A response has its peaks polished and its errors
# estimated, a front is a search for each of its points.
_SWEEP = 350
_POINTS: Mapping[str, int] = {
    "sweep": _SWEEP, "campbell": _SWEEP, "map": 41_000, "design": 2_500, "pareto": 110_000, "modes": 4_000,
    "accuracy": 40_000, "interference": 300,
}  # fmt: skip
_PROPOSED: Mapping[str, Callable[[Scene], Proposed]] = {
    "map": _map, "campbell": _campbell, "interference": _interference, "modes": _modes,
    "identify": _identify,
    "mistuning": _mistuning, "solve": _at_one_frequency, "march": _at_one_frequency,
}  # fmt: skip
