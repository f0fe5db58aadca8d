from solver import (
    Band as Band,
    Basin as Basin,
    EdgeHessian as EdgeHessian,
    LeastPeak as LeastPeak,
    PeakGradient as PeakGradient,
    PeakHessian as PeakHessian,
    PeakKind as PeakKind,
    PeakTrack as PeakTrack,
    TrackStatus as TrackStatus,
    least_peak as least_peak,
    peak_gradient as peak_gradient,
    track_peak as track_peak,
)
