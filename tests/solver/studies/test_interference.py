"""Interference diagrams against the matrices of the whole annulus, and against orders by hand."""

import math
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.linalg import eigvals
from sector_cases import as_matrices

import solver
from solver import InterferenceStatus, Scene, SettingError, Wave, interference_diagram, load_scene
from solver.linear.assembly import linear_model
from solver.scene.cyclic.annulus import annulus
from solver.studies.interference import MOST_ORDERS, folded

# Across the boundary of the sector: within one it would turn both directions alike.
GYROSCOPIC = {"on": "tip", "of": "middle", "offset": 1, "antisymmetric": True, "gyroscopic": 5.0e-3}
STIFFENING = {"on": "tip", "of": "tip", "k_omega2": 0.05}


def every_frequency(scene: Scene, *, stuck: bool) -> np.ndarray:
    """All natural frequencies of the annulus [Hz] by the poles of its real matrices, no wave in sight."""
    whole = annulus(scene)
    model = linear_model(whole)
    M, K, G = model.M, model.K0.copy(), np.zeros_like(model.M)
    if model.extra is not None:
        more, damping = model.extra.at(np.ones(1, complex), np.ones(1, bool), K[None])
        K, G = K + more[0].real, damping[0].real
    if stuck:
        k = np.array([each for contact in whole.contacts for each in contact.stiffnesses])
        K = K + model.contact_here.T @ (k[:, None] * model.contact_here)
    n, inverse = len(M), np.linalg.inv(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ G]])
    turning = np.sort(eigvals(state).imag)
    return np.maximum(turning[n:], 0.0) / (2.0 * math.pi)


def told(diagram: solver.InterferenceDiagram, *, stuck: bool) -> np.ndarray:
    """What a diagram says of all waves of the disk, each direction counted."""
    found: list[float] = []
    for point in diagram.points:
        values = point.stuck_hz if stuck else point.open_hz
        found += list(values) * (2 if point.wave is Wave.BOTH else 1)
    return np.sort(found)


@pytest.mark.parametrize(
    "terms",
    [{}, {"couplings": [GYROSCOPIC, STIFFENING], "speed": 1.0}],
    ids=["plain", "gyroscopic and stiffening"],
)
@pytest.mark.parametrize("by_matrices", [False, True], ids=["lumped", "matrices"])
def test_the_waves_of_a_sector_are_the_modes_of_the_annulus(terms: dict[str, Any], by_matrices: bool) -> None:
    disk = load_scene("bladed-disk")
    raw = (as_matrices(disk) if by_matrices else disk.to_dict()) | terms
    diagram = interference_diagram(Scene.from_dict(raw), speed_rpm=40_000.0, families=100)
    judged = Scene.from_dict(
        disk.to_dict() | terms | {"speed": 40_000.0}
    )  # another speed than the scene's own
    for stuck in (False, True):
        wanted = every_frequency(judged, stuck=stuck)
        np.testing.assert_allclose(told(diagram, stuck=stuck), wanted, rtol=1e-7)
    waves = {point.wave for point in diagram.points}
    assert waves == ({Wave.STANDING, Wave.FORWARD, Wave.BACKWARD} if terms else {Wave.STANDING, Wave.BOTH})


def test_the_direction_is_that_of_the_forced_wave() -> None:
    """The response to a light force is highest where the diagram has the mode of that direction."""
    raw = load_scene("bladed-disk").to_dict() | {"couplings": [GYROSCOPIC], "contacts": [], "speed": 1.0}
    diagram = interference_diagram(Scene.from_dict(raw), speed_rpm=40_000.0)
    points = {(point.diameter, point.wave): point for point in diagram.points}
    ahead, back = (points[3, wave].open_hz[0] for wave in (Wave.FORWARD, Wave.BACKWARD))
    assert abs(ahead / back - 1.0) > 1e-4
    for order, wanted in ((3, ahead), (5, back)):
        force = {**load_scene("bladed-disk").to_dict()["excitation"], "engine_order": order}  # type: ignore[dict-item]
        scene = Scene.from_dict({**raw, "speed": 40_000.0, "excitation": force})
        peak = solver.sweep(scene, start=0.98 * wanted, stop=1.02 * wanted, harmonics=1).peak
        assert peak.at == pytest.approx(wanted, rel=5e-5)


def test_orders_are_folded_and_flagged() -> None:
    disk = load_scene("bladed-disk")  # eight sectors
    diagram = interference_diagram(disk, speed_rpm=11_000.0, up_to_hz=1400.0, within=0.02)
    assert diagram.status is InterferenceStatus.COMPLETED
    assert [(one.order, one.diameter, one.wave.value) for one in diagram.orders] == [
        (1, 1, "forward"), (2, 2, "forward"), (3, 3, "forward"), (4, 4, "standing"), (5, 3, "backward"),
        (6, 2, "backward"), (7, 1, "backward"),
    ]  # fmt: skip
    assert [folded(order, 8)[0] for order in (8, 9, 16, 15)] == [0, 1, 0, 1]
    by_diameter = {point.diameter: point for point in diagram.points}
    wanted = []
    for order in range(1, 8):
        hz = order * 11_000.0 / 60.0
        point = by_diameter[min(order % 8, 8 - order % 8)]
        for i, (free, stuck) in enumerate(zip(point.open_hz, point.stuck_hz, strict=True), start=1):
            assert free <= stuck
            away = max(free - hz, hz - stuck, 0.0) / hz
            if away <= 0.02:
                wanted.append((order, i, away))
    got = [(one.order, one.family, one.margin) for one in diagram.crossings]
    assert [one[:2] for one in got] == [one[:2] for one in wanted]
    assert [one[2] for one in got] == pytest.approx([one[2] for one in wanted], abs=1e-12)
    assert {one.inside for one in diagram.crossings} == {True, False}
    assert all(one.margin == 0.0 for one in diagram.crossings if one.inside)


def test_mistuning_and_standing_waves_leave_the_diagram_as_it_is() -> None:
    disk = load_scene("bladed-disk")
    plain = interference_diagram(disk)
    raw: dict[str, Any] = disk.to_dict()
    raw["structure"] = {**raw["structure"], "mistuning": {"of": ["tip"], "spread": 0.02}}
    raw["excitation"] = {**raw["excitation"], "pattern": "standing", "engine_order": 3}
    raw["observe"] = {**raw["observe"], "dof": "tip@3"}
    other = interference_diagram(Scene.from_dict(raw))
    assert [point.to_json() for point in other.points] == [point.to_json() for point in plain.points]
    assert plain.speed_rpm is None
    assert not plain.orders
    assert not plain.crossings


def test_a_sector_that_was_reduced_for_some_nodal_diameters_says_which_are_missing() -> None:
    raw: dict[str, Any] = load_scene("fe-disk").to_dict()
    table = raw["structure"]["diameters"]
    kept = [0, 4, 8, 12]
    small = {key: [table[key][n] for n in kept] for key in ("M", "K")} | {"diameters": kept}
    raw["structure"] = {**raw["structure"], "diameters": small}
    diagram = interference_diagram(Scene.from_dict(raw), speed_rpm=4000.0, up_to_hz=900.0)
    assert [point.diameter for point in diagram.points] == kept
    assert diagram.missing == (1, 2, 3, 5, 6, 7, 9, 10, 11)
    assert {one.diameter for one in diagram.crossings} <= set(kept)
    assert diagram.points[0].open_hz[:2] == pytest.approx((172.037, 521.152), rel=4e-4)  # docs/fe-disk.md


def test_it_can_be_stopped() -> None:
    seen: list[int] = []
    stopped = interference_diagram(
        load_scene("bladed-disk"), on_progress=lambda _, n: seen.append(n), should_stop=lambda: len(seen) == 2
    )
    assert stopped.status is InterferenceStatus.STOPPED
    assert not stopped.reached
    assert [point.diameter for point in stopped.points] == [0, 1]


@each(
    ("name", "options", "words"),
    [
        ("two-dof", {}, "`scene` must be a disk"),
        ("bladed-disk", {"speed_rpm": 0.0}, "`speed_rpm` must be a speed above 0"),
        ("bladed-disk", {"orders": [3]}, "`speed_rpm` must be given with `orders`"),
        ("bladed-disk", {"speed_rpm": 1e4, "orders": [3, 0]}, r"`orders\[1\]` must be a whole number"),
        ("bladed-disk", {"speed_rpm": 1e4, "orders": []}, "`orders` must be a list"),
        ("bladed-disk", {"families": 0}, "`families` must be"),
        ("bladed-disk", {"up_to_hz": -1.0}, "`up_to_hz` must be"),
        ("bladed-disk", {"within": 1.5}, "`within` must be"),
        ("bladed-disk", {"speed_rpm": 1.0}, f"there {MOST_ORDERS} orders reach"),
    ],
)
def test_what_is_wrong_is_named(name: str, options: dict[str, Any], words: str) -> None:
    with pytest.raises(SettingError, match=words):
        interference_diagram(load_scene(name), **options)


def test_matrices_that_follow_the_speed_need_one() -> None:
    raw = load_scene("bladed-disk").to_dict() | {"couplings": [STIFFENING], "speed_order": 4.0}
    scene = Scene.from_dict(raw)
    with pytest.raises(SettingError, match="`speed_rpm` must be given"):
        interference_diagram(scene)
    slow, fast = (interference_diagram(scene, speed_rpm=rpm).points[0].open_hz[0] for rpm in (1e3, 4e4))
    assert fast > slow * 1.001
