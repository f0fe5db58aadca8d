"""Cubics through values and slopes at both ends of an interval, by the share t of it."""

from __future__ import annotations

import math


def extreme(a: float, da: float, b: float, db: float) -> float:
    """Return where the cubic is extreme between ends that lead to an extremum, kept off the ends."""
    chord = b - a
    c1, c2 = 3.0 * chord - 2.0 * da - db, da + db - 2.0 * chord
    root = math.sqrt(max(c1 * c1 - 3.0 * c2 * da, 0.0))
    # The stable form of the root between the ends.
    below = -c1 - math.copysign(root, c1)
    places = [da / below if below != 0.0 else 0.5, below / (3.0 * c2) if c2 != 0.0 else 0.5]
    inside = [t for t in places if 0.0 < t < 1.0]
    return min(max(inside[0] if inside else da / (da - db), 0.05), 0.95)
