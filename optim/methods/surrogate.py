"""Where designs are looked at, and what is known between them: Taylor models of the nearest ones.

A look begins with corners, middles and a Sobol sequence. Every design looked at has its rows with their
slopes. Between designs each of the nearest ones predicts the number by its own rows, positive ones along
exponentials (Shepard's inverse-distance weights of Taylor models: Franke, Nielson, Int. J. Numer. Methods
Eng. 15 (1980) 1691, doi:10.1002/nme.1620151110); where these predictions differ, little is known. A place is
worth a look where the mean less a few times the spread may beat the best design (lower confidence bound:
Cox, John, in Multidisciplinary Design Optimization, SIAM 1997, p. 105).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.methods.linearised import Model
from optim.problem.variables import Real

LOOKS_ONE = 17  # designs of a look with one variable
LOOKS_EACH = 12  # and for each variable with more, besides corners and middles
MOST_CORNERS = 32
NEAREST = 2  # designs a variable, and two more, whose models predict a place
DOUBT = 1.0  # spreads by which a prediction may be too high
MOST_GROWTH = 3.0  # exponent at most
CANDIDATES = 256  # places a variable that are compared, one variable: all of them in steps


def places(n: int, known: int = 0) -> Real:
    """Return the places of a look, (k, n), of the unit box: bounds included.

    The middle; the middles of the faces, with two variables those of the edges; the corners where all
    variables have one bound; a Sobol sequence between them, shorter by so many places as are `known` between
    the bounds already; the other corners, of many variables only those next to these two.
    """
    if n == 1:
        return np.linspace(0.0, 1.0, LOOKS_ONE)[:, None]
    middle = np.full((1, n), 0.5)
    faces = np.repeat(middle, 2 * n, axis=0)
    for i in range(n):
        faces[2 * i, i], faces[2 * i + 1, i] = 0.0, 1.0
    between = quasi_random(n, LOOKS_EACH * n)
    # The first place of the sequence is a corner, the second the middle.
    ends = corners(n)
    return np.vstack([middle, faces, ends[:2], between[2 + known :], ends[2:]])


def quasi_random(n: int, least: int, seed: int | None = None) -> Real:
    """Return the first places of a Sobol sequence in the unit box, (count, n); scrambled if it has a seed.

    They are `least`, or more: balanced are powers of two.
    """
    from scipy.stats import qmc  # takes half a second to load, and a design of one variable needs none

    count = 2 ** max(math.ceil(math.log2(least)), 0)
    return np.asarray(qmc.Sobol(n, scramble=seed is not None, seed=seed).random(count))


def corners(n: int) -> Real:
    """Return corners of the unit box, (k, n), the two where all variables have one bound first.

    Of many variables those that differ from these in one.
    """
    others = np.vstack([np.eye(n), 1.0 - np.eye(n)])
    if 2**n <= MOST_CORNERS:
        others = np.array(list(itertools.product((0.0, 1.0), repeat=n)))[1:-1]
    return np.vstack([np.ones(n), np.zeros(n), others])


@dataclass(frozen=True, slots=True, kw_only=True)
class Taylor:
    """First-order model of a number: Σ over groups of the largest row, a price on the largest limited row."""

    place: Annotated[Real, "Where it was looked at, (n,)."]
    groups: Annotated[tuple[tuple[Real, Real], ...], "Rows with their slopes."]
    limited: Annotated[tuple[Real, Real] | None, "Relative excesses over bounds."] = None
    price: Annotated[float, "On the largest excess above 0."] = 0.0

    @property
    def value(self) -> float:
        """The number here."""
        return float(self.at(self.place[None, :])[0])

    def at(self, places: Real) -> Real:
        """Return the predictions at (k, n) places."""
        steps = places - self.place
        total = np.zeros(len(places))
        for values, slopes in self.groups:
            total += _grown(values, steps @ slopes.T).max(axis=1)
        if self.limited is not None:
            excess, slopes = self.limited
            total += self.price * np.maximum(_grown(1.0 + excess, steps @ slopes.T).max(axis=1) - 1.0, 0.0)
        return total


def _grown(values: Real, changes: Real) -> Real:
    """Return rows after first-order changes (k, m): along exponentials where they are positive."""
    positive = values > 0.0
    safe = np.where(positive, values, 1.0)
    exponents = np.clip(changes / safe, -MOST_GROWTH, MOST_GROWTH)
    grown: Real = np.where(positive, safe * np.exp(exponents), values + changes)
    return grown


def taylor_of(model: Model, *, feasibility: bool = False) -> Taylor:
    """Return the model of a design's merit, or of its largest excess."""
    if feasibility:
        return Taylor(place=model.z, groups=((1.0 + model.excess, model.excess_slopes),))
    groups = tuple(
        (model.heights[model.groups == g], model.slopes[model.groups == g]) for g in np.unique(model.groups)
    )
    limited = (model.excess, model.excess_slopes) if model.excess.size else None
    return Taylor(place=model.z, groups=groups, limited=limited, price=model.penalty)


def candidates(n: int, seed: int) -> Real:
    """Return places of the unit box that are compared, (k, n); other ones for another seed."""
    if n == 1:
        return np.linspace(0.0, 1.0, 2 * CANDIDATES + 1)[:, None]
    places = quasi_random(n, CANDIDATES * n, seed)
    # A share of them on the faces: the best design often lies on one.
    faces = np.arange(0, len(places), 4)
    places[faces, faces // 4 % n] = (faces // 4 // n) % 2
    return np.asarray(places)


def promising(
    models: Sequence[Taylor], places: Real, enough: float, apart: float, most: int, *, above: bool = False,
    doubt: float = DOUBT,
) -> list[Real]:  # fmt: skip
    """Return the places where a number may be below (above) `enough`, the most promising first.

    Parameters
    ----------
    models : of the places looked at.
    places : (k, n) candidates.
    enough : the number to be beaten.
    apart : least distance, the largest over the coordinates, from what was looked at and from each other.
    most : how many.
    above : what is looked for is larger than `enough`.
    doubt : spreads by which a prediction may be too high.
    """
    known = np.array([model.place for model in models])
    far = np.abs(places[:, None, :] - known).max(axis=2)
    places = places[far.min(axis=1) >= apart]
    if not len(places):
        return []
    mean, spread = predicted(models, known, places)
    low = (-mean if above else mean) - doubt * spread
    chosen: list[Real] = []
    for i in np.argsort(low):
        if low[i] >= (-enough if above else enough) or len(chosen) >= most:
            break
        if all(np.abs(places[i] - other).max() >= apart for other in chosen):
            chosen.append(places[i])
    return chosen


def predicted(models: Sequence[Taylor], known: Real, places: Real) -> tuple[Real, Real]:
    """Return the mean of the predictions of the nearest models at (k, n) places, and their spread."""
    distance = np.linalg.norm(places[:, None, :] - known, axis=2)
    count = min(NEAREST * known.shape[1] + 2, len(models))
    nearest = np.argpartition(distance, count - 1, axis=1)[:, :count]
    weights = 1.0 / np.maximum(np.take_along_axis(distance, nearest, axis=1), 1e-9) ** (known.shape[1] + 2)
    weights /= weights.sum(axis=1, keepdims=True)
    predicted = np.zeros(nearest.shape)
    for j, model in enumerate(models):
        which = nearest == j
        rows = np.flatnonzero(which.any(axis=1))
        if rows.size:
            predicted[which] = model.at(places[rows])
    mean = (weights * predicted).sum(axis=1)
    return mean, np.sqrt((weights * (predicted - mean[:, None]) ** 2).sum(axis=1))
