"""Friction in two directions at the edges of its pieces: dips of the rate of slip, begins of contact."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from space_elements import (
    Element,
    evaluate,
    gradient,
    random_direction,
    random_elements,
    row_of,
    second,
)
from space_referee import Contact, friction

from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.stick_slip_events import LIFTING, SLIPPING
from solver.jit import fourier

SHARES = ((1.0, 8.0 / 12.0), (-1.0, -8.0 / 12.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0))  # of a difference


def integrated(element: Element) -> np.ndarray:
    row = element.row
    return friction(
        Contact(k1=row[KT], k2=row[KT_SECOND], mu=row[MU], kn=row[KN], U=element.U, load=element.load)
    )


def behind_dips(seed: int, count: int) -> Iterator[Element]:
    """Motions about that of a contact of `platform-wedge` with 4.5 g at 317.5 Hz, in N and µm.

    Its rate of slip dips at 4.02 and falls below zero at 4.26 rad. It moves across the face too.
    """
    u = [96.49367, -4.64098, -33.21144, 9.056336, -1.574839, 2.495399, -1.115396, 0.710389, 0.3903933]
    v = [5.085705, 1.009546, -1.14854, -0.6224295, 0.07674498, -0.1095588, 0.07463083, -0.05050278]
    U = np.zeros((3, 11))
    U[0], U[2, :8] = [*u, -0.4257518, -0.9911092], v
    U[2, 8:] = [-0.02700998, 0.09741692, 0.06651671]
    decay = np.r_[1.0, np.repeat(np.arange(1.0, 6.0) ** -1.5, 2)]
    rng = np.random.default_rng(seed)
    for _ in range(count):
        size = 10.0 ** rng.uniform(-4.0, -1.5)
        moved = U + size * np.abs(U).max(axis=1, keepdims=True) * rng.normal(size=U.shape) * decay
        moved[1] = rng.normal(size=11) * decay * 30.0
        row = row_of(10.0, 10.0 * 10.0 ** rng.uniform(-0.3, 0.3), 0.3, 15.0)
        yield Element(U=moved, load=np.zeros(3), row=row)


@pytest.mark.parametrize("count", [2, pytest.param(8, marks=pytest.mark.long)])
def test_slopes_behind_a_dip_are_those_of_the_integrated_law(count: int) -> None:
    """Differences of the law integrated in time: nothing of the kernels is in them."""
    rng, compared = np.random.default_rng(4), 0
    for element in behind_dips(0, count):
        direction = replace(random_direction(rng, element), load=np.zeros(3))
        step, here = 1e-6, evaluate(element, slope=direction.row)
        above, below = (element.moved(share * step, direction) for share in (1.0, -1.0))
        if {evaluate(above).piece, evaluate(below).piece} != {here.piece}:
            continue
        crude = (integrated(above) - integrated(below)) / (2.0 * step)
        exact = (here.jacobian @ direction.U.ravel()).reshape(element.U.shape) + here.dF_dp
        np.testing.assert_allclose(exact[:2], crude, rtol=0.0, atol=1e-6 * np.abs(exact).max())
        compared += 1
    assert compared >= count // 2


def test_second_derivatives_behind_a_dip_are_differences_of_slopes() -> None:
    rng, compared = np.random.default_rng(5), 0
    for element in behind_dips(1, 30):
        w, direction = rng.normal(size=element.U.shape), random_direction(rng, element)
        (_, piece), exact, errors = gradient(element, w), second(element, w, direction), []
        for step in (1e-4, 1e-5, 1e-6):
            at = [gradient(element.moved(share * step, direction), w) for share, _ in SHARES]
            if all(each == piece for _, each in at):
                crude = sum(weight * each for (each, _), (_, weight) in zip(at, SHARES, strict=True)) / step
                errors.append(np.abs(crude - exact).max() / np.abs(exact).max())
        if errors:
            assert min(errors) < 1e-5
            assert evaluate(element).state == SLIPPING
            compared += 1
    assert compared >= 20


def contact_begins(element: Element) -> np.ndarray:
    """Times at which a contact closes, read off its normal force on a fine grid [rad]."""
    tau = np.linspace(0.0, 2.0 * math.pi, 20001)
    top = (element.U.shape[1] - 1) // 2
    normal = element.row[KN] * fourier.basis(tau, top) @ element.U[2] + fourier.basis(tau, 1) @ element.load
    at = np.flatnonzero((normal[:-1] <= 0.0) & (normal[1:] > 0.0))
    low, high = normal[at], normal[at + 1]
    times: np.ndarray = tau[at] + (tau[1] - tau[0]) * low / (low - high)
    return times


def at_the_margin(element: Element, tau: float, share: float) -> Element:
    """The stiffness with which the rate of the elastic force is `share` times that of the limit at τ."""
    top = (element.U.shape[1] - 1) // 2
    rates = fourier.basis(np.array([tau]), top) @ fourier.derivative(element.U).T
    pressing = fourier.basis(np.array([tau]), 1) @ fourier.derivative(element.load)
    rise = element.row[MU] * (element.row[KN] * rates[0, 2] + pressing[0])
    row = element.row.copy()
    row[[KT, KT_SECOND]] *= share * rise / math.hypot(row[KT] * rates[0, 0], row[KT_SECOND] * rates[0, 1])
    return replace(element, row=row)


@pytest.mark.parametrize("count", [15, pytest.param(60, marks=pytest.mark.long)])
def test_contact_begins_at_the_margin_of_stick_and_slip(count: int) -> None:
    """The force rises as fast as the limit where contact begins: neither stick nor slip lasts."""
    rng, margins, truths = np.random.default_rng(6), 0, 0
    for element in random_elements(21, count, top=4):
        if evaluate(element).state != LIFTING:
            continue
        for tau in contact_begins(element):
            for share in (1.0, 1.0 + 1e-12, 1.0 - 1e-12, 1.0 + 1e-9, 1.0 - 1e-9, 1.0 + 1e-6, 1.0 - 1e-6):
                margin = at_the_margin(element, float(tau), share)
                here = evaluate(margin)
                assert here.state == LIFTING
                assert np.isfinite(here.jacobian).all()
                w, direction = rng.normal(size=margin.U.shape), random_direction(rng, margin)
                assert np.isfinite(second(margin, w, direction)).all()
                margins += 1
            if truths < count // 15:
                margin = at_the_margin(element, float(tau), 1.0)
                truth, here = integrated(margin), evaluate(margin)
                np.testing.assert_allclose(here.F[:2], truth, rtol=0.0, atol=1e-7 * np.abs(truth).max())
                truths += 1
    assert margins >= count // 2
    assert truths == count // 15
