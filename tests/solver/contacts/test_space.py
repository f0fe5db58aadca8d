"""Friction in two directions under a load that moves: the law, limits, symmetries, every derivative."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, islice, product

import numpy as np
import pytest
from contact_cases import closing_cases
from contact_cases import evaluate as on_a_line
from law_cases import ELASTIC_NORMAL
from law_cases import Element as AnyElement
from law_cases import evaluate as any_law
from law_cases import row_of as any_row
from space_elements import (
    NUMBERS,
    Element,
    balanced,
    evaluate,
    extreme_elements,
    gradient,
    random_direction,
    random_elements,
    row_of,
    second,
)
from space_march import CASES, matrices
from space_referee import Contact, friction

from solver.contacts.kernels import columns
from solver.contacts.kernels.circle.circle_law import coulomb_circle
from solver.contacts.kernels.columns import COLUMNS, KN, KT, KT_SECOND, MU
from solver.contacts.kernels.stick_slip_events import (
    FAILED,
    LIFTING,
    SEPARATED,
    SLIPPING,
    STUCK,
    new_segments,
)
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables


def integrated(element: Element) -> np.ndarray:
    row = element.row
    return friction(
        Contact(k1=row[KT], k2=row[KT_SECOND], mu=row[MU], kn=row[KN], U=element.U, load=element.load)
    )


@pytest.mark.few(2)
@pytest.mark.parametrize(("count", "least"), [(4, 1), (8, 2)])
def test_force_is_that_of_the_integrated_law(count: int, least: int):
    seen: Counter[int] = Counter()
    for element in random_elements(0, count, top=4):
        here = evaluate(element)
        seen[here.state] += 1
        truth = integrated(element)
        np.testing.assert_allclose(here.F[:2], truth, rtol=0.0, atol=1e-8 * np.abs(truth).max())
    assert min(seen[SLIPPING], seen[LIFTING]) >= least, seen


@pytest.mark.long
def test_extremes_are_the_integrated_law_too():
    compared = 0
    for kind, element in extreme_elements(3, 14):
        if kind in ("line", "eight", "soft", "barely") and element.U.shape[1] < 16:
            truth = integrated(element)
            np.testing.assert_allclose(
                evaluate(element).F[:2], truth, rtol=0.0, atol=1e-7 * np.abs(truth).max(), err_msg=kind
            )
            compared += 1
    assert compared >= 4


def test_along_a_line_it_is_the_law_of_a_line_where_a_contact_closes():
    """It sticks or slips at once, or slips within a grid interval; its force is 0 but for rounding."""
    for case in chain(*(islice(closing_cases(np.random.default_rng(seed)), 4) for seed in range(60))):
        for off in (1e-3, -1e-3, 1e-6, -1e-6, 1e-9, -1e-9):
            mu = case.mu * (1.0 + off)
            element = Element(
                U=np.array([case.U, 0.0 * case.U, 0.0 * case.U]), load=case.N, row=row_of(1.0, 1.0, mu, 1.0)
            )
            line = on_a_line(replace(case, mu=mu)).F
            np.testing.assert_allclose(evaluate(element).F[0], line, rtol=0.0, atol=1e-8 * np.abs(line).max())


def test_a_slip_ends_behind_a_dip_of_its_rate():
    """The rate of slip dips at 4.02 and falls below zero at 4.26 rad, in one panel.

    It is a point of `platform-wedge` with 4.5 g at 317.5 Hz, in N and µm.
    """
    u = [96.49367, -4.64098, -33.21144, 9.056336, -1.574839, 2.495399, -1.115396, 0.710389, 0.3903933]
    v = [5.085705, 1.009546, -1.14854, -0.6224295, 0.07674498, -0.1095588, 0.07463083, -0.05050278]
    last = [[-0.4257518, -0.9911092], [-0.02700998, 0.09741692, 0.06651671]]
    U = np.array([[*u, *last[0]], np.zeros(11), [*v, *last[1]]])
    for share in (0.9998, 1.0, 1.0002):
        element = Element(U=share * U, load=np.zeros(3), row=row_of(10.0, 10.0, 0.3, 15.0))
        truth = integrated(element)
        np.testing.assert_allclose(
            evaluate(element).F[:2], truth, rtol=0.0, atol=1e-9 * np.abs(truth).max(), err_msg=str(share)
        )


def test_no_motion_is_too_extreme():
    states: Counter[int] = Counter()
    for kind, element in extreme_elements(1, 350):
        here = evaluate(element)
        assert here.state != FAILED, kind
        assert np.isfinite(here.F).all(), kind
        assert np.isfinite(here.jacobian).all(), kind
        states[here.state] += 1
    assert min(states[state] for state in (STUCK, SLIPPING, LIFTING)) > 25, states


def padded(element: Element, times: int) -> Element:
    """The same motion, written with more harmonics: panels and grid are as much finer."""
    n = times * (element.U.shape[1] - 1) + 1
    return replace(element, U=np.pad(element.U, ((0, 0), (0, n - element.U.shape[1]))))


@pytest.mark.parametrize(("top", "times"), [(2, 64), (11, 12)])
def test_coefficients_are_those_of_many_nodes(top: int, times: int):
    for element in random_elements(7, 10, top=top):
        few, many = evaluate(element), evaluate(padded(element, times))
        n, m = element.U.shape[1], times * (element.U.shape[1] - 1) + 1
        size = np.abs(many.F).max()
        np.testing.assert_allclose(few.F, many.F[:, :n], rtol=0.0, atol=1e-8 * size)
        kept = (np.arange(3)[:, None] * m + np.arange(n)).ravel()
        exact = many.jacobian[np.ix_(kept, kept)]
        np.testing.assert_allclose(few.jacobian, exact, rtol=0.0, atol=1e-6 * np.abs(exact).max())


def difference(element: Element, direction: Element, step: float) -> np.ndarray | None:
    """Derivative of the force along a direction by differences, None across a change of state."""
    at = [evaluate(element.moved(share * step, direction)) for share in (1.0, -1.0, 2.0, -2.0)]
    if any(each.piece != evaluate(element).piece for each in at):
        return None
    return (8.0 * (at[0].F - at[1].F) - (at[2].F - at[3].F)) / (12.0 * step)


def along(element: Element, direction: Element) -> np.ndarray:
    here = evaluate(element, slope=direction.row, dload=direction.load)
    return (here.jacobian @ direction.U.ravel()).reshape(element.U.shape) + here.dF_dp


def directions(element: Element) -> list[Element]:
    """A change of every motion together, and of every number by itself."""
    rng = np.random.default_rng(2)
    still = replace(element, U=np.zeros_like(element.U), load=np.zeros(3), row=np.zeros(COLUMNS))
    found = [replace(random_direction(rng, element), row=np.zeros(COLUMNS), load=np.zeros(3))]
    for column in NUMBERS:
        row = np.zeros(COLUMNS)
        row[column] = element.row[column]
        found.append(replace(still, row=row))
    phase = np.array([0.0, -element.load[2], element.load[1]])
    return [*found, *(replace(still, load=load) for load in (np.eye(3)[0], np.eye(3)[1], phase))]


def worst_slope(element: Element, finer: Sequence[int] = (1,)) -> float | None:
    """Largest error of a derivative, relative to it; None if the law changes its piece nearby.

    Where events are close together differences scatter, by the nodes they are made of: with so many times as
    many of them one of them tells.
    """
    errors, n = [], element.U.shape[1]
    size = np.abs(evaluate(element).F).max()
    for direction in directions(element):
        exact, tried = along(element, direction), []
        for times, step in product(finer, (1e-4, 1e-5, 1e-6)):
            crude = difference(padded(element, times), padded(direction, times), step)
            if crude is not None:
                tried.append(
                    np.abs(crude[:, :n] - exact).max() / max(np.abs(exact).max(), 1e-2 * size, 1e-12)
                )
        if not tried:
            return None
        errors.append(min(tried))
    return max(errors)


@pytest.mark.few(2)
@pytest.mark.parametrize(("count", "least"), [(30, 3), (40, 4)])
def test_every_derivative_in_every_state(count: int, least: int):
    seen: Counter[int] = Counter()
    for element in random_elements(5, count):
        error = worst_slope(element)
        if error is not None:
            assert error < 1e-6
            seen[evaluate(element).state] += 1
    assert min(seen[state] for state in (STUCK, SLIPPING, LIFTING)) >= least, seen


@pytest.mark.long
def test_derivatives_on_both_sides_of_every_change():
    changes = 0
    for element in random_elements(12, 5, top=5):

        def under(factor: float, element: Element = element) -> Element:
            return replace(element, load=factor * element.load)

        factors = np.geomspace(0.05, 50.0, 30)
        pieces = [evaluate(under(factor)).piece for factor in factors]
        for i in np.flatnonzero(np.diff(pieces)):
            low, high = factors[i], factors[i + 1]
            while high / low > 1.0 + 1e-3:
                middle = math.sqrt(low * high)
                low, high = (middle, high) if evaluate(under(middle)).piece == pieces[i] else (low, middle)
            for factor in (low * (1.0 - 1e-3), high * (1.0 + 1e-3)):
                error = worst_slope(under(factor), (1, 12))
                if error is not None:
                    assert error < 1e-6
                    changes += 1
    assert changes >= 20


def test_second_derivatives_in_every_state():
    rng = np.random.default_rng(9)
    seen: Counter[int] = Counter()
    for element in random_elements(6, 12):
        w, direction = rng.normal(size=element.U.shape), random_direction(rng, element)
        here, piece = gradient(element, w)
        exact, errors = second(element, w, direction), []
        for step in (1e-4, 1e-5, 1e-6):
            at = [gradient(element.moved(share * step, direction), w) for share in (1.0, -1.0, 2.0, -2.0)]
            if all(each[1] == piece for each in at):
                crude = (8.0 * (at[0][0] - at[1][0]) - (at[2][0] - at[3][0])) / (12.0 * step)
                errors.append(
                    np.abs(crude - exact).max() / max(np.abs(exact).max(), np.abs(here).max(), 1e-12)
                )
        if errors:
            assert min(errors) < 1e-5
            seen[evaluate(element).state] += 1
    assert min(seen[state] for state in (SLIPPING, LIFTING)) >= 2, seen


def one_direction(element: Element, port: int) -> np.ndarray:
    """Friction and normal force of the law for one direction."""
    row = any_row(KT=element.row[KT if port == 0 else KT_SECOND], MU=element.row[MU], KN=element.row[KN])
    return any_law(AnyElement(law=ELASTIC_NORMAL, U=element.U[[port, 2]], load=element.load, row=row)).F


def test_a_box_is_each_direction_by_itself():
    for element in random_elements(8, 20):
        here = evaluate(replace(element, box=True))
        for port in range(2):
            alone = one_direction(element, port)
            np.testing.assert_allclose(here.F[[port, 2]], alone, atol=1e-12 * np.abs(alone).max())


def test_a_box_has_all_derivatives():
    for element in random_elements(3, 15):
        error = worst_slope(replace(element, box=True))
        assert error is None or error < 1e-6


def test_a_straight_line_is_friction_in_one_direction():
    for element in random_elements(10, 20):
        straight = replace(element, U=element.U * np.array([[1.0], [0.0], [1.0]]))
        alone = one_direction(straight, 0)
        here = evaluate(straight).F
        np.testing.assert_allclose(here[[0, 2]], alone, atol=1e-8 * np.abs(alone).max())
        assert np.abs(here[1]).max() < 1e-12 * np.abs(alone).max()


def test_turned_axes_turn_the_force():
    turn = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
    for element in random_elements(11, 15):
        row = element.row.copy()
        row[KT_SECOND] = row[KT]
        U = element.U.copy()
        U[:2] = turn @ U[:2]
        here, turned = evaluate(replace(element, row=row)).F, evaluate(replace(element, row=row, U=U)).F
        np.testing.assert_allclose(turned[:2], turn @ here[:2], atol=2e-8 * np.abs(here).max())


def test_a_given_load_needs_no_normal_port():
    for element in random_elements(13, 15):
        given = replace(element, U=element.U * np.array([[1.0], [1.0], [0.0]]))
        three, two = evaluate(given), evaluate(replace(given, U=given.U[:2]))
        n = given.U.shape[1]
        np.testing.assert_array_equal(two.F, three.F[:2])
        np.testing.assert_array_equal(two.jacobian, three.jacobian[: 2 * n, : 2 * n])
        assert two.state == three.state


def test_without_friction_only_the_normal_force_is_left():
    for element in random_elements(14, 10):
        row = element.row.copy()
        row[MU] = 0.0
        here = evaluate(replace(element, row=row))
        assert not here.F[:2].any()
        np.testing.assert_allclose(here.F[2], evaluate(element).F[2], atol=1e-12)


def test_a_prestressed_normal_force_leaves_the_preload_out():
    element = next(random_elements(1, 1))
    row = element.row.copy()
    row[columns.PRESTRESSED] = 1.0
    bare, prestressed = evaluate(element).F, evaluate(replace(element, row=row)).F
    assert bare[2, 0] - prestressed[2, 0] == pytest.approx(element.load[0])
    np.testing.assert_array_equal(bare[:2], prestressed[:2])


def test_nothing_presses_nothing_rubs():
    element = next(random_elements(1, 1))
    here = evaluate(replace(element, load=np.array([-100.0, 0.0, 0.0])))
    assert here.state == SEPARATED
    assert not here.F.any()
    assert not here.jacobian.any()


def test_a_motion_that_is_no_number_fails():
    element = next(random_elements(1, 1))
    U = element.U.copy()
    U[0, 1] = np.nan
    assert evaluate(replace(element, U=U)).state == FAILED


@pytest.mark.parametrize("name", CASES)
def test_balance_agrees_with_the_reference(name: str):
    case = CASES[name]
    omega = 2.0 * math.pi * case["frequency_hz"]
    U = balanced(matrices(case["scene"]), omega, case["scene"], harmonics=61)
    x = fourier.basis(np.linspace(0.0, 2.0 * math.pi, 20001), 61) @ U.T
    np.testing.assert_allclose(0.5 * (x.max(axis=0) - x.min(axis=0)), case["half_pp"], rtol=1e-6)
    np.testing.assert_allclose(U[:, 0], case["mean"], atol=1e-7)
    contact = case["scene"]["contacts"][0]
    row = row_of(contact["kt"], contact["kt"], contact["mu"], contact["kn"])
    forces = evaluate(Element(U=U, load=np.array([contact["N0"], 0.0, 0.0]), row=row)).F
    work = (
        2.0
        * math.pi
        * sum(
            0.5 * float(f[1:] @ rate[1:])
            for f, rate in zip(forces[:2], fourier.derivative(U[:2]), strict=True)
        )
    )
    assert work == pytest.approx(case["work"], rel=1e-5)


def test_harmonics_that_are_left_out_are_as_if_they_were_zero():
    """Under a load that is given, odd harmonics may stand alone."""
    rng, odd, top = np.random.default_rng(12), np.array([1, 3, 5]), 5
    tables = grid_tables(grid_size(top), top)
    kept = np.r_[1:3, 5:7, 9:11]
    for _ in range(20):
        U = rng.standard_normal((2, odd.size * 2)) * 2.0
        answers = []
        for motion, ks in ((U, odd), (fourier.to_full(U, odd, top), fourier.all_harmonics(top))):
            n = motion.shape[1]
            F, dF_dU = np.full((2, n), np.nan), np.full((4, n, n), np.nan)
            segments = new_segments(top)
            coulomb_circle(
                motion, ks, np.array([0.8, 0.0, 0.0]), fourier.all_harmonics(1), row_of(2.0, 3.0, 0.2),
                np.zeros(COLUMNS), np.zeros(3), *tables, segments, F, dF_dU, np.empty((2, n)),
            )  # fmt: skip
            answers.append((F, dF_dU))
        np.testing.assert_allclose(answers[0][0], answers[1][0][:, kept], atol=1e-13)
        np.testing.assert_allclose(answers[0][1], answers[1][1][:, kept][:, :, kept], atol=1e-12)
