"""The keys of a design problem, each said once: type, range, words, and its option of the command.

The arguments of `optim.design`, `robust_design` and `pareto_front` (`keywords`), problem files,
bodies of requests, options of the command and the table in docs/design.md follow from these models. They know
types and ranges; whether a description fits its scene, `optim.problem.design_problem` finds.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container, Iterable
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any, Literal, Optional, TypeVar, get_args, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model

from optim.criteria.criterion import criteria, limit_keys, weight_words
from optim.criteria.key import (
    LARGEST,
    LEAST,
    BandHz,
    Form,
    Harmonics,
    Key,
    Name,
    Number,
    Option,
    Pair,
    ParameterPath,
    PositiveNumber,
    Share,
)
from optim.problem.checks import AimWord, MethodWord, ScalingWord
from solver.scene.descriptions import DAMPER_LOAD, DISK_LOAD, DISK_LOADS

if TYPE_CHECKING:
    from solver.scene.scene import Scene

MAX_UNCERTAIN = 2000


def _uncertain(value: object) -> object:
    """Tables and lists of a size that can be computed; the design layer looks at what they mean."""
    if not isinstance(value, dict | list) or not value:
        raise ValueError("must be a table of intervals, a table of an ellipsoid, or a list of samples")
    if _leaves(value) > MAX_UNCERTAIN:
        raise ValueError(f"must hold at most {MAX_UNCERTAIN} numbers")
    tables = value if isinstance(value, list) else [value]
    for table in tables:
        disk = table.get("mistuning") if isinstance(table, dict) else None
        if isinstance(disk, dict):
            _mistuning(disk)
    return value


def _leaves(value: object) -> int:
    """How many numbers and words a value holds; without recursion, a body may be nested deeply."""
    count, pending = 0, [value]
    while pending:
        item = pending.pop()
        if isinstance(item, dict):
            pending.extend(item.values())
        elif isinstance(item, list):
            pending.extend(item)
        else:
            count += 1
    return count


def _mistuning(disk: dict[str, Any]) -> None:
    """The types of a mistuned disk, which the design layer takes for granted."""
    of, seeds, rows = disk.get("of"), disk.get("seeds", [1]), disk.get("values", [1.0])
    names = [of] if isinstance(of, str) else of
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise ValueError("must have in `mistuning.of` a part of the disk, or a list of them")
    if not isinstance(seeds, list) or not all(
        isinstance(seed, int) and not isinstance(seed, bool) and 0 <= seed < 2**63 for seed in seeds
    ):
        raise ValueError("must have in `mistuning.seeds` a list of whole numbers >= 0")
    if not isinstance(rows, list) or not rows:
        raise ValueError("must have in `mistuning.values` a list of factors, or of lists of them")
    factors = [factor for row in rows for factor in (row if isinstance(row, list) else [row])]
    if any(isinstance(f, bool) or not isinstance(f, int | float) for f in factors):
        raise ValueError("must have in `mistuning.values` numbers alone")


Uncertain = Annotated[
    Any,
    BeforeValidator(_uncertain),
    WithJsonSchema({"anyOf": [{"type": "object"}, {"type": "array", "items": {"type": "object"}}]}),
]

MAX_VARIABLES = 50
MAX_CASES = 50
VARIABLE_LENGTH = 500
HARMONICS = 11
BASINS, MOST_BASINS = 2, 20
POINTS, FEWEST_POINTS = 9, 3
QUANTILE = 0.95
FEWEST_SAMPLES = 2
SEED = 0
TOLERANCE = 0.05


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


_PATH = r"[A-Za-z0-9_@-]+(\.[A-Za-z0-9_@-]+)?"
VariableName = Annotated[str, Field(max_length=VARIABLE_LENGTH, pattern=rf"^{_PATH}(\s*,\s*{_PATH})*$")]
Weight = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST)]
Observed = Annotated[
    Any,
    BeforeValidator(_observed),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]


class CaseRequest(BaseModel):
    """One load case: a response the design is judged by, the scene's own where a key is left out."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    name: Name | None = Field(default=None, description="How results call it.")
    set: dict[ParameterPath, Number] = Field(
        default={},
        max_length=1000,
        description="Values of this case alone, parameter path to value; no variable.",
    )
    band: BandHz | None = Field(default=None, description="Frequencies [low, high] [Hz]; the scene's band.")
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


class ProblemKeys(BaseModel):
    """What the design problems of all kinds have in common; `with_limits` adds the keys of the criteria."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, defer_build=True)

    harmonics: Annotated[
        Harmonics,
        Option(Form.WHOLE_NUMBER, "--harmonics", "H", help=f"Highest harmonic kept; {HARMONICS}."),
    ] = Field(default=HARMONICS, description="Highest harmonic of the balance.")
    variables: Annotated[
        Annotated[dict[VariableName, Pair], Field(max_length=MAX_VARIABLES)] | None,
        Option(
            Form.BOUNDS, "--variable", "PATH LO HI",
            help=f"A parameter and its bounds, for example {DISK_LOAD} 20 3000; paths that share a value are "
            "separated by commas; repeatable. If left out, the mass of the first damper, or "
            "the normal load of the contact whose load varies.",
        ),
    ] = Field(
        default=None,
        description="Variable to [low, high]: a parameter path, or several that share a value, separated "
        "by commas. The mass of the first damper, or the normal load of the contact whose load varies, if "
        "left out.",
        examples=[{DAMPER_LOAD: [20, 1000]}, {DISK_LOADS: [20, 3000]}],
    )  # fmt: skip
    scaling: Annotated[
        dict[VariableName, ScalingWord] | None,
        Option(
            Form.WORDS_BY_PATH, "--scaling", "PATH=HOW", example=f"{DISK_LOAD}=logarithmic",
            help="Scale a variable linear or logarithmic; by its bounds.",
        ),
    ] = Field(
        default=None, max_length=MAX_VARIABLES,
        description="Whether equal steps or equal ratios of a variable count equally; by its bounds.",
        examples=[{DAMPER_LOAD: "logarithmic"}],
    )  # fmt: skip
    cases: Annotated[list[CaseRequest], Field(min_length=1, max_length=MAX_CASES)] | None = Field(
        default=None, description="The responses that count; the scene as it is if left out."
    )
    limit: Annotated[
        PositiveNumber | None,
        Option(
            Form.NUMBER, "--limit", "A",
            help="Amplitude [m] above which the resonance band is measured; peak/√2 if left out.",
        ),
    ] = Field(
        default=None,
        description="Amplitude [m] above which the resonance band is measured; half power of the peak.",
    )  # fmt: skip
    start: Annotated[
        dict[VariableName, Number] | None,
        Option(
            Form.NUMBERS_BY_PATH, "--start", "PATH=VALUE", example=f"{DISK_LOAD}=150",
            help="A design to start from; repeatable.",
        ),
    ] = Field(
        default=None, max_length=MAX_VARIABLES, description="A design to start from, variable to value."
    )  # fmt: skip
    method: Annotated[
        MethodWord,
        Option(
            Form.WORD,
            "--method",
            "M",
            help="auto, tracked, minimax, ipopt or performance-curve; auto.",
            words=get_args(MethodWord),
        ),
    ] = Field(default="auto", description="How the optimum is searched.")


class NominalAndRobustKeys(ProblemKeys):
    """What a design takes besides; `of_design` adds limits and weights."""

    basins: Annotated[
        Annotated[int, Field(strict=True, ge=1, le=MOST_BASINS)] | None,
        Option(Form.WHOLE_NUMBER, "--basins", "N", help=f"Local optima looked for; {BASINS}."),
    ] = Field(default=None, description=f"How many local optima are looked for; {BASINS}.")
    tolerance: Annotated[
        Annotated[float, Field(strict=True, ge=LEAST, le=1.0)] | None,
        Option(
            Form.NUMBER, "--tolerance", "E",
            help=f"Relative error of the peak up to which a performance curve suffices; {TOLERANCE}.",
        ),
    ] = Field(
        default=None,
        description=f"Relative error of the peak up to which a performance curve suffices; {TOLERANCE}.",
    )  # fmt: skip
    options: Annotated[dict[Name, dict[ParameterPath, Number]], Field(min_length=1, max_length=50)] | None = (
        Field(
            default=None,
            description="A catalogue: name to the values of each option that can be had, of which the best "
            "is looked for; `variables` may then be empty.",
            examples=[{"soft": {"damper.kt": 15}, "stiff": {"damper.kt": 45}}],
        )
    )
    uncertain: Uncertain | None = Field(
        default=None,
        description="What is not known: a table of intervals, a table of an ellipsoid, or a list of samples.",
        examples=[{"damper.mu": [0.2, 0.4], "damper.kt": {"deviation": 0.1}}],
    )
    aim: AimWord | None = Field(
        default=None, description="What is minimised over the uncertainty; worst-case."
    )
    quantile: Share | None = Field(
        default=None, description=f"Share of the samples that the aim `quantile` minimises; {QUANTILE}."
    )
    samples: Annotated[int, Field(strict=True, ge=FEWEST_SAMPLES, le=10_000)] | None = Field(
        default=None, description="Scenarios drawn; 32 of a worst case, else 64."
    )
    seed: Annotated[int, Field(strict=True, ge=SEED, lt=2**63)] | None = Field(
        default=None, description=f"Of the random numbers; {SEED}."
    )


class PointsOfFront(ProblemKeys):
    """What a front takes besides; `of_front` adds its limits."""

    points: Annotated[
        Annotated[int, Field(strict=True, ge=FEWEST_POINTS, le=200)] | None,
        Option(Form.WHOLE_NUMBER, "--points", "N", help=f"Points of the front, {POINTS} if left out."),
    ] = Field(default=None, description=f"Points of the front looked for, both ends included; {POINTS}.")


Model = TypeVar("Model", bound=ProblemKeys)


def with_limits(model: type[Model], keys: Iterable[Key], **further: Any) -> type[Model]:
    """Return a model with the keys of criteria, and fields of its own.

    Parameters
    ----------
    model : without them.
    keys : of its limits.
    further : name to (type, `Field`).
    """
    limits: dict[str, Any] = {
        key.name: (
            Annotated[Optional[key.annotation], key.option],  # noqa: UP045 - a type that is known when this runs
            Field(default=None, description=key.help, examples=list(key.examples) or None),
        )
        for key in keys
    }
    return create_model(
        model.__name__.removeprefix("_"), __base__=model, __module__=model.__module__, __doc__=model.__doc__,
        __cls_kwargs__={"defer_build": False}, **limits, **further,
    )  # fmt: skip


def of_design(model: type[Model]) -> type[Model]:
    """Return a model with the limits and the weights of a design."""
    words = weight_words()
    minimised = ", ".join(f"{one.weight}{one.per_unit}" for one in criteria() if one.weight)
    option = Option(
        Form.NUMBERS_BY_WORD, "--weight", "|".join(f"{word}=W" for word in words), example="peak=1",
        help="What is minimised; the peak alone if left out.",
    )  # fmt: skip
    table = dict[Literal[words], Weight] | None  # type: ignore[valid-type]
    weights = Field(
        default=None,
        description=f"What is minimised: {minimised}, each times its weight; the peak alone.",
        examples=[{"peak": 1, "band": 1e-6}],
    )
    return with_limits(model, limit_keys(), weights=(Annotated[table, option], weights))


def of_front(model: type[Model]) -> type[Model]:
    """Return a model with the limits of a front: what it minimises and the limit on the band are its own."""
    return with_limits(model, limit_keys(of_fronts=True))


DesignKeys = of_design(NominalAndRobustKeys)
FrontKeys = of_front(PointsOfFront)
OPTIONS = "options"
"""The key of a catalogue."""
ROBUST = ("uncertain", "aim", "quantile", "samples", "seed")
"""The keys of a design for which not everything is known."""


def options(model: type[BaseModel]) -> dict[str, Option]:
    """Return the keys of a model that have an option of the command, in order."""
    return {
        name: one
        for name, field in model.model_fields.items()
        for one in field.metadata
        if isinstance(one, Option)
    }


Function = TypeVar("Function", bound=Callable[..., Any])
MARK = "    **problem : the keys of a problem.\n"
_WIDTH = 110


def keywords(model: type[BaseModel], without: Container[str] = ()) -> Callable[[Function], Function]:
    """Give a function that takes ``**problem`` the keys of a model as its arguments.

    `inspect.signature`, `help` and completion show them, each with what its description says in place of
    the line `MARK` of the docstring. What the function names itself stays as it is.

    Parameters
    ----------
    model : the keys, with their types, defaults and descriptions.
    without : those that the function does not take.
    """
    types = get_type_hints(model)

    def with_keys(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not inspect.Parameter.VAR_KEYWORD]
        named = {one.name for one in own}
        keys = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=types[name]
            )
            for name, field in model.model_fields.items()
            if name not in named and name not in without
        ]
        told = [_told(key.name, str(model.model_fields[key.name].description)) for key in keys]
        function.__doc__ = (function.__doc__ or "").replace(MARK, "".join(told))
        function.__signature__ = signature.replace(parameters=[*own, *keys])  # type: ignore[attr-defined]
        return function

    return with_keys


def _told(name: str, description: str) -> str:
    """The lines of a key in a docstring."""
    # The first letter is small there, but for symbols.
    text = description if description[1:2].isupper() else description[0].lower() + description[1:]
    return fill(f"{name} : {text}", _WIDTH, initial_indent="    ", subsequent_indent=" " * 8) + "\n"


BELOW, ABOVE = 10.0, 15.0
"""How far the range that is designed by itself goes below and above the value of a scene, as factors."""


def default_variable(scene: Scene) -> str | None:
    """Return the path that is designed by itself; None where the scene suggests none.

    Mass or normal load of the first damper that has one, else the normal load of the first contact with a
    tied load, else of the first contact.
    """
    for damper in scene.dampers:
        for key in ("mass", "N0"):
            if key in damper.parameters and scene.value(f"{damper.name}.{key}") > 0.0:
                return f"{damper.name}.{key}"
    rubbing = [(contact, contact.load) for contact in scene.contacts if contact.load is not None]
    tied = [(contact, load) for contact, load in rubbing if load.ratio is not None]
    first = next((contact for contact, _ in tied or rubbing), None)
    return None if first is None else f"{first.group or first.name}.N0"
