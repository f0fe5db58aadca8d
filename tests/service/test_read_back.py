"""A result that is read back from its JSON is the result, as far as JSON has it."""

import json
import pickle
from collections.abc import Mapping
from enum import Enum
from typing import Any

import pytest
from service_helpers import Shipped

import optim
import solver
from service.errors import InvalidRequestError
from service.jobs.kinds import SHIPPED, studies
from service.jobs.strict_json import validated
from service.jobs.study import Watch
from solver.results.told import Told, json_keys, json_value

FORCE = "excitation.amplitude"
OF_DISKS = ("interference", "mistuning", "worst-mistuning")
IN_TIME = ("march", "transient")


def asked(kind: str, name: str) -> dict[str, Any]:
    """A small question of a study to a scene."""
    scene = solver.load_scene(name)
    low, high = scene.observe.band
    middle, force = 0.5 * (low + high), scene.excitation[0].amplitude
    near = {"from": 0.98 * middle, "to": 1.02 * middle}
    ends = [0.5 * force, 1.5 * force]
    over = {"parameter": FORCE, "from": 0.99 * force, "to": 1.01 * force}
    rough = {} if kind in ("accuracy", "interference", "march", "transient") else {"harmonics": 1}
    at = [low, middle, high]
    own: dict[str, dict[str, Any]] = {
        "solve": {"frequency_hz": middle}, "sweep": near, "peaks": {**over, "checks": 1},
        "map": {**over, "steps": 2, "frequencies": 2, "ridge": name == "two-dof"},
        "design": {"variables": {FORCE: ends}}, "pareto": {"variables": {FORCE: ends}, "points": 3},
        "march": {"frequency_hz": middle, "max_periods": 3},
        "wear": {
            "hours": 1e-6, "coefficient": {scene.contacts[0].name: 1e-14}, "frequency_hz": middle,
            "area": {scene.contacts[0].name: 1e-4}, "points": 3,
            "load_loss_per_depth": {scene.contacts[0].name: 1e6},
        },
        "quasi-periodic": {
            "frequency_hz": middle, "second_hz": 1.37 * middle, "amplitude": force, "turns": 12,
            "tolerance": 0.1, "dof": scene.dofs[0],
        },
        "transient": {"begin_hz": low, "end_hz": middle, "ramp_seconds": 10.0 / middle, "from_rest": True},
        "margin": {"from": ends[0], "to": ends[1], "points": 2, "limit": 1e-4},
        "controlled": {"amplitude": 1e-5, **near},
        "accuracy": {"frequency_hz": middle, "harmonics": [1, 2], "samples": [16], "repeats": 1},
        "campbell": {"speeds_rpm": [[60 * middle, 61 * middle]]}, "interference": {"speed_rpm": 3000},
        "worst-mistuning": {"of": [scene.observe.dof], "starts": 1, "climbs": 1, "climb": 1, **near},
        "mistuning": {"of": [scene.observe.dof], "samples": 1, **near}, "modes": {"from": 1e-5, "to": 2e-5},
        "posterior": {
            "data": [{
                "frequency": at, "amplitude": [_height(scene, one) for one in at],
                "sd": [1e-3 * _height(scene, one) for one in at],
            }],
            "unknowns": {FORCE: ends}, "starts": 1, "draws": 100, "sampler": "importance",
        },
        "identify": {
            "data": [{"frequency": at, "amplitude": [_height(scene, one) for one in at]}],
            "unknowns": {FORCE: ends}, "starts": 1,
        },
    }  # fmt: skip
    body: Any = scene.to_dict()
    if kind.endswith("mistuning") and scene.structure.kind == "cyclic":
        body["structure"]["sectors"] = 3
    return {"scene": body, **own.get(kind, {}), **rough}


def _height(scene: solver.Scene, frequency_hz: float) -> float:
    return solver.solve(scene, frequency_hz=frequency_hz, harmonics=1).max_abs


def compared(read: Told, found: Told, written: Mapping[str, Any]) -> int:
    """How many attributes were compared: those by which a result and its parts write their JSON."""
    count = 0
    for key, path in json_keys(type(found)).items():
        if written.get(key) is None or not hasattr(type(found), path):
            continue
        one, other = getattr(read, path), getattr(found, path)
        assert json_value(one) == written[key]
        if isinstance(other, str | int | float | Enum):
            assert one == other, path
            count += 1
        for of, part, text in zip(*map(_parts, (one, other, written[key])), strict=False):
            if isinstance(part, Told) and isinstance(of, Told):
                count += compared(of, part, text)
    return count


def _parts(value: Any) -> list[Any]:
    if isinstance(value, tuple | list):
        return [one for one in value if isinstance(one, Told | dict)]
    return [value] if isinstance(value, Told | dict) else []


@pytest.mark.few(keep=("two-dof",))
@pytest.mark.parametrize("kind", studies())
@pytest.mark.parametrize("name", solver.shipped_scenes())
def test_a_result_read_back_is_the_result(kind: str, name: str) -> None:
    if name == "fe-disk" and kind in IN_TIME:
        pytest.skip("24 sectors of a finite-element disk are marched for minutes")
    study = studies()[kind]
    try:
        resolved = SHIPPED[kind].resolve(validated(study, asked(kind, name)), Shipped())
    except InvalidRequestError:
        assert kind in OF_DISKS
        structure = solver.load_scene(name).structure
        # A sector of matrices has parts to be mistuned if it was reduced with them.
        untold = structure.kind == "matrices" and structure.parts is None
        assert structure.sector_count == 1 or (kind.endswith("mistuning") and untold)
        return
    found = study.compute(*study.asked(resolved.spec), Watch())
    written = json.loads(json.dumps(found.json))
    read = study.result_class(written).from_json(written)
    assert read.to_json() == written
    assert pickle.loads(pickle.dumps(read)).to_json() == written
    assert repr(read).startswith(f"<{type(read).__name__}")
    if isinstance(found.result, study.result_class(written)):
        assert compared(read, found.result, written) >= 4


def test_what_json_does_not_hold_is_told() -> None:
    branch = solver.sweep(solver.load_scene("two-dof"), harmonics=1)
    read = solver.Branch.from_json(branch.to_json())
    assert isinstance(read, solver.Branch)
    assert read.error_estimate == branch.error_estimate
    assert read.peak is not None
    assert read.peak.at == branch.interior_peaks[0].at
    assert read.status is branch.status
    with pytest.raises(AttributeError, match="'solutions' of Branch is not in the JSON"):
        _ = read.solutions
    with pytest.raises(ValueError, match="is no JSON of DesignResult: it lacks method, optimum"):
        optim.DesignResult.from_json(branch.to_json())
