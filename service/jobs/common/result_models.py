"""What the schemas of the results of the kinds share; null stands for what is not known or not there."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, create_model
from pydantic.fields import FieldInfo

from solver.first_use import on_demand

if TYPE_CHECKING:
    from solver.results.told import Told


Table = dict[str, Any]
Amplitude = Annotated[float | None, Field(description="Displacement [m].")]
Curve = Annotated[list[float | None], Field(description="A number a point.")]


class KindResult(BaseModel):
    """Root of the results of the kinds; a later version may add keys."""

    # Built when a description of the API asks for it.
    model_config = ConfigDict(extra="allow", defer_build=True)


class PeakAt(BaseModel):
    """The height of a peak [m], and where it is."""

    model_config = ConfigDict(defer_build=True)

    value: float
    at: float


class EndedResult(KindResult):
    """A result that says how the computation ended."""

    completed: bool = Field(description="Whether it came to its end.")
    status: str = Field(description="How it ended, and what to try if it fell short.")


class ReachedResult(KindResult):
    """The result of a search."""

    reached: bool = Field(description="Whether the goal was reached.")
    status: str = Field(description="How it ended, and what to try if it fell short.")


def result_model(
    kind: type[Told], name: str, *, only: Collection[str] = (), **types: Any
) -> type[KindResult]:
    """Return the schema of the JSON of a class of results, by the types and words of its fields.

    Parameters
    ----------
    kind : the class; how well responses are known, and how a result ended, is said in all alike.
    name : of the schema.
    only : the keys that are given, all if left out.
    types : of keys whose JSON has another one than the attribute, or none that is known here; with a default
        as a pair where results may be without. Of further keys their fields, as of `pydantic.create_model`.
    """
    from solver.results.base import MadeOfResponses
    from solver.results.known import Known
    from solver.results.told import declared, json_keys

    known = (Known,) if issubclass(kind, MadeOfResponses) and not only else ()
    keys = {key: (of, path) for of in (*known, kind) for key, path in json_keys(of).items()}
    keys = {key: place for key, place in keys.items() if not only or key in only}
    parts: dict[type[KindResult], bool] = {EndedResult: "completed" in keys, ReachedResult: "reached" in keys}
    bases = tuple(part for part, has in parts.items() if has)
    shared = {key for base in bases for key in base.model_fields}
    own: dict[str, Any] = {}
    for key, place in keys.items():
        if key not in shared:
            of, words = declared(*place)
            kept = Table if of is None else _json_type(of)
            given, default = one if isinstance(one := types.pop(key, kept), tuple) else (one, ...)
            field = default if isinstance(default, FieldInfo) else Field(default, description=words or None)
            own[key] = given, field
    about = (kind.__doc__ or "").partition("\n")[0]
    return create_model(name, __base__=bases or (KindResult,), __doc__=about, **own, **types)


def answered(place: str, name: str, **types: Any) -> Callable[[], type[KindResult]]:
    """Return what makes the schema of a class, ``"module:Class"``, when it is asked for.

    The help of a command needs no schema of results, nor what computes them. Arguments as of `result_model`.
    """

    @cache
    def made() -> type[KindResult]:
        kind: Any = on_demand(place)
        return result_model(kind, name, **types)

    return made


def _json_type(given: Any) -> Any:
    import numpy as np

    from solver.arrays import FloatOrNaN
    from solver.scene.scene import Scene

    of, parts = get_origin(given), get_args(given)
    if of in (Union, UnionType):
        return Union[tuple(_json_type(one) for one in parts)]  # noqa: UP007 - made of what is found
    if given is FloatOrNaN:
        return float | None
    if of is Annotated:
        return _json_type(parts[0])
    if of is np.ndarray:
        return Curve
    if of is Mapping:
        return dict[str, _json_type(parts[1])]  # type: ignore[misc]
    if of is tuple:
        return list[_json_type(parts[0])]  # type: ignore[misc]
    if given in (str, int, float, bool, NoneType, Any):
        return given
    return str if issubclass(given, Enum | Scene) else Table
