"""The worst mistuning with forces left in contacts: differences, the march, brute force over a grid."""

import itertools
import math

import numpy as np
import pytest
from mistuned_cases import disk

import solver
from solver import ResidualPeak, Scene, SettingError, WorstSearch, mistuned, worst_mistuning
from solver.jit import fourier
from solver.marching.march import MarchStart
from solver.response.contact_response import LeftForces
from solver.studies.instant import start_of
from stickslip.lab.worst_mistuning.climbing import Bounds
from stickslip.lab.worst_mistuning.residual_peaks import ResidualSearch, _Place
from stickslip.lab.worst_mistuning.solved_disk import SolvedDisk

TIGHT = {"shroud.N0": 300.0, "platform.N0": 200.0}
BAND = (1.0, 6.0)


def search(scene: Scene, harmonics: int = 3) -> ResidualSearch:
    disk = SolvedDisk(scene, ("root", "blade_mass"), "blade", BAND, harmonics, None)
    return ResidualSearch(disk, lambda: True)


@pytest.mark.parametrize("law", ["coulomb", "elastic-normal"])
def test_amplitude_and_rooms_have_the_slopes_of_differences(law: str) -> None:
    raw = disk(sectors=2).to_dict()
    if law != "coulomb":  # the load of the platform moves with the blade
        raw["contacts"][1] |= {"law": law, "kn": 80.0, "normal_between": ["hub", "blade"]}
    scene = Scene.from_dict(raw).with_values(TIGHT)
    looked, delta = search(scene), np.array([0.01, -0.02])
    stuck, u = looked._natural(_Place(delta, np.zeros(0), 3.0))
    assert len(stuck) >= 2
    begin = np.concatenate([delta, np.linspace(-10.0, 12.0, len(stuck)), [3.0]])
    steps = np.concatenate([[1e-4, 1e-4], np.full(len(stuck), 0.1), [1e-4]])

    def judged(y: np.ndarray) -> np.ndarray:
        here = looked._judged(_Place(y[:2], y[2:-1], y[-1]), 1, stuck, u)
        return np.concatenate([[here.value], here.rooms])

    here = looked._judged(_Place(delta, begin[2:-1], 3.0), 1, stuck, u)
    slopes = np.vstack([here.slope, here.room_slopes])
    for i, step in enumerate(steps):
        unit = step * np.eye(begin.size)[i]
        ahead, behind = (
            judged(begin + unit) - judged(begin - unit),
            judged(begin + 2 * unit) - judged(begin - 2 * unit),
        )
        central = (8.0 * ahead - behind) / (12.0 * step)
        np.testing.assert_allclose(slopes[:, i], central, rtol=1e-6, atol=1e-7 * abs(slopes[:, i]).max())


def marched(scene: Scene, found: ResidualPeak, harmonics: int) -> float:
    """max|x| of the march of the true disk from the motion found, with the forces in its contacts."""
    annulus = mistuned(scene, of=["root", "blade_mass"], values=found.factors)
    annulus = annulus.model_copy(
        update={"observe": annulus.observe.model_copy(update={"dof": f"blade@{found.blade}"})}
    )
    names = [contact.name for contact in annulus.contacts]
    held = LeftForces.of(annulus, [names.index(name) for name in found.contacts])
    forces = np.array(found.tractions)
    response = solver.solve(held.on(annulus, forces), frequency_hz=found.at_hz, harmonics=harmonics)
    start = start_of(response)
    tractions = dict(start.tractions)
    for name, force in zip(found.contacts, found.tractions, strict=True):
        tractions[name] += force
    begin = MarchStart(displacements=start.displacements, velocities=start.velocities, tractions=tractions)
    return solver.march(annulus, frequency_hz=found.at_hz, start=begin).max_abs


def test_the_march_holds_what_was_found() -> None:
    scene = disk(sectors=2).with_values(TIGHT)
    found = search(scene).worst([(np.zeros(2), 3.3)], Bounds(middle=np.zeros(2), within=0.03), 1.0)
    assert found is not None
    assert found.peak > found.without
    assert np.abs(np.array(found.factors) - 1.0).max() <= 0.03 + 1e-12
    assert marched(scene, found, 3) == pytest.approx(found.peak, rel=1e-5)


def largest(solution: solver.Solution) -> float:
    """max|x| over the means that a response may have, from its motion in time."""
    tau = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False)
    x = fourier.basis(tau, (solution.observed.size - 1) // 2) @ solution.observed - solution.mean
    low, high = solution.mean_range
    return max(float(x.max()) + high, -(float(x.min()) + low))


@pytest.mark.long
@pytest.mark.parametrize(("loads", "seed"), [(TIGHT, 1), ({"shroud.N0": 60.0, "platform.N0": 120.0}, 2)])
def test_nothing_of_a_grid_is_larger(loads: dict[str, float], seed: int) -> None:
    scene = disk(sectors=3).with_values(loads)
    found = worst_mistuning(
        scene, of=["root", "blade_mass"], within=0.03, contacts="residual",
        search=WorstSearch(starts=12, climbs=4, climb=10, seed=seed), harmonics=3,
    )  # fmt: skip
    peak = found.residual
    assert found.worst is not None
    assert peak is not None
    assert peak.magnification == pytest.approx(peak.peak / found.tuned_peak)
    # Contacts that slip move by more than three harmonics in the march.
    assert marched(scene, peak, 3) == pytest.approx(peak.peak, rel=3e-3)
    rng = np.random.default_rng(seed)
    drawn = rng.uniform(0.97, 1.03, (30, 3))
    grid = [np.array(one) for one in itertools.product((0.97, 1.0, 1.03), repeat=3)]
    at = np.concatenate([np.linspace(*BAND, 11), peak.at_hz * np.array([0.97, 0.99, 1.0, 1.01, 1.03])])
    # A pattern turned round the disk is the same disk: one blade is enough.
    tops = [
        largest(
            solver.solve(
                mistuned(scene, of=["root", "blade_mass"], values=one), frequency_hz=float(hz), harmonics=3
            )
        )
        for one in (*grid, *drawn)
        for hz in at
    ]
    assert max(tops) <= peak.peak * (1.0 + 1e-6)
    assert max(tops) >= 0.9 * peak.peak


def test_what_has_no_factors_to_choose_is_refused() -> None:
    with pytest.raises(SettingError, match="contacts"):
        worst_mistuning(disk(sectors=2), of="root", contacts="loose")
