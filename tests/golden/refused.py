"""Bodies and what the service answers, in this process: no server, no workers."""

import asyncio
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import httpx
from fastapi import FastAPI
from service_helpers import settings_of

import solver
from service.errors import InvalidRequestError
from service.http.app import create_app
from service.jobs import answering
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import Silent

LOAD = {"parameter": "damper.N0", "from": 50, "to": 200}
_DISK = {"scene": "bladed-disk"}
_CASE = {"name": "one"}
_UNCERTAIN = {"damper.mu": [0.25, 0.35], "damper.kt": {"deviation": 0.1}}
_TWO = solver.load_scene("two-dof").to_dict()
# For its contacts there are no exact second derivatives: no peak is tracked.
_RING = {**_TWO, "contacts": [{"name": "ring", "law": "dahl", "between": ["m1", "ground"], "sigma": 5.0,
                               "limit": 0.3}]}  # fmt: skip
_MANY = {**_TWO, "contacts": [{**_TWO["contacts"][0], "name": f"c{index}"} for index in range(100)]}
"""More unknowns than a worker has memory for."""
_OF_MANY: dict[str, dict[str, Any]] = {
    "solve": {"frequency_hz": 1}, "sweep": {}, "design": {"variables": {"c0.N0": [1, 2]}},
    "pareto": {"variables": {"c0.N0": [1, 2]}},
}  # fmt: skip
_OF_ALL = ("scene", "set", "fresh", "priority", "max_seconds", "project", "name", "notes", "tags")
_WRONG: tuple[Any, ...] = ("x", -1, [], None)
# Beside a variable, `damper.N0` from 20 to 1000.
_DESIGN: tuple[dict[str, Any], ...] = (
    {"variables": {"damper.N0": [-1, 1], "frequency": [1, 2]}}, {"variables": {"damper.N0": [1]}},
    {"variables": {"damper.N0": [1, "x"]}}, {"variables": {"damper.N0": 5}},
    {"variables": {"damper.N0,,damper.kt": [1, 2]}}, {"variables": {}}, {"variables": ["damper.N0"]},
    {"variables": {"damper.N0": [1, 2], "damper.N0,damper.kt": [1, 2]}},
    {"scaling": {"damper.N0": "cubic"}}, {"scaling": {"damper.kt": "linear"}},
    {"variables": {"damper.N0": [0, 9]}, "scaling": {"damper.N0": "logarithmic"}},
    {"cases": []}, {"cases": [3]}, {"cases": [{"colour": "red"}]}, {"cases": [{"band": [1, "x"]}]},
    {"cases": [_CASE, {"band": [5, 1]}, {"band": [0, 1]}]}, {"cases": [{"name": ""}]},
    {"cases": [_CASE, _CASE]}, {"cases": [{"set": {"bumper.N0": 5, "damper.mu": -1}}]},
    {"cases": [_CASE, {"set": {"damper.mu": -1}}]}, {"cases": [{"observe": []}]},
    {"cases": [_CASE, {"set": {"damper.N0": 50}}]},
    {"variables": {"damper.N1_ratio": [0.1, 0.5]}, "cases": [{"set": {"damper.N1": 5}}]},
    {"uncertain": {"damper.mu": [0.2, 0.4]}, "cases": [{"set": {"damper.mu": 0.3}}]},
    {"cases": [{"engine_order": 2}]}, {"cases": [{"order": 0}]}, {"cases": [{"weight": 0}]},
    {"weights": {"width": 1}}, {"weights": {"peak": -1}}, {"weights": {"peak": 0}}, {"max_peak": 0},
    {"max_band_hz": 0}, {"forbidden_hz": [[1, 2]]}, {"forbidden_hz": [[1, 2], [2, 1]], "limit": 1},
    {"forbidden_hz": [[1, 2, 3]]}, {"forbidden_hz": [1, 2]}, {"speeds_rpm": [[0, 9]], "limit": 1},
    {"speeds_rpm": []}, {"max_friction_work": 0}, {"max_friction_work": "little"},
    {"max_friction_work": {"damper": -1}}, {"max_friction_work": {"bumper": 1}},
    {"contact_states": {"damper": "sticks"}}, {"contact_states": {"bumper": "never-separates"}},
    {"harmonics": 0}, {"start": {"damper.N0": 1}}, {"start": {"damper.N0": 30, "damper.kt": 1}},
    {"start": {}}, {"method": "tracked", "max_peak": 1}, {"basins": 0}, {"basins": 21},
    {
        "variables": {"damper.N9": [1, 2]}, "cases": [{"observe": "m9"}],
        "contact_states": {"x": "never-separates"},
    },
    {"uncertain": {}}, {"uncertain": 5}, {"uncertain": {"damper.mu": 0.3}},
    {"uncertain": {"damper.mu": {"deviation": -1}}}, {"uncertain": {"bumper.mu": [0.1, 0.2]}},
    {"uncertain": {"damper.N0": [50, 60]}}, {"uncertain": {"damper.mu": [-0.1, 0.2]}},
    {"uncertain": [{"damper.mu": 0.3}, {"damper.mu": "much"}]},
    {"uncertain": {"mistuning": {"of": "tip", "spread": 0.01}}}, {"uncertain": {"mistuning": {"of": 5}}},
    {"uncertain": {"half_axes": {"damper.mu": 0}, "relative": True}},
    {"uncertain": _UNCERTAIN, "aim": "best"}, {"uncertain": _UNCERTAIN, "quantile": 1},
    {"uncertain": _UNCERTAIN, "samples": 1},
    {"uncertain": _UNCERTAIN, "seed": -1}, {"uncertain": _UNCERTAIN, "basins": 3},
    {"aim": "mean", "samples": 5}, {"uncertain": {"damper.mu": 1}, "method": "x"},
    {"uncertain": {"damper.mu": 1}, "max_friction_work": {"x": 1}},
)  # fmt: skip
_MODEL: dict[str, Any] = {"scene": "two-dof", "unknowns": {"damper.mu": [0.1, 1]}}
_MEASURED = {"data": [{"frequency": [1, 1.2], "amplitude": [1.9, 1.7]}], "unknowns": _MODEL["unknowns"]}
_MEANT: dict[str, tuple[dict[str, Any], ...]] = {
    "sweep": (
        {"from": 2, "to": 2}, {"from": -1}, {"parameter": "damper.N2"}, {"parameter": "damper.N0"},
        {"frequency_hz": 1}, {**LOAD, "to": 50, "frequency_hz": 1}, {**LOAD, "frequency_hz": 0},
        {"harmonics": 201},
        {"set": {"damper.mu": -1}}, {"set": {"nothing.mu": 1}}, {"scene": "nothing"}, {"scene": 7},
        {"scene": {"name": "x"}}, {"set": {"damper.N0": "1"}}, {"stability": "yes"}, {"priority": 101},
        {"fresh": 1}, {"max_seconds": 0}, {"tags": "x"}, {"project": 1}, {"name": 1}, {"scene": None},
        {"scene": "/etc/passwd"}, {"scene": "../two-dof.toml"}, {"scene": {"a/b": 1}},
        {"parameter": "x" * 300}, {"set": {"damper.mu": -0.1, "nothing.N0": 1, "damper.N0": 2}},
        {"set": [1]}, {"harmonics": 5.5}, {**LOAD, "to": -5, "frequency_hz": 1},
    ),
    "map": (
        {**LOAD, "to": 50}, {**LOAD, "parameter": "frequency"}, {**LOAD, "steps": 1},
        {**LOAD, "steps": 10**6},
        {**LOAD, "frequencies": 1}, {**LOAD, "from": -50}, {**LOAD, "steps": 3000, "frequencies": 3000},
        {}, {**LOAD, "steps": 5.5, "frequencies": "many"}, {**LOAD, "steps": 1000, "frequencies": 501},
        {**_DISK, "parameter": "shroud.N0", "from": 20, "to": -1, "steps": 1000, "frequencies": 500,
         "harmonics": 200, "ridge": False},
        {**LOAD, "scene": _RING},
    ),
    "peaks": (
        {**LOAD, "to": 50}, {**LOAD, "parameter": "frequency"}, {**LOAD, "parameter": "damper.N2"},
        {**LOAD, "from": -50}, {**LOAD, "checks": 201}, {"parameter": "damper.N0"}, {**LOAD, "harmonics": 0},
        {**LOAD, "from": -1, "to": -1}, {**LOAD, "frequency_hz": 1}, {**LOAD, "set": {"damper.N0": -3}},
        {**LOAD, "to": "high"}, {**LOAD, "scene": _RING},
    ),
    "campbell": (
        {}, {"speeds_rpm": [50, 80]}, {"speeds_rpm": [[80, 50]]}, {"speeds_rpm": [[60, 80], [0, 1]]},
        {"speeds_rpm": [[50, 1e12]]}, {"speeds_rpm": [[50, 80]], "orders": [0]},
        {"speeds_rpm": [[50, 80]], "orders": [1.5]}, {"speeds_rpm": [[50, 80]], "band_hz": [2, 1]},
        {"speeds_rpm": [[50, 80]], "band_hz": [0, 1]}, {"speeds_rpm": [[50, 80]], "limit": 0},
        {"speeds_rpm": [[60, 100], [100, 110], [0, 5], [1, 1e12]]}, {"speeds_rpm": [[60, 100], [100, 60]]},
        {"speeds_rpm": [[50, 80]], "orders": [1, 0, 1.5]}, {"speeds_rpm": [[50, 80]], "orders": [1] * 101},
    ),
    "modes": (
        {"from": 2, "to": 1}, {"from": 0, "to": 1}, {"from": 1, "to": 2, "mode": 9},
        {"from": 1, "to": 2, "exact_peaks": 3}, {"from": 1, "to": 2, "disturbance": 1},
        {"from": 1, "to": 2, "mode_alone": True}, {"from": 1, "to": 2, "nodal_diameter": 3},
        {"from": 1, "to": 2, "phase_resonance": True, "performance": True}, {"to": 2},
        {**_DISK, "from": 1e-5, "to": 1e-4, "nodal_diameter": 5},
    ),
    "quasi-periodic": (
        {}, {"frequency_hz": 1, "second_hz": 1, "amplitude": 1},
        {"frequency_hz": 1, "second_hz": 2, "amplitude": 1, "dof": "x"},
        {"frequency_hz": 1, "second_hz": 2, "amplitude": 1, "engine_order": 2},
        {"frequency_hz": 1, "second_hz": 2, "amplitude": 1, "turns": 900},
    ),
    "margin": (
        {}, {"from": 2, "to": 1}, {"from": 0, "to": 1}, {"from": 1, "to": 2, "points": 1},
        {"from": 1, "to": 2, "dampers": {}}, {"from": 1, "to": 2, "dampers": {"x": {"damper.N9": 1}}},
    ),
    "controlled": ({"amplitude": 0}, {"amplitude": 1, "from": 3}, {"amplitude": 1, "dof": "x"}, {}),
    "interference": ({}, {**_DISK, "orders": [0]}, {**_DISK, "within": 2}, {**_DISK, "orders": [1]}),
    "solve": (
        {"frequency_hz": 0}, {"frequency_hz": 1e12}, {"frequency_hz": 1, "max_seconds": 3601}, {},
        {"frequency_hz": 1, "starts": -1}, {"frequency_hz": 1, "seed": -1},
    ),
    "march": (
        {"frequency_hz": 1, "steps_per_period": 10**9}, {"frequency_hz": 1, "max_periods": 0},
        {"frequency_hz": 1, "harmonics": 3}, {"frequency_hz": 1, "tolerance": 1.0},
        {"frequency_hz": 1, "steps_per_period": 100_000, "max_periods": 1_000_000},
    ),
    "accuracy": (
        {"samples": [5]}, {"harmonics": []}, {"repeats": 1000, "samples": [65536] * 9},
        {"frequency_hz": 1, "harmonics": [3, 0]}, {"frequency_hz": 1, "samples": [64, 66]},
        {"frequency_hz": 1, "from": 1}, {"frequency_hz": 1, "repeats": 1000, "samples": [65536]},
    ),
    "mistuning": (
        {"of": "m1"}, {**_DISK, "of": ["nothing"]}, {**_DISK, "of": "tip", "from": 3, "to": 2},
        {**_DISK, "of": "tip", "dof": "nothing"}, {**_DISK, "of": "tip", "samples": 10001}, _DISK,
        {**_DISK, "of": ["tip", 5]}, {**_DISK, "of": ["tip", "nothing", "nobody"]}, {**_DISK, "of": "../tip"},
        {**_DISK, "of": "tip", "spread": 0.9}, {**_DISK, "of": "tip", "dof": "tip@1"},
        {**_DISK, "of": "tip", "samples": 10_000, "harmonics": 200}, {**_DISK, "of": "tip", "values": [1.0]},
    ),
    "worst-mistuning": (
        {"of": "m1"}, {**_DISK, "of": ["nothing"]}, {**_DISK, "of": "tip", "from": 3, "to": 2},
        {**_DISK, "of": "tip", "within": 0}, {**_DISK, "of": "tip", "patterns": ["ab"]},
        {**_DISK, "of": "tip", "patterns": ["AB"], "detuning": 0.9}, {**_DISK, "of": "tip", "rms": -1},
        {**_DISK, "of": "tip", "patterns": ["ABABABABABAB"]}, {**_DISK, "of": "tip", "contacts": "x"},
    ),
    "design": (
        {"variables": {"damper.N0": [2, 1]}}, {"variables": {"nothing.N0": [1, 2]}}, {"max_band_hz": -1},
        {"weights": {"peak": 1, "x": 2}}, {"uncertain": {"damper.mu": [0.4, 0.2]}}, {"aim": "x"},
        {"samples": 4},
        {"start": {"damper.N0": 1e9}}, {"cases": [{"observe": "x"}]}, {"method": "x"}, {"limit": 0},
    ),
    "pareto": ({"points": 2}, {"weights": {"peak": 1}}, {"variables": {"damper.N0": [1, 1]}}),
    "identify": (
        {"data": [{"frequency": [1], "amplitude": [1, 2]}], "unknowns": {"damper.mu": [0.1, 0.6]}},
        {"data": [], "unknowns": {}}, {"data": ["a.csv"], "unknowns": {"damper.mu": [0.1, 0.6]}},
    ),
    "posterior": (
        {"data": [], "unknowns": {}},
        *({**_MEASURED, **one} for one in (
            {"draws": 3}, {"sampler": "gibbs"}, {"weights": {"two-dof": 1}}, {"assemblies": [0]},
            {"varied": ["damper.mu"], "assemblies": [0, 1]}, {"models": {"two-dof": _MODEL}},
            {"models": {"x": {**_MODEL, "scene": "nowhere"}}}, {"models": {"x": 3}},
            {"models": {"x": {**_MODEL, "unknowns": {"damper.nu": [0.1, 1]}}}},
        )),
    ),
    "nothing": ({},),
}  # fmt: skip


class Body(NamedTuple):
    """What is sent: the example of a kind, or a scene alone, with something changed."""

    kind: str
    change: dict[str, Any]
    beside: dict[str, Any]

    @property
    def whole(self) -> dict[str, Any]:
        return {"kind": self.kind, **self.beside, **self.change}


def bodies() -> Iterator[Body]:
    """What is meant to be refused, and every key of every kind with what it hardly takes."""
    for kind, changes in _MEANT.items():
        yield from (Body(kind, change, {"scene": "two-dof"}) for change in changes)
    for kind, change in _OF_MANY.items():
        yield Body(kind, {**change, "harmonics": 61}, {"scene": _MANY})
    one_variable = {"scene": "two-dof", "variables": {"damper.N0": [20, 1000]}}
    yield from (Body("design", change, one_variable) for change in _DESIGN)
    for one in SHIPPED:
        schema = one.request.model_json_schema()
        example = schema["examples"][0]
        yield Body(one.name, {"colour": 1}, example)
        for key in schema["properties"]:
            if key not in _OF_ALL:
                yield from (Body(one.name, {key: wrong}, example) for wrong in _WRONG)


def application(folder: Path) -> FastAPI:
    """The service, not started: what is asked of its processes is done at once, here."""
    app = create_app(settings_of(f"sqlite:///{folder}/jobs.db")(), SHIPPED)
    service = app.state.service
    tasks = answering.runs(service.registry, service.previews.registry)

    async def ask(task: str, spec: dict[str, Any], _owner: str = "", _about: str = "") -> Any:
        told = tasks[task](spec, Silent(), lambda: False, None).result  # type: ignore[arg-type]
        if "issues" in told:
            raise InvalidRequestError.from_json(told["issues"])
        return told

    service.answers.ask = ask
    service.open()
    return app


def refusals(folder: Path, asked: Sequence[Body]) -> dict[str, str]:
    """Status, pointers and words for every body, by the kind."""
    app = application(folder)

    async def answers() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return [await client.post("/v1/jobs", json=body.whole) for body in asked]

    found: dict[str, list[str]] = {}
    try:
        for body, answer in zip(asked, asyncio.run(answers()), strict=True):
            errors = answer.json()["errors"] if answer.status_code == 422 else []
            told = "; ".join(f"{one.get('pointer', one.get('parameter'))} {one['detail']}" for one in errors)
            line = f"{json.dumps(body.change, ensure_ascii=False)}: {answer.status_code} {told}".rstrip()
            found.setdefault(body.kind, []).append(line)
    finally:
        app.state.service.database.close()
    return {kind: "\n".join(lines) for kind, lines in found.items()}
