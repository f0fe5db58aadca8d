from stickslip.lab.exports.exact_functions import (
    ExactFunction as ExactFunction,
    damping_ratio as damping_ratio,
    least_peak as least_peak,
    peak as peak,
    solve as solve,
)
from stickslip.lab.exports.openmdao_component import FrictionComponent as FrictionComponent
