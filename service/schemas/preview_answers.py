"""What previews answer; the worker that computes one writes it."""

from __future__ import annotations

from pydantic import Field

from service.schemas.answers import AnswerModel, Peak

Numbers = list[float | None]


class PeakCertificate(AnswerModel):
    """Why no higher peak hides between two points of a response, or that it is not known."""

    known: bool
    reason: str
    bound: float | None = Field(description="What the amplitude does not exceed between points [m].")
    widest_gap: float | None = Field(description="Largest distance between neighbouring points [Hz].")
    resonances: int = Field(description="Narrow resonances between points that were solved for.")


class SweepPreview(AnswerModel):
    """A frequency response over the scene's band."""

    parameter: list[float] = Field(description="Frequencies [Hz].")
    amplitude: list[float] = Field(description="max|x| of the observed DOF [m].")
    peak: Peak | None
    peaks: list[Peak]
    band_hz: float | None
    band_limit: float | None
    band_intervals_hz: list[tuple[float, float]] | None
    points: int
    peak_certificate: PeakCertificate
    band_known: bool | None = Field(description="Whether the band was settled everywhere by solutions.")
    error_estimate: float | None = Field(description="Of the highest peak [m].")
    mean_undetermined: bool | None = Field(
        description="Whether the mean of the highest peak depends on the history."
    )
    unstable: list[tuple[int, int]] = Field(
        description="First and last point of every stretch that is not stable."
    )
    flags: list[str]
    seconds: float
    completed: bool
    status: str
    n_harmonics: int = Field(description="Kept; fewer than asked for where a whole disk takes too long.")
    states: dict[str, str] = Field(description="What every contact does at the highest peak.")


class ParameterEffect(AnswerModel):
    """What one per cent more of a parameter does; null where that means nothing or is not known."""

    path: str
    unit: str
    value: float
    peaks_percent: list[float | None] = Field(description="Of every competing peak, in their order [%].")
    band_percent: float | None = Field(description="Of the width of the resonance band [%].")


class LeftOut(AnswerModel):
    """A parameter without a derivative."""

    path: str
    reason: str


class Summit(AnswerModel):
    """A peak that competes to be the highest."""

    value: float = Field(description="Amplitude [m].")
    at: float = Field(description="Frequency [Hz].")


class SensitivitiesPreview(AnswerModel):
    """Per cent of peaks and band for one per cent of each parameter, what matters most first."""

    peaks: list[Summit] = Field(description="Those that compete, highest first.")
    band_hz: float | None
    limit: float | None = Field(description="Amplitude at which the band is measured [m].")
    rows: list[ParameterEffect]
    left_out: list[LeftOut]
    peak_certificate: PeakCertificate
    seconds: float
    reached: bool
    status: str
    n_harmonics: int = Field(description="Kept; fewer than asked for where a whole disk takes too long.")


class LinearResponse(AnswerModel):
    """The response with a contact removed, or stuck."""

    parameter: list[float]
    amplitude: list[float]
    peak: Peak | None
    peaks: list[Peak]
    peak_certificate: PeakCertificate
    completed: bool


class LimitsPreview(AnswerModel):
    """The linear responses between which friction works."""

    free: LinearResponse
    stuck: LinearResponse


class Shares(AnswerModel):
    """Shares of the period."""

    stick: float
    slip: float
    separation: float


class ContactPeriod(AnswerModel):
    """A contact over one period; the first instant is repeated at the end of `slip`, `force` and `load`."""

    name: str
    state: str
    slip: list[float] = Field(description="Slip motion [m].")
    force: list[float] = Field(description="Force [N].")
    load: list[float] = Field(description="Normal load [N], 0 while open.")
    motion: list[int] | None = Field(description="0 stick, 1 slip, 2 separation; null for other laws.")
    shares: Shares | None


class Period(AnswerModel):
    """One period."""

    time: list[float] = Field(description="Instants [s].")
    displacement: list[float] = Field(description="Of the observed DOF [m].")
    contacts: list[ContactPeriod]


class PointPreview(AnswerModel):
    """A periodic response at one frequency; `period` is left out if there is no solution."""

    scene: str
    frequency_hz: float
    converged: bool
    status: str
    max_abs: float | None
    half_peak_to_peak: float | None
    mean: float | None
    harmonics: Numbers
    flags: list[str]
    residual: float | None
    error_estimate: float | None
    n_harmonics: int = Field(description="Kept; fewer than asked for where a whole disk takes too long.")
    seconds: float
    period: Period | None = None
