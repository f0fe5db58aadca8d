"""The words that keys of a design problem take."""

from __future__ import annotations

from enum import Enum
from typing import Literal

MethodWord = Literal["auto", "tracked", "minimax", "ipopt", "performance-curve"]
ScalingWord = Literal["auto", "linear", "logarithmic"]
AimWord = Literal["worst-case", "mean", "quantile"]


class Method(Enum):
    """How the optimum is searched; the value is the word users write."""

    AUTO = "auto"
    TRACKED = "tracked"
    MINIMAX = "minimax"
    IPOPT = "ipopt"
    PERFORMANCE_CURVE = "performance-curve"


class Scaling(Enum):
    """Whether equal steps or equal ratios of a variable count equally; AUTO chooses by the bounds."""

    AUTO = "auto"
    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


class Aim(Enum):
    """Over the uncertainty, what is minimised; the value is the word users write."""

    WORST_CASE = "worst-case"
    MEAN = "mean"
    QUANTILE = "quantile"
