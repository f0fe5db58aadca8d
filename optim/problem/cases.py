"""Load cases: the responses a design is judged by. Bands, engine orders, excitation levels, observed DOFs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Annotated

from optim.problem.checks import DesignError, positive, range_above_zero, whole
from optim.problem.variables import BoundedVariable
from solver.errors import Place, SettingError, at
from solver.scene.scene import Scene

SAME = 1e-9  # relative, of a parameter that stays


@dataclass(frozen=True, kw_only=True, eq=False)
class Case(Mapping[str, object]):
    """One load case of a design problem; what is left out is the scene's own.

    It is the table that ``cases`` takes, so both can stand in one list.

    Attributes
    ----------
    name : str or None
        How results call it.
    set : mapping or None
        Values of this case alone, parameter path to value; no variable.
    band : (low, high) or None
        Frequencies [Hz].
    observe : str or list of str or None
        DOF whose amplitude counts, or several.
    engine_order : int or None
        Of every excitation; cyclic scenes only.
    order : int or None
        Excitations a revolution; the engine order, else 1.
    weight : float or None
        By which its peaks count in what is minimised; 1.
    """

    name: str | None = None
    set: Mapping[str, float] | None = None
    band: tuple[float, float] | None = None
    observe: str | Sequence[str] | None = None
    engine_order: int | None = None
    order: int | None = None
    weight: float | None = None

    def __getitem__(self, key: str) -> object:
        value = getattr(self, key) if key in _KEYS else None
        if value is None:
            raise KeyError(key)
        return value

    def __iter__(self) -> Iterator[str]:
        return iter([name for name in _KEYS if getattr(self, name) is not None])

    def __len__(self) -> int:
        return len(list(iter(self)))


_KEYS = tuple(one.name for one in fields(Case))


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCase:
    """One frequency response a design is judged by: one DOF, one band, one excitation."""

    name: Annotated[str, "How results call it."]
    scene: Annotated[Scene, "With the case's own values; the design's values are set on top."]
    weight: Annotated[float, "By which its peaks count in what is minimised."]
    order: Annotated[
        int, "How many times a revolution the excitation repeats; turns speeds into frequencies."
    ]
    own: Annotated[Mapping[str, float], "Parameter paths it sets, which nothing else may."] = field(
        default_factory=dict, compare=False, repr=False
    )
    served_by: Annotated[
        str | None,
        "An earlier case that differs in the observed DOF alone, so that one response serves both.",
    ] = None


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


def read_cases(
    scene: Scene, cases: Sequence[Mapping[str, object]] | None, variables: Sequence[BoundedVariable] = ()
) -> tuple[LoadCase, ...]:
    """Return the load cases of a problem; without any, the scene as it is.

    Parameters
    ----------
    scene : the scene of the problem.
    cases : tables with any of `name`, `set` (parameter path to value), `band` ([low, high] in Hz), `observe`
        (a DOF or a list of them: one response each), `engine_order` (cyclic scenes), `order` (excitations a
        revolution; the engine order if left out, else 1), `weight`.
    variables : what may be chosen: no case may set it, or what it changes.

    Raises
    ------
    DesignError, SettingError, SceneError
        What is wrong, with the case's number.
    """
    if cases is None:
        return (LoadCase(name=scene.name, scene=scene, weight=1.0, order=max(scene.engine_order, 1)),)
    if not isinstance(cases, Sequence) or isinstance(cases, str) or not cases:
        raise DesignError("cases", cases, "must be a list of at least one table")
    read = [case for i, table in enumerate(cases) for case in read_case(scene, i, table, variables)]
    check_names(read)
    return tuple(replace(case, served_by=_served_by(case, read[:i])) for i, case in enumerate(read))


def _served_by(case: LoadCase, earlier: Sequence[LoadCase]) -> str | None:
    """Return the name of the first case whose response serves another one; None if there is none.

    A DOF of another sector may call for the whole annulus: it gets a response of its own.
    """
    here = case.scene.observe
    for one in earlier:
        seen = one.scene.observe.model_copy(update={"dof": here.dof})
        same = one.order == case.order and seen == here and "@" not in here.dof + one.scene.observe.dof
        if same and one.scene.model_copy(update={"observe": here}) == case.scene:
            return one.name
    return None


def check_names(cases: Sequence[LoadCase]) -> None:
    """Raise DesignError if two cases have one name."""
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise DesignError("cases", name, "must have names of their own, this one is there twice")


def displaced(
    scene: Scene, own: Iterable[str], paths: Collection[str], values: Iterable[float]
) -> str | None:
    """Return which of a scene's own parameters does not stay where other paths get values; None if all do.

    Among them is what is tied to these: N1 to N0 by its ratio, the loads of a damper to its mass.
    """
    if (same := next((path for path in own if path in paths), None)) is not None:
        return same
    for value in values:
        there = scene.with_values(dict.fromkeys(paths, value))
        for path in own:
            if not math.isclose(there.value(path), scene.value(path), rel_tol=SAME, abs_tol=0.0):
                return path
    return None


def refuse_displaced(
    scene: Scene, own: Mapping[str, float], paths: Collection[str], values: Iterable[float], where: Place,
    words: str = "is a variable",
) -> None:  # fmt: skip
    """Raise DesignError at `where` if one of a scene's own parameters does not stay, see `displaced`.

    `words`: what the paths are, as it follows the name of one.
    """
    path = displaced(scene, own, paths, values)
    if path is not None:
        tied = "" if path in paths else f"does not stay as it is beside {', '.join(paths)}, which "
        raise DesignError((*where, path), own[path], f"{tied}{words}: it has no value here")


def read_case(
    scene: Scene, index: int, table: object, variables: Sequence[BoundedVariable] = ()
) -> list[LoadCase]:
    """Return the load cases of one table, one for each DOF it observes; raises like `read_cases`."""
    where: Place = ("cases", index)
    if not isinstance(table, Mapping):
        raise DesignError(where, table, "must be a table")
    for key in table:
        if key not in _KEYS:
            raise DesignError((*where, key), table[key], f"is not known; a case has {', '.join(_KEYS)}")
    name = table.get("name", scene.name if index == 0 else f"case {index + 1}")
    if not isinstance(name, str) or not name:
        raise DesignError((*where, "name"), name, "must be a text")
    here = _engine_order(scene, where, table.get("engine_order"))
    values = table.get("set", {})
    if not isinstance(values, Mapping):
        raise DesignError((*where, "set"), values, "must be a table of parameter paths and values")
    here = _with_values(here, where, values)
    for variable in variables:
        ends = (variable.low, variable.high)
        refuse_displaced(here, values, variable.paths, ends, (*where, "set"))
    band = table.get("band")
    band = None if band is None else range_above_zero((*where, "band"), band, " [Hz]")
    order = whole((*where, "order"), table.get("order", max(here.engine_order, 1)), least=1)
    weight = positive((*where, "weight"), table.get("weight", 1.0))
    observed = table.get("observe", here.observe.dof)
    dofs = [observed] if isinstance(observed, str) else observed
    if not isinstance(dofs, Sequence) or not dofs or not all(isinstance(dof, str) for dof in dofs):
        raise DesignError((*where, "observe"), observed, "must be the name of a DOF, or a list of them")
    names = [name if len(dofs) == 1 else f"{name}, {dof}" for dof in dofs]
    return [
        LoadCase(name=one, scene=_observing(here, where, dof, band), weight=weight, order=order, own=values)
        for one, dof in zip(names, dofs, strict=True)
    ]


def _with_values(scene: Scene, where: Place, values: Mapping[str, float]) -> Scene:
    """Return the scene with the case's own values; what is refused is told at its path."""
    try:
        return scene.with_values(values)
    except SettingError:
        for path, value in values.items():
            with at(*where, "set", path):
                scene.with_values({path: value})
        raise


def _engine_order(scene: Scene, where: Place, wanted: object) -> Scene:
    if wanted is None:
        return scene
    if not scene.structure.has_sectors:
        raise DesignError((*where, "engine_order"), wanted, "needs a cyclic structure; `order` fits any")
    with at(*where, "engine_order"):
        return with_engine_order(scene, whole((*where, "engine_order"), wanted, least=0))


def _observing(scene: Scene, where: Place, dof: str, band: tuple[float, float] | None) -> Scene:
    """Return the scene with another observed DOF and band."""
    given = {"dof": dof} if band is None else {"dof": dof, "band": band}
    changed = scene.model_copy(update={"observe": scene.observe.model_copy(update=given)})
    # Only another DOF can fail to fit the structure; a large structure is not read again for a band.
    if dof == scene.observe.dof:
        return changed
    with at(*where, "observe"):
        return Scene.from_dict(changed.to_dict())
