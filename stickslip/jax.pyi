from stickslip.lab.exports.jax_functions import (
    damping_ratio as damping_ratio,
    least_peak as least_peak,
    of_arrays as of_arrays,
    peak as peak,
    solve as solve,
)
