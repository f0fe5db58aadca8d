"""Answers as functions of JAX, with their exact derivatives; needs ``pip install 'stickslip[jax]'``."""

from optim.doors.jax import (
    damping_ratio as damping_ratio,
    least_peak as least_peak,
    of_arrays as of_arrays,
    peak as peak,
    solve as solve,
)
