"""No study tells a number of a peak that nothing damps: each ends with a word."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from each import each

import optim
import solver
from solver import Scene

RUB = {"name": "d", "between": ["a", "b"], "kt": 20.0, "mu": 0.3, "N0": 1.0}
ENDS = (["a", "ground"], ["b", "ground"])


def pair(*contacts: dict[str, Any], **structure: Any) -> Scene:
    """Two equal masses; no contact between them moves in the mode in which they are in phase, at 1.007 Hz."""
    lumped = {
        "kind": "lumped", "masses": {"a": 1.0, "b": 1.0},
        "springs": [{"name": f"k{end}", "between": [end, ground], "k": 40.0} for end, ground in ENDS],
    }  # fmt: skip
    return Scene.from_dict(
        {
            "name": "pair", "structure": structure or lumped, "contacts": list(contacts),
            "excitation": {"dof": "a", "amplitude": 1.0}, "observe": {"dof": "b", "band": [0.5, 1.05]},
        }
    )  # fmt: skip


def disk(wave: int, *contacts: dict[str, Any]) -> Scene:
    """Four blades whose shrouds move together in the wave of order 0."""
    return Scene.from_dict(
        {
            "name": "disk",
            "structure": {
                "kind": "cyclic", "sectors": 4, "masses": {"tip": 1.0, "disk": 3.0},
                "springs": [
                    {"name": "blade", "between": ["tip", "disk"], "k": 40.0},
                    {"between": ["disk", "ground"], "k": 200.0},
                    {"between": ["disk", "disk@next"], "k": 30.0},
                ],
            },
            "contacts": list(contacts),
            "excitation": {"dof": "tip", "amplitude": 1.0, "engine_order": wave},
            "observe": {"dof": "tip", "band": [0.5, 1.1]},
        }
    )  # fmt: skip


SCENES: dict[str, Callable[[], Scene]] = {
    "slips": lambda: pair(RUB),
    "sticks": lambda: pair({**RUB, "N0": 1e9}),
    "gap": lambda: pair(RUB, {"name": "g", "law": "gap", "between": ["a", "b"], "k": 30.0, "gap": 0.1}),
    "polynomial": lambda: pair(RUB, {"name": "p", "law": "polynomial", "between": ["a", "b"], "a3": 3.0}),
    "disk": lambda: disk(0, {**RUB, "between": ["tip", "tip@next"]}),
}
VARIABLES = {"d.N0": (1.0, 30.0)}
STUDIES: dict[str, Callable[[Scene], Any]] = {
    "sweep": lambda s: solver.sweep(s, harmonics=1),
    "peaks": lambda s: solver.track_peak(s, "d.N0", 1.0, 30.0, harmonics=1),
    "least": lambda s: solver.least_peak(s, "d.N0", 1.0, 30.0, harmonics=1),
    "map": lambda s: solver.response_map(s, "d.N0", 1.0, 30.0, steps=2, frequencies=4, harmonics=1).ridge,
    "margin": lambda s: solver.margin_diagram(s, start=1.0, stop=4.0, points=2, limit=1.0, harmonics=1),
    "campbell": lambda s: (
        optim.campbell_diagram(s, speeds_rpm=(30.0, 60.0), orders=[4], harmonics=1)
        if s.structure.has_sectors
        else optim.campbell_diagram(s, speeds_rpm=(30.0, 60.0), harmonics=1)
    ),
    "sensitivities": lambda s: optim.sensitivities(s, harmonics=1),
    "design": lambda s: optim.design(s, variables=VARIABLES, harmonics=1),
    "limited": lambda s: optim.design(s, variables=VARIABLES, max_peak=1.0, harmonics=1),
    "robust": lambda s: optim.robust_design(
        s, variables=VARIABLES, uncertain={"d.mu": [0.2, 0.3]}, harmonics=1
    ),
}
OF_PEAKS = {
    "peak", "peaks", "peak_max_abs", "error_estimate", "magnification", "largest", "stress", "used",
    "highest_running", "tuned_peak", "tuned_at_hz", "worst", "allowed", "bands_hz", "band_hz", "optimum",
}  # fmt: skip


def numbers_of_peaks(told: Any, *, of_peak: bool = False) -> Iterator[float]:
    """What an answer says of peaks: every number below a key of `OF_PEAKS`."""
    if isinstance(told, dict):
        for key, value in told.items():
            yield from numbers_of_peaks(value, of_peak=of_peak or key in OF_PEAKS)
    elif isinstance(told, list | tuple):
        for value in told:
            yield from numbers_of_peaks(value, of_peak=of_peak)
    elif of_peak and isinstance(told, float) and math.isfinite(told):
        yield told


@each("study", STUDIES)
@each("scene", SCENES)
def test_no_number_where_a_mode_is_driven_that_nothing_damps(scene: str, study: str) -> None:
    found = STUDIES[study](SCENES[scene]())
    assert found.status.name == "UNDAMPED"
    assert not list(numbers_of_peaks(found.to_json()))


@pytest.mark.parametrize("scene", ["slips", "disk"])
def test_a_front_and_a_study_of_accuracy_say_so(scene: str) -> None:
    front = optim.pareto_front(SCENES[scene](), variables=VARIABLES, limit=1e-6, points=3, harmonics=1)
    assert not front.points
    assert {one.status.name for one in front.ended} == {"UNDAMPED"}
    with pytest.raises(solver.SettingError, match="no damping"):
        solver.accuracy_study(SCENES[scene]())


DISKS: dict[str, Callable[[Scene], Any]] = {
    "worst": lambda s: solver.worst_mistuning(s, of="blade", harmonics=1),
    "open": lambda s: solver.worst_mistuning(s, of="blade", contacts="open"),
    "mistuning": lambda s: solver.mistuning_study(s, of="blade", samples=2, harmonics=1),
}


@pytest.mark.parametrize("study", DISKS)
@pytest.mark.parametrize("wave", [0, 1])
def test_no_disk_without_damping_has_a_magnification(wave: int, study: str) -> None:
    found = DISKS[study](disk(wave))
    assert found.status.name == "UNDAMPED"
    assert not list(numbers_of_peaks(found.to_json()))


@each("every_branch", [True, False])
@each("wave", [0, 1])
@each("contacts", [[], [{**RUB, "between": ["tip", "tip@next"]}]])
def test_no_blade_has_a_peak_beyond_what_friction_holds(
    contacts: list[dict[str, Any]], wave: int, every_branch: bool
) -> None:
    """Four blades under 1 N each, and four shrouds of 0.3 N that hardly move where blades nearly agree."""
    scene = solver.mistuned(disk(wave, *contacts), of="blade", values=[1.01, 1.0, 0.99, 1.002])
    found = solver.blade_peaks(scene, harmonics=1, every_branch=every_branch)
    assert {status.name for status in found.status} == {"UNDAMPED"}
    assert all(map(math.isnan, found.value))


@pytest.mark.parametrize("share", [0.6, 0.95, 1.05, 1.5])
def test_a_slider_holds_a_resonance_up_to_its_force(share: float) -> None:
    """Of one mass: up to F = 4 μN/π, as Den Hartog has it; the march says what is below."""
    limit, natural = 4.0 * 0.5 * 2.0 / math.pi, 1.0 / (2.0 * math.pi)
    scene = Scene.from_dict(
        {
            "name": "slider",
            "structure": {
                "kind": "lumped", "masses": {"a": 1.0}, "springs": [{"between": ["a", "ground"], "k": 1.0}],
            },
            "contacts": [{"name": "d", "between": ["a", "ground"], "kt": 1.0, "mu": 0.5, "N0": 2.0}],
            "excitation": {"dof": "a", "amplitude": share * limit},
            "observe": {"dof": "a", "band": [0.6 * natural, 1.6 * natural]},
        }
    )  # fmt: skip
    branch = solver.sweep(scene)
    assert (branch.status.name == "UNDAMPED") is (share > 1.0)
    if branch.peak is None:
        assert share > 1.0
        return
    marched = solver.march(scene, frequency_hz=branch.peak.at)
    assert abs(branch.peak.value - marched.max_abs) <= 2.0 * branch.error_estimate + 1e-4 * marched.max_abs
