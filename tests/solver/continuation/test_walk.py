"""The loop that follows curves, and what is found between two points, on curves in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from solver.continuation.bracketing import closing_in, dense_between, least_between, level_up_to
from solver.continuation.walk import Curve, Pace, walk


class Circle(Curve[float]):
    """The unit circle by its angle; a step may not be longer than 0.1, and nothing steps over π/2."""

    def __init__(self) -> None:
        self.angle, self.leaps, self.tries = 0.0, 0, 0

    @property
    def ended(self) -> bool:
        return self.angle >= math.pi

    def tried(self, size: float) -> tuple[float | None, float]:
        self.tries += 1
        there = self.angle + size
        if size > 0.1 or self.angle < 0.5 * math.pi <= there:
            return None, 0.5 * size
        self.angle = there
        return there, 2.0 * size

    def leapt(self) -> tuple[float | None, float]:
        self.leaps += 1
        self.angle = 0.5 * math.pi + 1e-3
        return self.angle, 0.05


def test_steps_are_halved_and_what_none_is_short_enough_for_is_leapt_over_once() -> None:
    circle = Circle()
    angles = list(walk(circle, Pace(first=0.4, least=1e-3)))
    assert angles == sorted(angles)
    assert circle.leaps == 1
    assert circle.tries > len(angles)
    assert math.pi <= angles[-1] < math.pi + 0.1
    assert max(b - a for a, b in pairwise(angles)) <= 0.1 + 1e-12


def test_a_curve_without_a_leap_ends_where_no_step_is_short_enough() -> None:
    class Lost(Circle):
        def leapt(self) -> tuple[float | None, float]:
            return Curve.leapt(self)

    angles = list(walk(Lost(), Pace(first=0.05, least=1e-3)))
    assert 0.5 * math.pi - 3e-3 < angles[-1] < 0.5 * math.pi


def test_steps_grow_behind_easy_points_and_shrink_behind_hard_ones() -> None:
    pace = Pace(first=0.1, least=1e-3, largest=0.4, grow=1.6, shrink=0.4, easy=5, hard=9).times(10.0)
    assert (pace.first, pace.least, pace.largest) == (1.0, 0.01, 4.0)
    assert [pace.after(1.0, effort) for effort in (5, 6, 8, 9)] == [1.6, 1.0, 1.0, 0.5]
    assert pace.after(3.0) == 4.0
    assert pace.after(0.015, 9) == 0.01
    assert [pace.shorter(1.0), pace.shorter(1.0, 0.5)] == [0.4, 0.5]


@pytest.mark.parametrize("root", [1e-9, 0.2, 0.7321, 1.0 - 1e-9])
def test_a_root_and_a_jump_are_closed_in_on(root: float) -> None:
    for of in (lambda t: (t - root) * (1.0 + t * t), lambda t: math.copysign(1.0 + t, t - root)):
        for place, _, width in closing_in(float, of, of(0.0), of(1.0)):  # noqa: B007 - the last counts
            if width <= 1e-13:
                break
        assert abs(place - root) <= 2e-13


def test_closing_in_ends_where_there_is_no_point() -> None:
    found = closing_in(lambda t: t if t > 0.5 else None, lambda t: t - 0.4, -0.4, 0.6)
    assert [place > 0.5 for place, _, _ in found] in ([], [True])


def test_the_least_is_found_though_some_places_have_no_point() -> None:
    least = least_between(
        lambda t: t if t < 2.0 else None, lambda t: (t - 0.3) ** 2, 0.0, 3.0, 1e-9, 200, 9.0
    )
    assert least == pytest.approx(0.3, abs=1e-7)


def test_points_are_put_between_until_they_are_dense_enough() -> None:
    found = dense_between(0.0, 1.0, 9, lambda a, b, _: (0.5 * (a + b), b - a < 0.3 or a > 0.5))
    assert found == sorted(found)
    assert found == [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875]
    assert len(dense_between(0.0, 1.0, 3, lambda a, b, _: (0.5 * (a + b), False))) == 7


@pytest.mark.parametrize("bound", [-5.0, 5.0])
def test_how_far_something_holds(bound: float) -> None:
    assert level_up_to(lambda z: abs(z - 1.0) <= 2.25, 1.0, bound, 0.1, 1e-12) == pytest.approx(
        1.0 + math.copysign(2.25, bound), abs=1e-11
    )
    assert level_up_to(lambda _z: True, 1.0, bound, 0.1, 1e-12) == bound
