"""What the parts of a scene are made of: names, ends, numbers with their ranges."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    WithJsonSchema,
)
from pydantic_core import PydanticKnownError

from solver.wording import every_field_said, with_attributes

Real: TypeAlias = NDArray[np.float64]
LARGEST = 1e15
GROUND = "ground"
NEXT = "next"

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+\z", max_length=100)]
MemberName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+(@[0-9]+)?\z", max_length=100)]
DofName = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9_-]+(\.r?[xyz])?(@[0-9]+)?\z", max_length=103)
]  # `.x` … `.rz` are of a body
EndName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+(\.r?[xyz])?(@([0-9]+|next))?\z", max_length=108)]
Between = tuple[EndName, EndName]
NonNegative = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, le=LARGEST, allow_inf_nan=False)]
INFINITE = "inf"  # what stands for infinity where JSON has no number for it


def _largest_unless_infinite(value: float) -> float:
    if LARGEST < value < math.inf:
        raise PydanticKnownError("less_than_equal", {"le": LARGEST})
    return value


Stiffness = Annotated[
    float,
    Field(strict=True, gt=0.0, allow_inf_nan=True),
    BeforeValidator(lambda value: math.inf if value == INFINITE else value),
    AfterValidator(_largest_unless_infinite),
    PlainSerializer(lambda value: INFINITE if math.isinf(value) else value, when_used="json"),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "exclusiveMinimum": 0.0, "maximum": LARGEST}, {"const": INFINITE}]}
    ),
]  # of a contact that may be rigid
Signed = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Vector = tuple[Signed, Signed, Signed]
Friction = Annotated[float, Field(strict=True, ge=0.0, le=100.0, allow_inf_nan=False)]
Angle = Annotated[float, Field(strict=True, ge=-1e4, le=1e4, allow_inf_nan=False)]
LEAST_SAMPLES, MOST_SAMPLES = 32, 65_536  # of a period
Samples = Annotated[int, Field(strict=True, ge=LEAST_SAMPLES, le=MOST_SAMPLES)]


class Part(BaseModel):
    """Root of everything in a scene: frozen, no unknown keys, no NaN.

    A field says its type, and in words what it is with its unit: ``m: Annotated[Positive, "Mass [kg]."]``.
    The attributes in the docstring, and the descriptions of the JSON Schema of scenes, follow from that.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        cls.__doc__ = with_attributes(cls.__dict__.get("__doc__"), every_field_said(cls))


class End(NamedTuple):
    """One end of a spring, dashpot or contact: a DOF (None = ground), here or in the next sector."""

    dof: str | None
    next: bool


def parse_end(text: str) -> End:
    """Read ``"tip"``, ``"tip@next"``, ``"tip@3"`` (a DOF of an annulus) or ``"ground"``."""
    if text == GROUND:
        return End(None, False)
    base, at, suffix = text.partition("@")
    return End(base, True) if at and suffix == NEXT else End(text, False)


class Element(Part):
    """Something that joins two ends."""

    between: Annotated[
        Between, "The two ends; the relative motion is x(first) - x(second), and the force resists it."
    ]

    @property
    def ends(self) -> tuple[End, End]:
        """The two ends, read."""
        return parse_end(self.between[0]), parse_end(self.between[1])
