"""What the schemas of the results of the kinds share; null stands for what is not known or not there."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

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
    """A result that says how the computation ended.

    Attributes
    ----------
    completed : bool
        Whether it came to its end.
    status : str
        How it ended, and what to try if it did not.
    """

    completed: bool
    status: str = Field(description="How it ended, and what to try if it fell short.")


class ReachedResult(KindResult):
    """The result of a search.

    Attributes
    ----------
    reached : bool
        Whether the goal was reached.
    status : str
        How it ended, and what to try if it did not.
    """

    reached: bool
    status: str = Field(description="How it ended, and what to try if it fell short.")
