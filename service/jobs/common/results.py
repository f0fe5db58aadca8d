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


class KnownResult(KindResult):
    """How well the peaks of a result that is made of responses are known: that of the least known one."""

    measure: str = Field(
        description="What the peak is judged by: max_abs, or half_peak_to_peak where its mean is free."
    )
    peak_max_abs: Amplitude
    error_estimate: float | None = Field(description="Of max|x| of the peak [m].")
    peak_half_peak_to_peak: Amplitude
    half_peak_to_peak_error: Amplitude
    relative_error: float | None = Field(description="Of the measure; null if it is not known.")
    flags: list[str] = Field(description="What the responses assume or leave open.")
    peaks_open: list[Any] = Field(description="Why of some responses a higher peak may hide between points.")


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
