"""The designs that a look over the whole range begins with, and those a robust search starts from."""

from __future__ import annotations

import itertools
import math

import numpy as np

from optim.problem.problem import Problem
from optim.problem.variables import Real, unscaled

COARSE_ONE = 9  # designs of the coarse stage of a robust search with one variable
COARSE_EACH = 6  # and for each variable with more
LOOKS_ONE = 17  # designs of a look with one variable
LOOKS_EACH = 6  # and for each variable with more, besides corners and middles
MOST_CORNERS = 16


def coarse(problem: Problem) -> list[dict[str, float]]:
    """Return the designs a robust search starts from: even in scaled variables, the start first."""
    n = len(problem.variables)
    if n == 1:
        points = [[i / (COARSE_ONE - 1.0)] for i in range(COARSE_ONE)]
    else:
        points = quasi_random(n, 2 ** math.ceil(math.log2(COARSE_EACH * n))).tolist()
    designs = [unscaled(problem.variables, point) for point in points]
    start = None if problem.start is None else dict(problem.start)
    return [start, *designs] if start is not None and start not in designs else designs


def places(n: int, known: int = 0) -> Real:
    """Return the places of a look, (k, n), of the unit box: bounds included.

    The middle; the corners, of many variables only those next to the lowest and the highest; the middles of
    the faces, with two variables those of the edges; a Sobol sequence between them, shorter by so many
    places as are `known` between the bounds already.
    """
    if n == 1:
        return np.linspace(0.0, 1.0, LOOKS_ONE)[:, None]
    middle = np.full((1, n), 0.5)
    faces = np.repeat(middle, 2 * n, axis=0)
    for i in range(n):
        faces[2 * i, i], faces[2 * i + 1, i] = 0.0, 1.0
    between = quasi_random(n, 2 ** math.ceil(math.log2(LOOKS_EACH * n)))
    # The first place of the sequence is a corner, the second the middle.
    return np.vstack([middle, corners(n), faces, between[2 + known :]])


def quasi_random(n: int, count: int, seed: int | None = None) -> Real:
    """Return the first places of a Sobol sequence in the unit box, (count, n); scrambled if it has a seed."""
    from scipy.stats import qmc  # takes half a second to load, and a design of one variable needs none

    return np.asarray(qmc.Sobol(n, scramble=seed is not None, seed=seed).random(count))


def corners(n: int) -> Real:
    """Return the corners of the unit box, (k, n); of many variables those that differ from an end in one."""
    if 2**n <= MOST_CORNERS:
        return np.array(list(itertools.product((0.0, 1.0), repeat=n)))
    low = np.vstack([np.zeros(n), np.eye(n)])
    return np.vstack([low, 1.0 - low])
