"""Answers as components of OpenMDAO, with their exact derivatives; extra `openmdao`."""

from optim.doors.functions import (
    ExactFunction as ExactFunction,
    damping_ratio as damping_ratio,
    least_peak as least_peak,
    peak as peak,
    solve as solve,
)
from optim.doors.openmdao import FrictionComponent as FrictionComponent
