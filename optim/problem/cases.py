"""Load cases: the responses a design is judged by. Bands, engine orders, excitation levels, observed DOFs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from optim.errors import DesignError
from solver.scene.scene import Observe, Scene

_KEYS = ("name", "set", "band", "observe", "engine_order", "order", "weight")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One frequency response a design is judged by: one DOF, one band, one excitation.

    Attributes
    ----------
    name : str
        How results call it.
    scene : Scene
        With the case's own values; the design's values are set on top.
    weight : float
        By which its peaks count in what is minimised.
    order : int
        How many times a revolution the excitation repeats; turns speeds into frequencies.
    beside : str or None
        An earlier case that differs in the observed DOF alone, so that one response serves both.
    """

    name: str
    scene: Scene
    weight: float
    order: int
    beside: str | None = None


def with_engine_order(scene: Scene, engine_order: int) -> Scene:
    """Return a cyclic scene whose every excitation has another engine order.

    Raises
    ------
    SceneError
        The engine order does not fit the structure.
    """
    raw = scene.to_dict()
    raw["excitation"] = [
        {**force.model_dump(mode="json", exclude_none=True), "engine_order": engine_order}
        for force in scene.excitation
    ]
    return Scene.from_dict(raw)


def read_cases(scene: Scene, cases: Sequence[Mapping[str, object]] | None) -> tuple[Case, ...]:
    """Return the load cases of a problem; without any, the scene as it is.

    Parameters
    ----------
    scene : the scene of the problem.
    cases : tables with any of `name`, `set` (parameter path to value), `band` ([low, high] in Hz), `observe`
        (a DOF or a list of them: one response each), `engine_order` (cyclic scenes), `order` (excitations a
        revolution; the engine order if left out, else 1), `weight`.

    Raises
    ------
    DesignError, SettingError, SceneError
        What is wrong, with the case's number.
    """
    if cases is None:
        return (Case(name=scene.name, scene=scene, weight=1.0, order=max(scene.engine_order, 1)),)
    if not isinstance(cases, Sequence) or isinstance(cases, str) or not cases:
        raise DesignError("cases", cases, "must be a list of at least one table")
    read = [case for i, table in enumerate(cases) for case in _read(scene, f"cases[{i}]", i, table)]
    names = [case.name for case in read]
    for name in names:
        if names.count(name) > 1:
            raise DesignError("cases", name, "must have names of their own, this one is there twice")
    return tuple(read)


def _read(scene: Scene, where: str, index: int, table: object) -> list[Case]:
    if not isinstance(table, Mapping):
        raise DesignError(where, table, "must be a table")
    for key in table:
        if key not in _KEYS:
            raise DesignError(f"{where}.{key}", table[key], f"is not known; a case has {', '.join(_KEYS)}")
    name = table.get("name", scene.name if index == 0 else f"case {index + 1}")
    if not isinstance(name, str) or not name:
        raise DesignError(f"{where}.name", name, "must be a text")
    here = _engine_order(scene, where, table.get("engine_order"))
    values = table.get("set", {})
    if not isinstance(values, Mapping):
        raise DesignError(f"{where}.set", values, "must be a table of parameter paths and values")
    here = here.with_values(values)
    band = _band(where, table.get("band"))
    order = _whole(f"{where}.order", table.get("order", max(here.engine_order, 1)), least=1)
    weight = positive(f"{where}.weight", table.get("weight", 1.0))
    observed = table.get("observe", here.observe.dof)
    dofs = [observed] if isinstance(observed, str) else observed
    if not isinstance(dofs, Sequence) or not dofs or not all(isinstance(dof, str) for dof in dofs):
        raise DesignError(f"{where}.observe", observed, "must be the name of a DOF, or a list of them")
    names = [name if len(dofs) == 1 else f"{name}, {dof}" for dof in dofs]
    # A DOF of another sector may call for the whole annulus: it gets a response of its own.
    first = next((i for i, dof in enumerate(dofs) if "@" not in dof), None)
    return [
        Case(
            name=names[i], scene=_observing(here, dof, band), weight=weight, order=order,
            beside=names[first] if first is not None and i > first and "@" not in dof else None,
        )
        for i, dof in enumerate(dofs)
    ]  # fmt: skip


def _engine_order(scene: Scene, where: str, wanted: object) -> Scene:
    if wanted is None:
        return scene
    if scene.structure.kind != "cyclic":
        raise DesignError(f"{where}.engine_order", wanted, "needs a cyclic structure; `order` fits any")
    return with_engine_order(scene, _whole(f"{where}.engine_order", wanted, least=0))


def _observing(scene: Scene, dof: str, band: tuple[float, float] | None) -> Scene:
    """Return the scene with another observed DOF and band."""
    observe = Observe(dof=dof, band=scene.observe.band if band is None else band)
    changed = scene.model_copy(update={"observe": observe})
    # Only another DOF can fail to fit the structure; a large structure is not read again for a band.
    return changed if dof == scene.observe.dof else Scene.from_dict(changed.to_dict())


def _band(where: str, band: object) -> tuple[float, float] | None:
    if band is None:
        return None
    low, high = number_pair(f"{where}.band", band)
    if not 0.0 < low < high:
        raise DesignError(f"{where}.band", band, "must have 0 < low < high [Hz]")
    return low, high


def number_pair(name: str, pair: object) -> tuple[float, float]:
    """Return two finite numbers.

    Raises
    ------
    DesignError
        Anything else.
    """
    if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
        raise DesignError(name, pair, "must be two numbers, low and high")
    for value in pair:
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise DesignError(name, pair, "must be two finite numbers, low and high")
    return float(pair[0]), float(pair[1])


def _whole(name: str, value: object, *, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise DesignError(name, value, f"must be a whole number >= {least}")
    return value


def positive(name: str, value: object) -> float:
    """Return a finite number above 0.

    Raises
    ------
    DesignError
        Anything else.
    """
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value <= 0.0:  # type: ignore[arg-type,operator]
        raise DesignError(name, value, "must be a number > 0")
    return float(value)  # type: ignore[arg-type]
