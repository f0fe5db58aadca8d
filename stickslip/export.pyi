from stickslip.lab.exports.equations_of_motion import (
    ContactRows as ContactRows,
    EquationsOfMotion as EquationsOfMotion,
    equations_of as equations_of,
)
from stickslip.lab.exports.fmu import save_fmu as save_fmu
from stickslip.lab.exports.matlab import save_mat as save_mat
