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
    AllowedExcitation as AllowedExcitation,
    AmplitudeHessian as AmplitudeHessian,
    Gradient as Gradient,
    MarginDiagram as MarginDiagram,
    MarginStatus as MarginStatus,
    Sensitivities as Sensitivities,
    margin_diagram as margin_diagram,
)
