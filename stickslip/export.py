"""Scenes for other programs: their equations for MATLAB, and a functional mock-up unit (FMI 2.0)."""

from optim.doors.equations_of_motion import (
    ContactRows as ContactRows,
    EquationsOfMotion as EquationsOfMotion,
    equations_of as equations_of,
)
from optim.doors.fmu import save_fmu as save_fmu
from optim.doors.matlab import save_mat as save_mat
