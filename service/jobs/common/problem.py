"""The keys of a design problem, the same in a REST body, a problem file and Python, and their check.

The request model knows types and ranges; whether a description fits its scene is asked of the design layer,
piece by piece, so that everything wrong with it is told at once, each with the pointer of its field.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Optional, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model

from optim.criteria.json_types import LARGEST, Number, PositiveNumber
from optim.criteria.json_types import Name as Name
from optim.criteria.json_types import Pair as Pair
from optim.criteria.json_types import Ranges as Ranges
from optim.criteria.key import Key
from service.jobs.common.scenes import HarmonicRequest, ParameterPath
from solver.scene.scene import Scene

MAX_VARIABLES = 50
MAX_CASES = 50
VARIABLE_LENGTH = 500

_PATH = r"[A-Za-z0-9_@-]+(\.[A-Za-z0-9_@-]+)?"


def _observed(value: object) -> object:
    """A DOF, or a list of them."""
    texts = [value] if isinstance(value, str) else value
    if (
        isinstance(texts, list)
        and 1 <= len(texts) <= MAX_CASES
        and all(isinstance(text, str) and 0 < len(text) <= 200 for text in texts)
    ):
        return value
    raise ValueError("must be the name of a DOF, or a list of them")


VariableName = Annotated[str, Field(max_length=VARIABLE_LENGTH, pattern=rf"^{_PATH}(\s*,\s*{_PATH})*$")]
Weight = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST)]
Observed = Annotated[
    Any,
    BeforeValidator(_observed),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]


class CaseRequest(BaseModel):
    """One load case: a response the design is judged by, the scene's own where a key is left out.

    Attributes
    ----------
    name : str or None
        How results call it.
    set : dict
        Values of this case alone, parameter path to value.
    band : list or None
        Frequencies [low, high] [Hz].
    observe : str, list of str or None
        DOF whose amplitude counts; several give a case each.
    engine_order : int or None
        Of every excitation; cyclic scenes.
    order : int or None
        Excitations a revolution, which turns speeds into frequencies; the engine order if left out.
    weight : float or None
        By which its peaks count in what is minimised.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    name: Name | None = Field(default=None, description="How results call it.")
    set: dict[ParameterPath, Number] = Field(
        default={}, max_length=1000, description="Values of this case alone, parameter path to value."
    )
    band: Pair | None = Field(default=None, description="Frequencies [low, high] [Hz]; the scene's band.")
    observe: Observed | None = Field(default=None, description="DOF whose amplitude counts, or several.")
    engine_order: Annotated[int, Field(strict=True, ge=0, le=10_000)] | None = Field(
        default=None, description="Engine order of every excitation; cyclic scenes only."
    )
    order: Annotated[int, Field(strict=True, ge=1, le=10_000)] | None = Field(
        default=None, description="Excitations a revolution; the engine order, else 1."
    )
    weight: PositiveNumber | None = Field(
        default=None, description="By which its peaks count in what is minimised; 1."
    )


class ProblemRequest(HarmonicRequest):
    """What the design problems of all kinds have in common, in the words of `optim.design`.

    The keys of limits are those of the criteria: see `with_keys`.

    Attributes
    ----------
    variables : dict or None
        Variable to [low, high]: a parameter path, or several that share a value, separated by commas.
    scaling : dict or None
        Variable to ``linear``, ``logarithmic`` or ``auto``.
    cases : list or None
        The responses that count.
    limit : float or None
        Amplitude [m] above which the resonance band is measured.
    start : dict or None
        A design to start from, variable to value.
    method : str
        ``auto``, ``tracked``, ``minimax`` or ``ipopt``.
    """

    # Used with the keys of criteria alone: `with_keys` builds it.
    model_config = ConfigDict(defer_build=True)

    variables: Annotated[dict[VariableName, Pair], Field(min_length=1, max_length=MAX_VARIABLES)] | None = (
        Field(
            default=None,
            description="Variable to [low, high]: a parameter path, or several that share a value, separated "
            "by commas. The normal load of the contact whose load varies if left out.",
            examples=[{"damper.N0": [20, 1000]}, {"shroud.N0,root.N0": [20, 3000]}],
        )
    )
    scaling: dict[VariableName, Literal["auto", "linear", "logarithmic"]] | None = Field(
        default=None, max_length=MAX_VARIABLES,
        description="Whether equal steps or equal ratios of a variable count equally; by its bounds.",
        examples=[{"damper.N0": "logarithmic"}],
    )  # fmt: skip
    cases: Annotated[list[CaseRequest], Field(min_length=1, max_length=MAX_CASES)] | None = Field(
        default=None, description="The responses that count; the scene as it is if left out."
    )
    limit: PositiveNumber | None = Field(
        default=None,
        description="Amplitude [m] above which the resonance band is measured; half power of the peak.",
    )
    start: dict[VariableName, Number] | None = Field(
        default=None, max_length=MAX_VARIABLES, description="A design to start from, variable to value."
    )
    method: Literal["auto", "tracked", "minimax", "ipopt"] = Field(
        default="auto", description="How the optimum is searched."
    )


Problem = TypeVar("Problem", bound=ProblemRequest)


def with_keys(model: type[Problem], keys: Iterable[Key], **further: Any) -> type[Problem]:
    """A model of a problem with the keys of criteria, and fields of its own.

    Parameters
    ----------
    model : without them.
    keys : of its limits.
    further : name to (type, `Field`).
    """
    limits: dict[str, Any] = {
        key.name: (
            Optional[key.annotation],  # noqa: UP045 - a type that is known when this runs
            Field(default=None, description=key.help, examples=list(key.examples) or None),
        )
        for key in keys
    }
    name = model.__name__.removeprefix("_")
    return create_model(
        name, __base__=model, __module__=model.__module__, __doc__=model.__doc__,
        __cls_kwargs__={"defer_build": False}, **limits, **further,
    )  # fmt: skip


ABOUT_THE_SCENE = ("scene", "set")
ABOUT_THE_JOB = ("fresh", "priority", "max_seconds")


def arguments(request: ProblemRequest) -> dict[str, Any]:
    """The keys of a description that were given, as arguments of the design layer; JSON too."""
    given: dict[str, Any] = request.model_dump(
        mode="json", exclude_none=True, exclude={*ABOUT_THE_SCENE, *ABOUT_THE_JOB}
    )
    if request.cases is not None:
        given["cases"] = [case.model_dump(mode="json", exclude_unset=True) for case in request.cases]
        given["cases"] = [{k: v for k, v in case.items() if v is not None} for case in given["cases"]]
    return given


def default_variables(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    """The variables that stand for none, so that a spec says what is chosen."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.problem.variables import check_variables

    if "variables" in given:
        return {}
    return {"variables": {v.name: [v.low, v.high] for v in check_variables(scene, None)}}


def problem_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of the design layer in a spec; those of an older version name what was not given too."""
    return {key: value for key, value in spec.items() if key != "scene" and value is not None}
