"""Designs: what they return, and the gradients that searches of one's own need."""

from optim import (
    DesignStatus as DesignStatus,
    ParetoResult as ParetoResult,
    ParetoStatus as ParetoStatus,
    RobustResult as RobustResult,
    RobustStatus as RobustStatus,
    SensitivityResult as SensitivityResult,
    SensitivityStatus as SensitivityStatus,
)
from solver import (
    AmplitudeHessian as AmplitudeHessian,
    Gradient as Gradient,
    Sensitivities as Sensitivities,
)
