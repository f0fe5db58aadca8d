"""Types of the values of problem files and REST bodies that keys have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

LARGEST = 1e15
MAX_RANGES = 200

Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
PositiveNumber = Annotated[float, Field(strict=True, gt=0.0, le=LARGEST)]
MAX_HARMONICS = 200
Harmonics = Annotated[int, Field(strict=True, ge=1, le=MAX_HARMONICS)]
ParameterPath = Annotated[str, Field(max_length=210, pattern=r"^[A-Za-z0-9_@-]+(\.[A-Za-z0-9_@-]+)?$")]
FrequencyHz = Annotated[float, Field(strict=True, gt=0.0, le=1e9)]
Name = Annotated[str, Field(strict=True, min_length=1, max_length=200)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Ranges = Annotated[list[Pair], Field(min_length=1, max_length=MAX_RANGES)]
