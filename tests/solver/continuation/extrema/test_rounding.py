"""Estimates near nodes, beside ball arithmetic and exact orbits, and for any origin of time."""

import math
from collections.abc import Sequence
from typing import Any

import flint
import numpy as np
import pytest
from exact_linear import Exact, node_case
from random_scenes import random_scene

from solver import ContinuationSettings, Scene, solve, sweep
from solver.balance.balance import build
from solver.balance.kernels.output import HALF_RANGE
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.branches.observation import observing
from solver.continuation.extrema.error_estimate import truncation_error
from solver.response.contact_response import ContactState, code_of
from solver.response.solution import SolutionStatus

ORIGINS = (0.0, 0.7, 1.9, 3.3)  # rad


def posed(form: str, seed: int) -> tuple[Scene, dict[str, Any], float, Effects]:
    """A case near a node in one form of the linear part; what it is without contacts, and its frequency."""
    raw, hertz = node_case(seed)
    rng, names = np.random.default_rng(seed), list(raw["structure"]["masses"])
    if form == "poles":
        for spring in raw["structure"]["springs"]:
            spring["c"] *= float(rng.uniform(0.0, 2.0))
    told, known = dict(raw), {**raw, "structure": {**raw["structure"]}}
    if form in ("stuck", "free"):
        ends, kt = [str(rng.choice(names)), "ground"], float(10.0 ** rng.uniform(-1.0, 4.0))
        load = 1e12 if form == "stuck" else 0.0
        told["contacts"] = [{"name": "c", "between": ends, "kt": kt, "mu": 0.5, "N0": load}]
        if form == "stuck":
            known["structure"]["springs"] = [*raw["structure"]["springs"], {"between": ends, "k": kt}]
    return Scene.from_dict(told), known, hertz, Effects(whole_matrices=form == "dense")


@pytest.mark.parametrize("form", ["modes", "poles", "dense", "stuck", "free"])
@pytest.mark.parametrize("seeds", [range(20), pytest.param(range(20, 300), marks=pytest.mark.long)])
def test_where_the_observed_mass_hardly_moves_rounding_is_in_the_estimate(form: str, seeds: range) -> None:
    """Down to 1e-20 of the largest motion, with damping ratios from 1e-14 on."""
    covered = []
    for seed in seeds:
        scene, known, hertz, effects = posed(form, seed)
        solution = solve(scene, frequency_hz=hertz, effects=effects)
        error = abs(float(flint.arb(solution.half_peak_to_peak) - Exact(known).amplitude(hertz)))
        covered.append(error <= solution.error_estimate)
    assert np.mean(covered) >= 0.98


def slipping_near_a_node(seed: int) -> tuple[Scene, float, int] | None:
    """A mass that moves least beside the others where a contact slips; none where none does."""
    scene, hertz, harmonics = random_scene(seed)
    if len(scene.dofs) < 2:
        return None
    branch = sweep(
        scene, start=max(0.5 * hertz, 0.05), stop=min(2.0 * hertz, 5.0), harmonics=min(harmonics, 9),
        settings=ContinuationSettings(errors=False, peaks=False),
    )  # fmt: skip
    slips = np.isin(
        branch.states, [code_of(state) for state in (ContactState.SLIPPING, ContactState.LIFTING)]
    )
    seen = [observing(branch, dof, errors=False) for dof in scene.dofs]
    at = branch.values[slips.any(axis=1)]
    if not branch.reached or not at.size:
        return None
    moves = np.array([np.interp(at, one.values, one.measures[:, HALF_RANGE]) for one in seen])
    dof, place = np.unravel_index(np.argmin(moves / moves.max(axis=0)), moves.shape)
    observe = scene.observe.model_copy(update={"dof": scene.dofs[dof]})
    return scene.model_copy(update={"observe": observe}), float(at[place]), min(harmonics, 9)


@pytest.mark.parametrize("seeds", [(33, 66, 5), pytest.param(range(300), marks=pytest.mark.long)])
def test_where_a_contact_slips_and_the_observed_mass_hardly_moves(seeds: Sequence[int]) -> None:
    """Harmonics that are left out may be all that moves it: the exact orbit judges."""
    covered = []
    for case in map(slipping_near_a_node, seeds):
        if case is None:
            continue
        scene, hertz, harmonics = case
        found = solve(scene, frequency_hz=hertz, harmonics=harmonics)
        known = solve(scene, frequency_hz=hertz, harmonics=harmonics, exact=True)
        if known.status is SolutionStatus.CONVERGED:
            error = abs(found.half_peak_to_peak - known.half_peak_to_peak)
            covered.append(error <= found.error_estimate + known.error_estimate)
    assert len(covered) >= 0.3 * len(seeds)
    assert np.mean(covered) >= 0.98


def shifted(scene: Scene, angle: float) -> Scene:
    """The same with its clock started earlier: each harmonic is turned by as many times the angle."""
    raw = scene.to_dict()
    excitation = raw["excitation"]
    for force in excitation if isinstance(excitation, list) else [excitation]:
        force["phase"] = force.get("phase", 0.0) + force.get("harmonic", 1) * angle
    for contact in raw["contacts"]:
        if contact.get("N1") or contact.get("N1_ratio"):
            contact["N1_phase"] = contact.get("N1_phase", 0.0) + angle
    return Scene.from_dict(raw)


@pytest.mark.parametrize("seeds", [range(30), pytest.param(range(30, 300), marks=pytest.mark.long)])
def test_the_estimate_does_not_depend_on_the_origin_of_time(seeds: range) -> None:
    for seed in seeds:
        scene, hertz, harmonics = random_scene(seed)
        told = []
        for origin in ORIGINS:
            workspace = Workspace.of(build(shifted(scene, origin), harmonics=harmonics))
            found = workspace.solve(2.0 * math.pi * hertz)
            assert found.converged
            error = truncation_error(workspace, found.u, 2.0 * math.pi * hertz)
            told.append((error.max_abs, error.half_peak_to_peak))
        estimates = np.array(told)
        assert np.all(np.ptp(estimates, axis=0) <= 0.01 * estimates.min(axis=0)), seed


def test_a_harmonic_of_zero_does_not_change_the_estimate() -> None:
    scene, hertz, harmonics = random_scene(1)
    raw = scene.to_dict()
    contact = raw["contacts"][0]
    load = [contact.pop("N0"), {"order": 1, "amplitude": 0.0}]
    for key in ("N1", "N1_ratio", "N1_phase"):
        contact.pop(key, None)
    found = []
    for more in ([], [{"order": 3, "amplitude": 0.0}], [{"order": 2, "amplitude": 0.0}]):
        contact["load"] = [*load, *more]
        found.append(solve(Scene.from_dict(raw), frequency_hz=hertz, harmonics=harmonics).error_estimate)
    assert np.ptp(found) <= 0.01 * min(found)
