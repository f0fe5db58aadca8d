"""Interference diagrams of disks: natural frequencies over the nodal diameter, and the engine orders there.

Engine order e of a disk of N equal sectors is a wave of the nodal diameter n = min(e mod N, N - e mod N): it
runs forward where e mod N < N/2, backward where it is above, and it stands at 0 and at N/2. At a speed Ω it
has the frequency e Ω, so that over the nodal diameters the orders lie on a straight line that is folded at 0
and at N/2. A resonance needs both, the frequency and the nodal diameter (M. P. Singh, J. J. Vargo, D. M.
Schiffer, J. D. Dello, SAFE Diagram, Proc. 17th Turbomachinery Symposium, 1988, 93-101).

Contacts add stiffness, so that each natural frequency of a structure that keeps its energy lies between those
with all contacts open and all stuck (Courant, Fischer); what friction does moves a resonance between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from solver.linear.extra_terms import depends_on_speed
from solver.linear.natural_frequencies import natural_frequencies
from solver.modes.nonlinear_mode import at_nodal_diameter
from solver.results import units
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import MatricesStructure, Scene
from solver.studies.mistuning import without_mistuning
from solver.studies.study_results import (
    DiameterFrequencies,
    FoldedOrder,
    Interference,
    InterferenceDiagram,
    InterferenceStatus,
    Wave,
)

MOST_FAMILIES = 100
MOST_ORDERS = 1000
_ALIKE = 1e-9  # relative difference of the frequencies of both directions that is rounding
_REVOLUTIONS = 60.0


@shows_progress("interference")
def interference_diagram(
    scene: Scene,
    *,
    speed_rpm: float | None = None,
    orders: Sequence[int] | None = None,
    families: int = 6,
    up_to_hz: float | None = None,
    within: float = 0.05,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> InterferenceDiagram:
    """Compute the interference diagram (SAFE diagram) of a disk: its frequencies at every nodal diameter.

    Parameters
    ----------
    scene : a cyclic one, of masses and springs or of the matrices of a sector; dashpots and forces do not
        count, and mistuning is left out. What follows the speed of rotation is that of `speed_rpm`.
    speed_rpm : speed of rotation [1/min]; that of the scene if left out, and without one no orders.
    orders : excitations a revolution; if left out all up to the highest frequency, or to `up_to_hz`.
    families : how many natural frequencies at each nodal diameter, from the lowest on.
    up_to_hz : families that begin above are left out [Hz].
    within : distance of an order from the range of a family, relative to its frequency, that counts.
    on_progress : called with (share done, nodal diameters so far).
    should_stop : asked before each nodal diameter; True ends the diagram with the status STOPPED.

    Raises
    ------
    SettingError
        A scene without sectors, a bad speed, order, number of families, range or distance.
    """
    begun = clock()
    speed = checked_speed(scene, speed_rpm, orders)
    _check(families, up_to_hz, within)
    chosen = None if orders is None else tuple(sorted({int(order) for order in orders}))
    tuned, sectors = _at_speed(scene, speed), scene.structure.sector_count
    built = _built(scene)
    points: list[DiameterFrequencies] = []
    stopped = False
    for done, n in enumerate(built):
        stopped = should_stop is not None and should_stop()
        if stopped:
            break
        points += [_cut(point, families, up_to_hz) for point in _at_diameter(tuned, n, sectors)]
        if on_progress is not None:
            on_progress((done + 1) / len(built), done + 1)
    excited = () if speed is None else _folded(chosen, points, speed, sectors, within, up_to_hz)
    return InterferenceDiagram(
        scene=scene, sectors=sectors, speed_rpm=speed, within=within, points=tuple(points), orders=excited,
        crossings=tuple(_crossings(excited, points, within)),
        missing=tuple(n for n in range(sectors // 2 + 1) if n not in built),
        status=InterferenceStatus.STOPPED if stopped else InterferenceStatus.COMPLETED,
        seconds=clock() - begun,
    )  # fmt: skip


def folded(order: int, sectors: int) -> tuple[int, Wave]:
    """Return the nodal diameter that an engine order excites, and which way its wave runs."""
    rest = order % sectors
    n = min(rest, sectors - rest)
    if 2 * n % sectors == 0:
        return n, Wave.STANDING
    return n, Wave.FORWARD if rest == n else Wave.BACKWARD


def checked_speed(scene: Scene, speed_rpm: float | None, orders: Sequence[int] | None) -> float | None:
    """Return the speed [1/min] of the diagram of a scene, its own if none is given; errors as the diagram."""
    if not scene.structure.has_sectors:
        wanted = "must be a disk of equal sectors: only there are nodal diameters"
        raise SettingError("scene", scene.name, wanted)
    if speed_rpm is not None and not _positive(speed_rpm):
        raise SettingError("speed_rpm", speed_rpm, "must be a speed above 0 [1/min]")
    _check_orders(orders)
    speed = scene.speed or None if speed_rpm is None else float(speed_rpm)
    if speed is None and orders is not None:
        wanted = "must be given with `orders`: an order has a frequency at a speed alone"
        raise SettingError("speed_rpm", None, wanted)
    if speed is None and scene.speed_order is not None and depends_on_speed(scene):
        wanted = "must be given: the matrices of this scene follow the speed"
        raise SettingError("speed_rpm", None, wanted)
    return speed


def _check_orders(orders: Any) -> None:
    """Raise SettingError unless orders are left out or are whole numbers above 0."""
    if orders is None:
        return
    if not isinstance(orders, Sequence) or isinstance(orders, str) or not 0 < len(orders) <= MOST_ORDERS:
        raise SettingError("orders", orders, f"must be a list of 1 to {MOST_ORDERS} whole numbers >= 1")
    for i, order in enumerate(orders):
        check_count(("orders", i), order, 1)


def _check(families: int, up_to_hz: float | None, within: float) -> None:
    """Raise SettingError for a bad number of families, frequency or distance."""
    check_count("families", families, 1, MOST_FAMILIES)
    if up_to_hz is not None and not _positive(up_to_hz):
        raise SettingError("up_to_hz", up_to_hz, "must be a frequency above 0 [Hz]")
    if isinstance(within, bool) or not isinstance(within, int | float) or not 0.0 <= within <= 1.0:
        raise SettingError("within", within, "must be a share from 0 to 1")


def _positive(value: Any) -> bool:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return good and 0.0 < value < math.inf


def _at_speed(scene: Scene, speed: float | None) -> Scene:
    """Return the tuned disk at a speed under waves that travel: one sector stands for all."""
    waves = tuple(force.model_copy(update={"pattern": None}) for force in scene.excitation)
    observe = scene.observe.model_copy(update={"dof": scene.observe.dof.partition("@")[0]})
    there = {"speed": speed, "speed_order": None, "with_speed": (), "excitation": waves, "observe": observe}
    return without_mistuning(scene).model_copy(update=there)


def _built(scene: Scene) -> tuple[int, ...]:
    """Return the nodal diameters that the structure is known at, ascending."""
    structure = scene.structure
    if isinstance(structure, MatricesStructure) and structure.diameters is not None:
        return structure.diameters.diameters
    return tuple(range(structure.sector_count // 2 + 1))


def _at_diameter(scene: Scene, n: int, sectors: int) -> Iterator[DiameterFrequencies]:
    """Give the frequencies at a nodal diameter, of both directions where they differ."""
    ahead = _frequencies(scene, n, n, Wave.STANDING)
    if 2 * n % sectors == 0:
        yield ahead
        return
    back = _frequencies(scene, n, -n, Wave.BACKWARD)
    pairs = ((ahead.open_hz, back.open_hz), (ahead.stuck_hz, back.stuck_hz))
    if all(np.allclose(a, b, rtol=_ALIKE, atol=_ALIKE * max(a, default=0.0)) for a, b in pairs):
        yield replace(ahead, wave=Wave.BOTH)
        return
    yield replace(ahead, wave=Wave.FORWARD)
    yield back


def _frequencies(scene: Scene, n: int, signed: int, wave: Wave) -> DiameterFrequencies:
    here = at_nodal_diameter(scene, signed)
    free, stuck = (natural_frequencies(here, stuck=each).tolist() for each in (False, True))
    return DiameterFrequencies(diameter=n, wave=wave, open_hz=tuple(free), stuck_hz=tuple(stuck))


def _cut(point: DiameterFrequencies, families: int, up_to_hz: float | None) -> DiameterFrequencies:
    """Return the lowest families, each with both of its frequencies."""
    top = math.inf if up_to_hz is None else up_to_hz
    kept = min(families, sum(value <= top for value in point.open_hz))
    return replace(point, open_hz=point.open_hz[:kept], stuck_hz=point.stuck_hz[:kept])


def _folded(
    orders: tuple[int, ...] | None, points: Sequence[DiameterFrequencies], speed: float, sectors: int,
    within: float, up_to_hz: float | None,
) -> tuple[FoldedOrder, ...]:  # fmt: skip
    """Return what orders excite; without any all up to the highest frequency of the diagram."""
    per_order = speed / _REVOLUTIONS
    if orders is None:
        highest = max((max(point.stuck_hz + point.open_hz, default=0.0) for point in points), default=0.0)
        top = min(highest * (1.0 + within), math.inf if up_to_hz is None else up_to_hz)
        most = math.floor(top / per_order)
        if most > MOST_ORDERS:
            wanted = (
                f"must be at least {units.quantity(top * _REVOLUTIONS / MOST_ORDERS, '1/min')}: there "
                f"{MOST_ORDERS} orders reach the highest frequency; or give `orders` or a lower `up_to_hz`"
            )
            raise SettingError("speed_rpm", speed, wanted)
        orders = tuple(range(1, most + 1))
    found = []
    for order in orders:
        n, wave = folded(order, sectors)
        found.append(FoldedOrder(order=order, diameter=n, wave=wave, frequency_hz=order * per_order))
    return tuple(found)


def _crossings(
    orders: Sequence[FoldedOrder], points: Sequence[DiameterFrequencies], within: float
) -> Iterator[Interference]:
    """Give what orders meet, ascending in the order, then in the family."""
    known = {(point.diameter, point.wave): point for point in points}
    for one in orders:
        point = known.get((one.diameter, one.wave)) or known.get((one.diameter, Wave.BOTH))
        if point is None:
            continue
        for family, (free, stuck) in enumerate(zip(point.open_hz, point.stuck_hz, strict=True), start=1):
            low, high = min(free, stuck), max(free, stuck)
            away = max(low - one.frequency_hz, one.frequency_hz - high, 0.0) / one.frequency_hz
            if away <= within:
                yield Interference(
                    order=one.order, diameter=one.diameter, wave=one.wave, family=family,
                    frequency_hz=one.frequency_hz, open_hz=free, stuck_hz=stuck, margin=away,
                )  # fmt: skip
