"""A highest amplitude at an end of the band is told from a maximum: eigenvalues and single solves judge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import optim
import solver
from optim.results.design_result import Certainty
from solver.response.plausibility import BAND_END
from solver.results.known import Note
from solver.scene.scene import Scene

RUNS = 200
ONE_OF = 20  # run by default; 200 of each kind are long


def blade(band: tuple[float, float], *, k: float = 6e5, m: float = 0.06) -> dict[str, Any]:
    """Two masses and a snubber: 467 and 686 Hz open, 584 and 719 Hz stuck."""
    return {
        "name": "blade",
        "structure": {
            "kind": "lumped", "masses": {"tip": m, "root": 0.5 * m / 0.06},
            "springs": [
                {"name": "airfoil", "between": ["tip", "root"], "k": k, "c": 3.0},
                {"name": "neck", "between": ["root", "ground"], "k": 8e6 * k / 6e5, "c": 20.0},
            ],
        },
        "contacts": [
            {"name": "snubber", "between": ["tip", "ground"], "kt": 4e5 * k / 6e5, "mu": 0.25, "N0": 30.0}
        ],
        "excitation": {"dof": "tip", "amplitude": 4.0},
        "observe": {"dof": "tip", "band": list(band)},
    }  # fmt: skip


def chain(rng: np.random.Generator) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """A chain of two to four masses with a rubbing contact, and its frequencies [Hz] open and stuck."""
    n = int(rng.integers(2, 5))
    masses, k = rng.uniform(0.05, 1.0, n), 10.0 ** rng.uniform(5.0, 7.0, n)
    kt, at = float(k.min() * rng.uniform(0.1, 1.0)), int(rng.integers(0, n))
    K = np.zeros((n, n))
    for i, each in enumerate(k):  # from the ground outwards
        K[i, i] += each
        if i:
            K[i - 1, i - 1] += each
            K[i, i - 1] -= each
            K[i - 1, i] -= each
    stuck = K.copy()
    stuck[at, at] += kt
    root = 1.0 / np.sqrt(masses)
    hertz = [np.sqrt(np.linalg.eigvalsh(root[:, None] * one * root)) / (2 * np.pi) for one in (K, stuck)]
    names = ["ground", *(f"m{i}" for i in range(n))]
    ratio = 0.01 / (2 * np.pi * hertz[0][0])  # of stiffness, so that the first mode has 0.5 %
    raw = {
        "name": "chain",
        "structure": {
            "kind": "lumped", "masses": {f"m{i}": float(m) for i, m in enumerate(masses)},
            "springs": [
                {"name": f"s{i}", "between": [names[i], names[i + 1]], "k": one, "c": one * ratio}
                for i, one in enumerate(k.tolist())
            ],
        },
        "contacts": [
            {"name": "rub", "between": [f"m{at}", "ground"], "kt": kt, "mu": 0.3, "N0": rng.uniform(1, 50)}
        ],
        "excitation": {"dof": f"m{n - 1}", "amplitude": float(rng.uniform(1.0, 20.0))},
        "observe": {"dof": f"m{n - 1}", "band": [1.0, 2.0]},
    }  # fmt: skip
    return raw, hertz[0], hertz[1]


def notes(found: Any, name: str = BAND_END) -> list[Note]:
    return [note for note in found.notes if note.name == name]


def brute_force(scene: Scene, count: int = 41) -> tuple[float, float]:
    """The frequency and height of the highest of many single solves."""
    places = np.linspace(*scene.observe.band, count)
    heights = [solver.solve(scene, frequency_hz=float(at), harmonics=5).max_abs for at in places]
    return float(places[int(np.argmax(heights))]), max(heights)


MISPLACED = {  # what a slip makes of masses, stiffnesses and the band
    "none": (1.0, 1.0, 1.0), "k in N/mm": (1.0, 1e-3, 1.0), "masses in g": (1e3, 1.0, 1.0),
    "band in rad/s": (1.0, 1.0, 2 * np.pi), "k in N/um": (1.0, 1e-6, 1.0),
}  # fmt: skip


def misplaced(raw: dict[str, Any], way: str) -> dict[str, Any]:
    """The scene with a unit in the wrong place."""
    of_m, of_k, of_hz = MISPLACED[way]
    structure = raw["structure"]
    masses = {name: of_m * m for name, m in structure["masses"].items()}
    springs = [{**one, "k": of_k * one["k"], "c": of_k * one["c"]} for one in structure["springs"]]
    contacts = [{**one, "kt": of_k * one["kt"]} for one in raw["contacts"]]
    band = [of_hz * end for end in raw["observe"]["band"]]
    return {
        **raw, "structure": {**structure, "masses": masses, "springs": springs}, "contacts": contacts,
        "observe": {**raw["observe"], "band": band},
    }  # fmt: skip


def without_resonance(seed: int) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """A chain whose band has no resonance, for every fifth seed as it was meant, and its frequencies [Hz]."""
    way = list(MISPLACED)[seed % len(MISPLACED)]
    by = np.sqrt(MISPLACED[way][1] / MISPLACED[way][0])
    for again in range(100):
        rng = np.random.default_rng((seed, again))
        raw, free, stuck = chain(rng)
        low, high = (0.8 * free[0], 1.3 * stuck[0])
        if way == "none":
            low, high = sorted(rng.uniform(0.05, 0.3, 2) * free[0])
        raw["observe"]["band"] = [float(low), float(max(high, 1.1 * low))]
        raw = misplaced(raw, way)
        low, high = raw["observe"]["band"]
        # None inside, and none that friction moves through.
        if not np.any((by * free < high) & (by * stuck > low)):
            return raw, by * free, by * stuck
    raise AssertionError(way)


@pytest.mark.few(ONE_OF + 1)  # each default one another slip
@pytest.mark.parametrize("seed", range(RUNS))
def test_a_band_without_a_resonance_is_told(seed: int) -> None:
    raw, free, stuck = without_resonance(seed)
    low, high = raw["observe"]["band"]
    scene = Scene.from_dict(raw)
    at, _ = brute_force(scene)
    branch = solver.sweep(scene, harmonics=5)
    if at not in (low, high):  # friction gives maxima where no linear mode is: they are maxima
        assert branch.peak is not None
        assert branch.peak.interior
        assert not notes(branch)
        return
    (told,) = notes(branch)
    assert told.numbers["at_hz"] == pytest.approx(at)
    for name, found in (("open_hz", free), ("stuck_hz", stuck)):
        outside = found[(found < low) | (found > high)]
        nearest = min(outside, key=lambda each: max(low - each, each - high))
        assert told.numbers[name] == pytest.approx(nearest, rel=1e-6)


@pytest.mark.few(ONE_OF)
@pytest.mark.parametrize("seed", range(RUNS))
def test_a_band_with_its_resonance_is_not_falsely_told(seed: int) -> None:
    rng = np.random.default_rng(1000 + seed)
    raw, free, stuck = chain(rng)
    raw["observe"]["band"] = [float(0.7 * free[0]), float(1.15 * stuck[0])]
    scene = Scene.from_dict(raw)
    at, height = brute_force(scene, 81)
    branch = solver.sweep(scene, harmonics=5)
    low, high = scene.observe.band
    if at in (low, high):  # a higher mode rises beyond the band, higher than what friction leaves of this one
        assert height >= max((peak.value for peak in branch.interior_peaks), default=0.0)
        return
    assert branch.notes == ()


def test_a_design_without_a_resonance_is_not_certain() -> None:
    scene = Scene.from_dict(blade((20.0, 60.0)))
    found = optim.design(scene, variables={"snubber.N0": (1.0, 1000.0)}, harmonics=3)
    assert found.certainty is Certainty.BAND_END
    told = found.to_json()
    assert [note["name"] for note in told["notes"]] == [BAND_END, "far_from_band"]
    (warned,) = [words for words in found.warnings if "end of the band" in words]
    text = [value for block in found.blocks() for _, value in block.pairs]
    assert text.count(warned) == 1
    assert "466.8 Hz with all contacts open or 583.9 Hz with all contacts stuck" in warned
    closed = optim.design(
        Scene.from_dict(blade((300.0, 900.0))), variables={"snubber.N0": (1.0, 1000.0)}, harmonics=3
    )
    assert closed.certainty is Certainty.CLOSED
    assert closed.to_json()["notes"] == []


def test_one_case_of_two_at_an_end_leaves_the_other() -> None:
    scene = Scene.from_dict(blade((300.0, 900.0)))
    found = optim.design(
        scene, variables={"snubber.N0": (1.0, 1000.0)}, harmonics=1,
        cases=[{"name": "far", "band": [20.0, 60.0]}, {"name": "near"}],
    )  # fmt: skip
    assert found.certainty is not Certainty.BAND_END
    told, far = found.known.notes
    assert (told.name, far.name) == (BAND_END, "far_from_band")
    assert far.words.startswith("in some of the responses the natural")
    assert told.words.startswith("in some of the responses the highest amplitude is at an end")


STUDIES = {
    "peaks": lambda s: solver.track_peak(s, "snubber.N0", 1.0, 30.0, harmonics=1),
    "least": lambda s: solver.least_peak(s, "snubber.N0", 1.0, 30.0, harmonics=1),
    "map": lambda s: solver.response_map(
        s, "snubber.N0", 1.0, 30.0, steps=3, frequencies=8, harmonics=1, ridge=False
    ),
    "margin": lambda s: solver.margin_diagram(s, start=1.0, stop=4.0, points=2, limit=1.0, harmonics=1),
    "campbell": lambda s: optim.campbell_diagram(s, speeds_rpm=(1500.0, 3000.0), harmonics=1),
    "sensitivities": lambda s: optim.sensitivities(s, harmonics=1),
    "robust": lambda s: optim.robust_design(
        s, variables={"snubber.N0": (1.0, 30.0)}, uncertain={"snubber.mu": [0.2, 0.3]}, harmonics=1
    ),
    "pareto": lambda s: optim.pareto_front(
        s, variables={"snubber.N0": (1.0, 30.0)}, limit=1e-6, points=3, harmonics=1
    ),
}


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_that_names_a_peak_tells(name: str) -> None:
    found = STUDIES[name](Scene.from_dict(blade((20.0, 60.0))))
    told = found.to_json()["notes"]
    assert [note["name"] for note in told].count(BAND_END) == 1
    words = next(note["words"] for note in told if note["name"] == BAND_END)
    said = [value for block in found.blocks() for _, value in block.pairs]
    assert said.count(words) == 1
    if name != "map":  # of eight frequencies none need be near the resonance
        assert STUDIES[name](Scene.from_dict(blade((300.0, 900.0)))).known.notes == ()


def test_other_parameters_have_no_band() -> None:
    branch = solver.sweep(
        Scene.from_dict(blade((300.0, 900.0))),
        "excitation.amplitude",
        1.0,
        4.0,
        frequency_hz=500.0,
        harmonics=3,
    )
    assert branch.peak is not None
    assert not branch.peak.interior
    assert branch.notes == ()
