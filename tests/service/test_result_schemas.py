"""Every kind says what its result is: what it computes has these keys and no others."""

import json
from collections.abc import Mapping
from typing import Any

from each import each
from service_helpers import Shipped

import solver
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import Silent
from service.jobs.strict_json import validated

TWO = {"scene": "two-dof", "harmonics": 3}
DISK = solver.load_scene("bladed-disk").to_dict()
SMALL_DISK = {**DISK, "structure": {**DISK["structure"], "sectors": 3}}
OVER = {**TWO, "parameter": "damper.N0", "from": 60, "to": 90}
MARCH = {"scene": "two-dof", "frequency_hz": 1.2}
LINEAR = {
    "name": "rig",
    "structure": {
        "kind": "lumped",
        "masses": {"m": 1.0},
        "springs": [{"between": ["m", "ground"], "k": 41.0, "c": 0.5, "name": "spring"}],
    },
    "excitation": {"dof": "m", "amplitude": 2.0},
    "observe": {"dof": "m", "band": [0.8, 1.3]},
}
MEASURED: dict[str, Any] = {
    "scene": LINEAR,
    "harmonics": 1,
    "data": [{"frequency": [0.9, 1.0, 1.1], "amplitude": [0.22, 0.56, 0.27], "sd": [0.02, 0.02, 0.02]}],
    "unknowns": {"excitation.amplitude": [1.0, 3.0]},
    "starts": 1,
}
DRAWN = {**MEASURED, "draws": 100, "sampler": "importance"}
BODIES: dict[str, tuple[str, Mapping[str, Any]]] = {
    "solve": ("solve", {**TWO, "frequency_hz": 1.2}),
    "solve for all": ("solve", {**TWO, "frequency_hz": 1.2, "all": True, "starts": 2}),
    "sweep": ("sweep", TWO),
    "sweep with branches": ("sweep", {**TWO, "from": 1.0, "to": 1.02, "stability": True, "branches": True}),
    "map": ("map", {**OVER, "steps": 3, "frequencies": 5}),
    "map without a ridge": ("map", {**OVER, "steps": 3, "frequencies": 5, "ridge": False}),
    "peaks": ("peaks", {**OVER, "checks": 1}),
    "campbell": ("campbell", {**TWO, "speeds_rpm": [[60, 100]]}),
    "interference": ("interference", {"scene": "bladed-disk", "speed_rpm": 11000}),
    "worst-mistuning": (
        "worst-mistuning",
        {"scene": "bladed-disk", "of": ["tip"], "contacts": "stuck", "patterns": ["AB"], "starts": 2},
    ),
    "mistuning": (
        "mistuning",
        {"scene": SMALL_DISK, "of": "tip", "samples": 2, "harmonics": 1, "from": 740, "to": 780},
    ),
    "margin": ("margin", {**TWO, "from": 20, "to": 120, "points": 3, "limit": 2.0}),
    "controlled": ("controlled", {**TWO, "amplitude": 1.0}),
    "sensitivities": ("sensitivities", TWO),
    "plan": ("plan", TWO),
    "phase-resonance": ("modes", {**TWO, "from": 0.3, "to": 1.0, "phase_resonance": True}),
    "modes": ("modes", {**TWO, "from": 0.1, "to": 3.0}),
    "modes with motions": ("modes", {**TWO, "from": 0.1, "to": 3.0, "motions": True}),
    "design": ("design", TWO),
    "a design that misses its goal": ("design", {**TWO, "limit": 1.0, "max_band_hz": 1e-6}),
    "robust design": ("design", {**TWO, "uncertain": {"damper.mu": [0.28, 0.32]}, "samples": 3}),
    "pareto": ("pareto", {**TWO, "points": 3, "limit": 2.0}),
    "accuracy": (
        "accuracy",
        {"scene": "two-dof", "frequency_hz": 1.2, "harmonics": [1, 3], "samples": [16], "repeats": 1},
    ),
    "identify": ("identify", MEASURED),
    "posterior": ("posterior", DRAWN),
    "posteriors of models": (
        "posterior",
        {**DRAWN, "models": {"softer": {"scene": LINEAR, "unknowns": {"structure.spring": [38, 43]}}}},
    ),
    "posterior of assemblies": (
        "posterior",
        {**DRAWN, "data": 3 * MEASURED["data"], "varied": ["excitation.amplitude"], "assemblies": [0, 1, 2]},
    ),
    "march": ("march", {**MARCH, "history": True}),
    "wear": (
        "wear",
        {
            "scene": "two-dof",
            "hours": 1e-4,
            "coefficient": {"damper": 1e-11},
            "area": {"damper": 2e-4},
            "load_loss_per_depth": {"damper": 4e6},
            "limit": 2.4,
            "paths": ["damper.N0"],
            "harmonics": 3,
        },
    ),
    "quasi-periodic": (
        "quasi-periodic",
        {
            "scene": "two-dof",
            "frequency_hz": 1.05,
            "second_hz": 1.3821,
            "amplitude": 60,
            "harmonics": 3,
            "turns": 24,
        },
    ),
    "a curve over two frequencies": (
        "quasi-periodic",
        {
            "scene": "two-dof",
            "frequency_hz": 1.04,
            "to_hz": 1.06,
            "points": 2,
            "second_hz": 1.3821,
            "amplitude": 60,
            "harmonics": 3,
            "turns": 24,
        },
    ),
    "transient": ("transient", {"scene": "two-dof", "begin_hz": 0.9, "end_hz": 1.2, "ramp_seconds": 20.0}),
    "a march that does not settle": ("march", {**MARCH, "max_periods": 1}),
}
ON_THE_WAY = {"accuracy", "design", "map", "pareto", "peaks"}
"""Kinds whose sweeps are steps on the way to another result."""
SOMETIMES = {
    "certificate",
    "certificates",
    "chosen",
    "drift_per_period",
    "mean_range",
    "history",
    "solutions",
    "complete",
    "missing_by_signs",
    "starts",
    "stopped",
    "note",
    "branches",
    "performance",
    "limit_cycles",
    "motions",
}


@each("case", BODIES)
def test_a_result_is_what_its_schema_says(case: str) -> None:
    name, body = BODIES[case]
    kind = SHIPPED[name]
    assert kind.answers is not None
    spec = kind.resolve(validated(kind.request, body), Shipped()).spec
    output = kind.run(spec, Silent(), lambda: False)
    assert {sweep.intermediate for sweep in output.sweeps} <= {name in ON_THE_WAY}
    result = json.loads(json.dumps(output.result))
    checked = kind.answers.model_validate(result)
    told = getattr(checked, "root", checked)
    assert set(result) - set(type(told).model_fields) == set(), "keys without a schema"
    assert set(type(told).model_fields) - set(result) <= SOMETIMES, "keys that are not there"


def test_every_kind_is_among_them() -> None:
    assert {name for name, _ in BODIES.values()} == {kind.name for kind in SHIPPED}
