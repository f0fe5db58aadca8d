"""Functions for laws of one's own, as somebody might write them: of one contract, so some need not all."""

# ruff: noqa: ARG001

import math

import numba
import numpy as np

import solver

PARAMETERS = {
    "k": solver.LawParameter(unit="N/m", words="Stiffness", least=0.0, default=0.2),
    "limit": solver.LawParameter(unit="N", words="Force of the friction", least=0.0, default=0.6),
    "v0": solver.LawParameter(unit="m/s", words="Velocity", least=0.0, above=True, default=0.3),
}


def smooth(u, v, state, p):  # type: ignore[no-untyped-def]
    """A spring and a friction that Numba compiles, and that takes no complex numbers."""
    return p[0] * u + p[1] * v / math.sqrt(v * v + p[2] * p[2])


def analytic(u, v, state, p):  # type: ignore[no-untyped-def]
    """The same, of complex numbers too."""
    return p[0] * u + p[1] * v / np.sqrt(v * v + p[2] * p[2])


def folded(u, v, state, p):  # type: ignore[no-untyped-def]
    """A force that takes complex numbers but is not a function of them: its derivative would be wrong."""
    return p[0] * u + p[1] * v * abs(v)


compiled = numba.njit(smooth)


class Tuned:
    """Something Numba knows nothing of."""

    gain = 1.0


TUNED = Tuned()


def interpreted(u, v, state, p):  # type: ignore[no-untyped-def]
    """The same, which Numba cannot compile."""
    return TUNED.gain * (p[0] * u + p[1] * v / math.sqrt(v * v + p[2] * p[2]))


def slopes(u, v, state, p, out):  # type: ignore[no-untyped-def]
    """The derivatives of `smooth` by u, v and the parameters."""
    size = math.sqrt(v * v + p[2] * p[2])
    out[0, 0], out[0, 1] = p[0], p[1] * p[2] * p[2] / size**3
    out[0, 2], out[0, 3], out[0, 4] = u, v / size, -p[1] * v * p[2] / size**3


def root(u, v, state, p):  # type: ignore[no-untyped-def]
    """A force that is NaN beyond some motion."""
    return math.sqrt(p[0] - u * u) + p[1] * v


def drifting(u, v, state, p, out):  # type: ignore[no-untyped-def]
    """The rate of a state that never repeats."""
    out[0] = 1.0 + v


def of_drift(u, v, state, p):  # type: ignore[no-untyped-def]
    """A force of it."""
    return p[0] * u + p[1] * state[0]


def too_far(u, v, state, p):  # type: ignore[no-untyped-def]
    """A force that refuses a motion."""
    if u > 0.1:
        raise ValueError("too far")
    return p[0] * u


def whole(u, v, state, p):  # type: ignore[no-untyped-def]
    """What is no float."""
    return 3


def drag(u, v, du, dt, last, state, p):  # type: ignore[no-untyped-def]
    """A spring with a slider, from sample to sample; the state is its force."""
    state[0] = min(max(last[0] + p[0] * du, -p[1]), p[1])
    return state[0]


SLIDER = {
    "k": solver.LawParameter(unit="N/m", least=0.0, above=True),
    "limit": solver.LawParameter(unit="N", least=0.0, above=True),
}
