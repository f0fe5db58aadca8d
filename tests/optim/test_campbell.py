"""Campbell diagrams: crossings, bands and natural frequencies against solves; the command and its picture."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from each import each
from scene_cases import bladed_disk, mixed_disk, oscillator, two_dof

import solver
from optim import CampbellStatus, DesignError, campbell_diagram, forbidden_hz
from optim.problem.cases import with_engine_order
from service.cli import main
from solver.errors import SettingError
from solver.linear.natural_frequencies import natural_frequencies

DISK = [
    "campbell",
    "bladed-disk",
    "--speeds",
    "9000",
    "12000",
    "--order",
    "3",
    "--order",
    "4",
    "--limit",
    "4e-5",
]
PLAIN = ["campbell", "two-dof", "--speeds", "60", "100"]


def test_forbidden_frequencies_are_the_speeds_times_the_order() -> None:
    assert forbidden_hz((3000.0, 3600.0), 2) == ((100.0, 120.0),)
    assert forbidden_hz([[6000.0, 9000.0], [600.0, 1200.0]], 3) == ((30.0, 60.0), (300.0, 450.0))


def test_crossings_are_where_an_order_meets_the_peaks_of_its_response() -> None:
    diagram = campbell_diagram(two_dof(), speeds_rpm=(60.0, 100.0), orders=[2, 1])
    assert diagram.status is CampbellStatus.COMPLETED
    assert [one.order for one in diagram.orders] == [1, 2]
    peaks = [peak for peak in solver.sweep(two_dof(), start=0.2, stop=10.0 / 3.0).peaks if peak.interior]
    for one in diagram.orders:
        assert one.running_hz == forbidden_hz((60.0, 100.0), one.order)
        for crossing, peak in zip(one.crossings, sorted(peaks, key=lambda peak: peak.at), strict=True):
            assert crossing.frequency_hz == pytest.approx(peak.at, rel=1e-6)
            assert crossing.speed_rpm == pytest.approx(60.0 * peak.at / one.order, rel=1e-6)
            assert crossing.inside == (60.0 <= crossing.speed_rpm <= 100.0)
            away = min(abs(crossing.speed_rpm / end - 1.0) for end in (60.0, 100.0))
            assert crossing.margin == (0.0 if crossing.inside else pytest.approx(away))
    assert [[c.inside for c in one.crossings] for one in diagram.orders] == [[True, False], [False, True]]
    assert diagram.clear is False


def test_the_limit_is_exceeded_exactly_between_the_ends_of_the_bands() -> None:
    limit = 1.5
    diagram = campbell_diagram(two_dof(), speeds_rpm=(60.0, 70.0), orders=[1], limit=limit)
    (one,) = diagram.orders
    assert one.limit == limit
    for (low, high), (slow, fast) in zip(one.bands_hz, one.exceeded_rpm, strict=True):
        for hz, rpm in ((low, slow), (high, fast)):
            assert rpm == pytest.approx(60.0 * hz)
            assert solver.solve(two_dof(), frequency_hz=hz).max_abs == pytest.approx(limit, rel=1e-6)
    slow, fast = one.exceeded_rpm[0]
    assert slow < 60.0 < 70.0 < fast
    assert one.exceeded_running_rpm == ((60.0, 70.0),)
    assert diagram.clear is False
    assert campbell_diagram(two_dof(), speeds_rpm=(90.0, 100.0), orders=[1], limit=limit).clear is True


@pytest.mark.parametrize(("low", "high"), [(40.0, 55.0), (60.0, 70.0), (80.0, 100.0)])
def test_the_highest_amplitude_at_running_speeds(low: float, high: float) -> None:
    """Before, around and beyond the peak: at an end of the speeds or at the peak itself."""
    (one,) = campbell_diagram(two_dof(), speeds_rpm=(low, high), orders=[1]).orders
    speeds = np.linspace(low, high, 41)
    amplitudes = [solver.solve(two_dof(), frequency_hz=speed / 60.0).max_abs for speed in speeds]
    highest = one.highest_running
    assert highest is not None
    assert highest.inside
    assert highest.amplitude >= max(amplitudes) * (1.0 - 1e-9)
    assert highest.amplitude == pytest.approx(max(amplitudes), rel=5e-3)
    assert abs(highest.speed_rpm - speeds[int(np.argmax(amplitudes))]) <= speeds[1] - speeds[0]


def test_orders_of_a_disk_are_its_engine_orders() -> None:
    diagram = campbell_diagram(bladed_disk(), speeds_rpm=(9000.0, 12000.0), orders=[3, 4], limit=4e-5)
    for one in diagram.orders:
        low, high = one.branch.start, one.branch.stop
        assert low == min(500.0, 150.0 * one.order)
        alone = solver.sweep(with_engine_order(bladed_disk(), one.order), start=low, stop=high, limit=4e-5)
        assert alone.peak is not None
        assert max(c.amplitude for c in one.crossings) == pytest.approx(alone.peak.value, rel=1e-9)
        assert alone.band is not None
        assert one.bands_hz == alone.band.intervals
    third, fourth = diagram.orders
    assert third.exceeded_running_rpm == ()
    assert fourth.exceeded_running_rpm[0][1] == 12000.0
    assert third.highest_running is not None
    assert third.highest_running.speed_rpm == 12000.0


def test_natural_frequencies_are_those_of_the_nodal_diameter() -> None:
    """The published ones: the shroud stuck, 755.0 to 785.0 Hz; free, 575.0 to 587.1 Hz."""
    shown = [natural_frequencies(with_engine_order(bladed_disk(), n), stuck=True)[0] for n in (1, 2, 3, 4)]
    assert shown[0] == pytest.approx(755.0, abs=0.05)
    assert shown[3] == pytest.approx(785.0, abs=0.05)
    assert shown == sorted(shown)
    loose = bladed_disk().to_dict()
    loose["contacts"] = [c for c in loose["contacts"] if c["name"] == "root"]  # type: ignore[attr-defined]
    open_shroud = solver.Scene.from_dict(loose)
    free = [natural_frequencies(with_engine_order(open_shroud, n), stuck=True)[0] for n in (0, 4)]
    assert free == pytest.approx([575.0, 587.1], abs=0.06)


@pytest.mark.parametrize("stuck", [True, False])
@pytest.mark.parametrize("scene", [two_dof(), bladed_disk(), mixed_disk()], ids=["two-dof", "disk", "mixed"])
def test_natural_frequencies_are_resonances_of_the_undamped_structure(
    scene: solver.Scene, stuck: bool
) -> None:
    """The determinant of K − ω²M of the whole structure, every contact a spring or nothing, is 0 there."""
    whole = solver.annulus(scene) if scene.structure.kind == "cyclic" else scene
    dofs = list(whole.structure.dofs)
    raw = whole.to_dict()["structure"]
    K, M = np.zeros((len(dofs), len(dofs))), np.zeros(len(dofs))
    for dof, mass in raw["masses"].items():  # type: ignore[index]
        M[dofs.index(dof)] = mass["m"] if isinstance(mass, dict) else mass
    joined = [(spring["between"], spring["k"]) for spring in raw["springs"]]  # type: ignore[index]
    if stuck:
        joined += [(contact.between, contact.kt) for contact in whole.contacts]  # type: ignore[attr-defined]
    for (first, second), k in joined:
        row = np.zeros(len(dofs))
        for end, sign in ((first, 1.0), (second, -1.0)):
            if end != "ground":
                row[dofs.index(end)] += sign
        K += k * np.outer(row, row)
    all_of_them = np.sqrt(np.maximum(np.linalg.eigvals(K / M[:, None]).real, 0.0)) / (2.0 * math.pi)
    for value in natural_frequencies(scene, stuck=stuck):
        assert np.abs(all_of_them - value).min() <= 1e-9 * value + 1e-6


def test_a_response_that_ends_early_is_not_clear() -> None:
    scene = oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0)
    ended = campbell_diagram(
        scene, speeds_rpm=(12.0, 15.0), orders=[1], limit=1e9, band_hz=(0.05, 0.3), harmonics=3
    )
    assert ended.status is CampbellStatus.UNDAMPED
    assert ended.clear is None
    assert not ended.reached
    nothing = campbell_diagram(
        scene, speeds_rpm=(12.0, 15.0), band_hz=(1.0 / (2.0 * math.pi), 0.3), limit=1.0, harmonics=3
    )
    assert nothing.status is CampbellStatus.UNDAMPED
    assert nothing.orders[0].highest_running is None
    obj = json.loads(json.dumps(nothing.to_json(), allow_nan=False))
    assert obj["orders"][0]["peaks"] == []
    assert obj["orders"][0]["limit"] is None


def test_progress_and_stop() -> None:
    seen: list[tuple[float, int]] = []
    campbell_diagram(
        bladed_disk(), speeds_rpm=(9000.0, 9100.0), orders=[3, 4], harmonics=3,
        on_progress=lambda share, points: seen.append((share, points)),
    )  # fmt: skip
    assert [share for share, _ in seen] == sorted(share for share, _ in seen)
    assert [points for _, points in seen] == sorted(points for _, points in seen)
    assert seen[-1][0] == 1.0
    stopped = campbell_diagram(
        bladed_disk(), speeds_rpm=(9000.0, 9100.0), orders=[3, 4], should_stop=lambda: True
    )
    assert stopped.status is CampbellStatus.STOPPED
    assert stopped.clear is not True


@each(
    ("arguments", "message"),
    [
        ({"speeds_rpm": (10.0, 5.0)}, r"`speeds_rpm` must have 0 < low < high"),
        ({"speeds_rpm": [(1.0, 2.0), (0.0, 5.0)]}, r"`speeds_rpm\[1\]` must have 0 < low < high"),
        ({"speeds_rpm": "fast"}, r"`speeds_rpm` must be \[low, high\]"),
        ({"speeds_rpm": (1.0, math.nan)}, r"`speeds_rpm` must be two finite numbers"),
        ({"orders": [1, 0]}, r"`orders\[1\]` must be a whole number >= 1.*got 0"),
        ({"orders": [True]}, r"`orders\[0\]` must be a whole number"),
        ({"orders": []}, r"`orders` must be a list"),
        ({"orders": list(range(1, 102))}, r"`orders` must be at most 100"),
        ({"band_hz": (0.0, 1.0)}, r"`band_hz` must have 0 < low < high"),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        campbell_diagram(two_dof(), **{"speeds_rpm": (60.0, 100.0), **arguments})  # type: ignore[arg-type]


def test_a_bad_limit_is_named() -> None:
    with pytest.raises(SettingError, match="`limit` must be an amplitude > 0"):
        campbell_diagram(two_dof(), speeds_rpm=(60.0, 100.0), limit=-1.0)


@pytest.mark.parametrize("arguments", [DISK, PLAIN])
def test_json_is_one_object(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"orders", "speeds_rpm", "limit", "clear", "seconds", "status"} <= set(found)
    for order in found["orders"]:
        keys = {"order", "peaks", "bands_hz", "crossings_rpm", "stuck_hz", "open_hz", "running_hz", "limit"}
        assert keys <= set(order)
        assert order["crossings_rpm"] == [crossing["speed_rpm"] for crossing in order["crossings"]]
        assert sorted(peak["value"] for peak in order["peaks"]) == sorted(
            crossing["amplitude"] for crossing in order["crossings"]
        )


def test_words_name_the_crossings(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(DISK) == 0
    out = capsys.readouterr().out
    assert "11840" in out
    assert "running speed" in out
    assert "785 Hz" in out
    assert "above 40 µm from 11440 to 12000 rpm" in out


@pytest.mark.few(3)
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
@pytest.mark.parametrize("arguments", [DISK, PLAIN])
def test_pictures_are_written(
    arguments: list[str], suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / f"picture{suffix}"
    assert main([*arguments, "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 4000
    assert capsys.readouterr().err == ""
    if suffix == ".svg":
        assert "speed [rpm]" in picture.read_text(encoding="utf-8")
