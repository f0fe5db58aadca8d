"""Contact laws beside Coulomb with a given load: brute force, every derivative, limits, symmetries."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import Case, crude_force, values
from contact_cases import evaluate as coulomb
from law_cases import (
    COULOMB_BOX,
    COULOMB_CIRCLE,
    ELASTIC_NORMAL,
    GAP_SPRING,
    POLYNOMIAL,
    Element,
    derivative_errors,
    evaluate,
    row_of,
)

from solver.contacts.kernels import columns
from solver.contacts.kernels.stick_slip_events import FAILED, LIFTING, SEPARATED, SLIPPING, STUCK
from solver.jit import fourier

Random = np.random.Generator
FINE = 2**15


def motion(rng: Random, H: int, size: float = 1.0) -> np.ndarray:
    decay = np.repeat(np.arange(1, H + 1.0) ** -rng.uniform(0.5, 3.0), 2)
    return size * np.concatenate([[rng.normal()], rng.normal(size=2 * H) * decay])


def pair(rng: Random, H: int) -> np.ndarray:
    sizes = 10.0 ** rng.uniform(-1.0, 1.5), 10.0 ** rng.uniform(-1.0, 1.0)
    return np.stack([motion(rng, H, size) for size in sizes])


def given_load(rng: Random) -> np.ndarray:
    return np.concatenate([[1.0], rng.uniform(0.0, 1.0) * rng.normal(size=2)])


def elastic_normal(rng: Random, H: int) -> Element:
    load = np.concatenate([[rng.normal() + 0.5], 0.5 * rng.normal(size=2)])
    row = row_of(KT=10.0 ** rng.uniform(-1, 2), MU=rng.uniform(0.1, 1.0), KN=10.0 ** rng.uniform(-1.5, 0.5),
                 PRESTRESSED=float(rng.integers(0, 2)))  # fmt: skip
    return Element(law=ELASTIC_NORMAL, U=pair(rng, H), load=load, row=row)


def gap_spring(rng: Random, H: int) -> Element:
    row = row_of(K_GAP=10.0 ** rng.uniform(-1, 3), GAP=1.5 * rng.normal())
    return Element(law=GAP_SPRING, U=motion(rng, H)[None], row=row)


def polynomial(rng: Random, H: int) -> Element:
    row = row_of()
    row[columns.A_1 : columns.A_1 + columns.MOST_DEGREE] = rng.normal(size=columns.MOST_DEGREE) * (
        rng.uniform(size=columns.MOST_DEGREE) < 0.4
    )
    row[columns.A_1] += 0.1
    return Element(law=POLYNOMIAL, U=motion(rng, H, 0.5)[None], row=row)


def planar(law: str) -> Callable[[Random, int], Element]:
    def make(rng: Random, H: int) -> Element:
        row = row_of(KT=10.0 ** rng.uniform(-1, 1), MU=rng.uniform(0.1, 1.0), KT_SECOND=math.nan)
        return Element(law=law, U=pair(rng, H), load=given_load(rng), row=row)

    return make


LAWS = {
    "elastic-normal": (elastic_normal, ("KT", "MU", "KN"), (SEPARATED, SLIPPING, LIFTING)),
    "gap": (gap_spring, ("K_GAP", "GAP"), (SEPARATED, columns.CLOSED, columns.TOUCHING)),
    "polynomial": (polynomial, ("A_1",), (columns.DEFORMING,)),
    "box": (planar(COULOMB_BOX), ("KT", "MU"), (STUCK, SLIPPING, LIFTING)),
    "plane": (planar(COULOMB_CIRCLE), ("KT", "MU"), (STUCK, SLIPPING, LIFTING)),
}


@pytest.mark.parametrize("law", LAWS)
def test_every_derivative(law: str):
    make, names, states = LAWS[law]
    rng = np.random.default_rng(11)
    seen: Counter[int] = Counter()
    for _ in range(60):
        element = make(rng, int(rng.integers(1, 9)))
        # One event may be so near a corner that the differences, not the derivatives, lose digits; a circle
        # is exact to 1e-9 of its force, of which a small step makes more.
        steps = (1e-4, 1e-5, 1e-6) if law == "plane" else (1e-6,)
        errors: list[float] = []
        for step in steps:
            if (found := derivative_errors(element, names, step)) is not None:
                errors.append(max(found.values()))
                if errors[-1] < 2e-5:
                    break
        if errors:
            seen[evaluate(element).state] += 1
            assert errors[-1] < 2e-5, errors
    assert min(seen[state] for state in states) >= 2, seen
    assert sum(seen.values()) >= 40


def test_derivatives_by_every_coefficient():
    rng = np.random.default_rng(5)
    element = polynomial(rng, 4)
    for j in range(columns.MOST_DEGREE):
        slope = np.zeros(columns.COLUMNS)
        slope[columns.A_1 + j] = 1.0
        exact = evaluate(element, slope=slope).dF_dp[0]
        np.testing.assert_allclose(exact, project(element.U[0], lambda u, j=j: u ** (j + 1)), atol=1e-12)


def project(U: np.ndarray, force: Callable[[np.ndarray], np.ndarray], samples: int = FINE) -> np.ndarray:
    """Fourier coefficients of a function of the motion, from a fine grid."""
    H = (U.size - 1) // 2
    tau = 2.0 * np.pi / samples * np.arange(samples)
    spectrum = np.fft.rfft(force(values(U, tau)))[: H + 1] * 2.0 / samples
    F = fourier.to_real(spectrum)
    F[0] *= 0.5
    return F


def test_gap_against_brute_force():
    rng = np.random.default_rng(1)
    for _ in range(40):
        element = gap_spring(rng, int(rng.integers(1, 12)))
        k, gap = element.row[columns.K_GAP], element.row[columns.GAP]
        crude = project(element.U[0], lambda u, k=k, gap=gap: k * np.maximum(u - gap, 0.0))
        # The grid misses where the spring begins by up to a sample: an error of second order.
        np.testing.assert_allclose(evaluate(element).F[0], crude, atol=2e-6 * k * np.abs(element.U).sum())


def test_polynomial_against_brute_force():
    rng = np.random.default_rng(2)
    for _ in range(40):
        element = polynomial(rng, int(rng.integers(1, 12)))
        a = element.row[columns.A_1 :]
        crude = project(element.U[0], lambda u, a=a: np.polyval([*a[::-1], 0.0], u), 4096)
        np.testing.assert_allclose(evaluate(element).F[0], crude, atol=1e-13 * max(1.0, np.abs(crude).max()))


def test_elastic_normal_against_brute_force():
    rng = np.random.default_rng(3)
    seen: Counter[int] = Counter()
    for _ in range(60):
        element = elastic_normal(rng, int(rng.integers(1, 9)))
        row = element.row
        N = row[columns.KN] * element.U[1]
        N[:3] += element.load
        case = Case(U=element.U[0], N=N, kt=row[columns.KT], mu=row[columns.MU])
        answer = evaluate(element)
        seen[answer.state] += 1
        assert answer.state != FAILED
        coarse, fine = crude_force(case, 2**12), crude_force(case, 2**14)
        size = row[columns.MU] * np.abs(N).sum()
        assert np.abs(answer.F[0] - fine).max() <= np.abs(fine - coarse).max() + 1e-6 * size
        normal = project(N, lambda load: np.maximum(load, 0.0))
        normal[0] -= max(element.load[0], 0.0) * row[columns.PRESTRESSED]
        np.testing.assert_allclose(answer.F[1], normal, atol=2e-6 * np.abs(N).sum())
    assert min(seen[state] for state in (SEPARATED, SLIPPING, LIFTING)) >= 3


def sampled_return(u: np.ndarray, limit: np.ndarray, kt: float, periods: int) -> np.ndarray:
    """The law of the circular limit, sample after sample, in plain complex numbers."""
    w = u[0] + 1j * u[1]
    T, kept = 0.0, np.zeros(w.size, complex)
    before = 0.0
    for _ in range(periods):
        for j, now in enumerate(w):
            T = T + kt * (now - before)
            T = T * min(1.0, limit[j] / abs(T)) if T else T
            before, kept[j] = now, T
    return np.stack([kept.real, kept.imag])


def plane_reference(element: Element, samples: int, periods: int = 60) -> np.ndarray:
    tau = 2.0 * np.pi / samples * np.arange(samples)
    u = np.stack([values(q, tau) for q in element.U])
    limit = element.row[columns.MU] * np.maximum(values(element.load, tau), 0.0)
    T = sampled_return(u, limit, element.row[columns.KT], periods)
    H = (element.U.shape[1] - 1) // 2
    F = fourier.to_real(np.fft.rfft(T)[:, : H + 1] * 2.0 / samples)
    F[:, 0] *= 0.5
    return F


def test_circular_limit_against_plain_return_mapping():
    """The plain return map is of first order, so the reference is extrapolated from two step sizes."""
    rng = np.random.default_rng(4)
    seen: Counter[int] = Counter()
    for _ in range(8):
        element = planar(COULOMB_CIRCLE)(rng, int(rng.integers(1, 4)))
        answer = evaluate(element)
        seen[answer.state] += 1
        coarse, fine = (plane_reference(element, samples, 6) for samples in (2**12, 2**13))
        scale = np.abs(fine).max()
        np.testing.assert_allclose(answer.F, 2.0 * fine - coarse, atol=3e-4 * scale + 1e-12)
    assert seen[SLIPPING] + seen[LIFTING] >= 4


def test_circular_limit_turns_with_the_motion():
    rng = np.random.default_rng(7)
    element = planar(COULOMB_CIRCLE)(rng, 5)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    turned = evaluate(replace(element, U=turn @ element.U)).F
    straight = evaluate(element).F
    np.testing.assert_allclose(turned, turn @ straight, atol=1e-10 * np.abs(straight).max())


def test_both_limits_agree_in_one_direction():
    """Motion along one axis only: circle and square are the same law."""
    rng = np.random.default_rng(8)
    box = planar(COULOMB_BOX)(rng, 4)
    row = row_of(KT=2.0, MU=0.5, KT_SECOND=math.nan)
    box = replace(
        box, U=np.stack([motion(rng, 4, 2.0), np.zeros(9)]), row=row, load=np.array([1.0, 0.4, 0.0])
    )
    plane = evaluate(replace(box, law=COULOMB_CIRCLE))
    exact = evaluate(box)
    assert exact.state == plane.state == SLIPPING
    np.testing.assert_allclose(plane.F, exact.F, atol=1e-5 * np.abs(exact.F).max())


def test_square_limit_is_two_contacts():
    element = planar(COULOMB_BOX)(np.random.default_rng(9), 6)
    answer = evaluate(element)
    for a in range(2):
        one = coulomb(
            Case(U=element.U[a], N=element.load, kt=element.row[columns.KT], mu=element.row[columns.MU])
        )
        np.testing.assert_allclose(answer.F[a], one.F, rtol=0.0, atol=1e-14 * np.abs(one.F).max())
        np.testing.assert_allclose(
            answer.dF_dU[3 * a], one.dF_dU, rtol=0.0, atol=1e-13 * np.abs(one.dF_dU).max()
        )
    assert not answer.dF_dU[1:3].any()


def test_rigid_load_is_coulomb():
    """Without normal stiffness the elastic-normal law is Coulomb with a given load."""
    element = elastic_normal(np.random.default_rng(10), 6)
    row = element.row.copy()
    row[columns.KN] = 0.0
    element = replace(element, row=row, load=np.array([1.0, 1.3, -0.2]))
    one = coulomb(Case(U=element.U[0], N=element.load, kt=row[columns.KT], mu=row[columns.MU]))
    np.testing.assert_allclose(evaluate(element).F[0], one.F, rtol=0.0, atol=1e-13 * np.abs(one.F).max())
    np.testing.assert_allclose(
        evaluate(element).dF_dU[0], one.dF_dU, rtol=0.0, atol=1e-12 * np.abs(one.dF_dU).max()
    )


def test_friction_that_never_opens_has_a_linear_normal_spring():
    element = elastic_normal(np.random.default_rng(12), 6)
    kn = element.row[columns.KN]
    element = replace(element, load=np.array([100.0 * kn * np.abs(element.U[1]).sum(), 0.0, 0.0]))
    answer = evaluate(element)
    expected = kn * element.U[1]
    expected[0] += element.load[0] * (1.0 - element.row[columns.PRESTRESSED])
    np.testing.assert_allclose(answer.F[1], expected, rtol=1e-12, atol=1e-12 * element.load[0])
    np.testing.assert_allclose(answer.dF_dU[3], kn * np.eye(13), atol=1e-13)


@pytest.mark.parametrize("law", [ELASTIC_NORMAL, COULOMB_BOX])
def test_a_contact_without_friction_that_does_not_slide_opens(law: str):
    """Its normal force is max(N, 0), by the trapezoidal rule on a fine grid."""
    H, ports = 5, 2 if law == ELASTIC_NORMAL else 3
    U = np.zeros((ports, 2 * H + 1))
    U[-1, 1:5] = 3.0, 0.0, 0.4, -0.7
    element = Element(law=law, U=U, load=np.array([1.0, 0.0, 0.0]), row=row_of(KT=2.0, KT_SECOND=2.0, KN=1.0))
    tau = 2.0 * np.pi / FINE * np.arange(FINE)
    basis = fourier.basis(tau, H)
    expected = basis.T @ np.maximum(1.0 + basis @ U[-1], 0.0) * (2.0 / FINE)
    expected[0] *= 0.5
    answer = evaluate(element)
    assert answer.state == LIFTING
    assert not answer.F[:-1].any()
    np.testing.assert_allclose(answer.F[-1], expected, atol=1e-7)


@pytest.mark.parametrize("law", ["gap", "elastic-normal"])
def test_both_sides_of_grazing(law: str):
    """The motion just reaches the gap, or the load just reaches 0: force continuous, derivatives exact."""
    H = 3
    U = np.zeros(2 * H + 1)
    U[1], U[5] = 1.0, 0.1  # largest value 1.1 at τ = 0
    forces = []
    for distance in (-1e-3, -1e-9, 1e-9, 1e-3):
        if law == "gap":
            element = Element(law=GAP_SPRING, U=U[None], row=row_of(K_GAP=7.0, GAP=1.1 - distance))
            names: tuple[str, ...] = ("K_GAP", "GAP")
            reached, open_state, touching = 7.0 * max(distance, 0.0), SEPARATED, columns.TOUCHING
        else:
            u = np.zeros(2 * H + 1)
            u[2] = 3.0
            element = Element(
                law=ELASTIC_NORMAL, U=np.stack([u, U]), load=np.array([-1.1 + distance, 0.0, 0.0]),
                row=row_of(KT=5.0, MU=0.4, KN=1.0),
            )  # fmt: skip
            names = ("KT", "MU", "KN")
            reached, open_state, touching = max(distance, 0.0), SEPARATED, LIFTING
        answer = evaluate(element)
        assert answer.state == (touching if distance > 0.0 else open_state)
        assert np.abs(answer.F).max() <= reached
        forces.append(answer.F)
        if abs(distance) > 1e-6:
            errors = derivative_errors(element, names, 1e-6)
            assert errors is not None
            assert max(errors.values()) < 1e-5
    np.testing.assert_allclose(forces[1], forces[2], atol=1e-8)
    assert np.abs(forces[3]).max() > 1e-6


def test_a_gap_reached_between_grid_points():
    """A narrow top between two points of the bracketing grid still touches."""
    H = 8
    place = np.pi / 96.0 * 1.0  # half a grid cell of 96 points
    ks = np.arange(1, H + 1)
    U = np.concatenate([[0.0], np.stack([np.cos(ks * place), np.sin(ks * place)], axis=1).reshape(-1)])
    element = Element(law=GAP_SPRING, U=U[None], row=row_of(K_GAP=1.0, GAP=H - 1e-6))
    answer = evaluate(element)
    assert answer.state == columns.TOUCHING
    tau = place + np.linspace(-1e-2, 1e-2, 200_001)
    area = np.maximum(values(U, tau) - (H - 1e-6), 0.0).sum() * (tau[1] - tau[0])
    assert answer.F[0, 0] == pytest.approx(area / (2.0 * np.pi), rel=1e-6)


@pytest.mark.parametrize("law", ["polynomial", "box"])
def test_odd_harmonics_alone(law: str):
    """Odd motion under an odd law: the odd harmonics alone give what all of them give."""
    H, rng = 7, np.random.default_rng(13)
    ks = np.arange(1, H + 1, 2)
    m = 2 if law == "box" else 1
    odd = rng.normal(size=(m, 2 * ks.size))
    row = row_of(KT=2.0, MU=0.5) if law == "box" else row_of(A_1=1.0)
    if law == "polynomial":
        row[columns.A_1 + 2] = 0.3
    kernel = COULOMB_BOX if law == "box" else POLYNOMIAL
    load = np.array([1.0, 0.0, 0.0])
    few = evaluate(Element(law=kernel, U=odd, row=row, load=load, ks=ks))
    full = evaluate(Element(law=kernel, U=fourier.to_full(odd, ks, H), row=row, load=load))
    np.testing.assert_allclose(fourier.to_full(few.F, ks, H), full.F, atol=1e-12)
    for a in range(m):
        spread = fourier.to_full(fourier.to_full(few.dF_dU[3 * a], ks, H).T, ks, H).T
        kept = spread != 0.0
        np.testing.assert_allclose(spread[kept], full.dF_dU[3 * a][kept], atol=1e-11)


def test_an_unknown_law_fails():
    element = gap_spring(np.random.default_rng(0), 3)
    for number in (99, -1, 10**9):
        with pytest.raises(RuntimeError, match="no kernel of call_law has this number"):
            evaluate(replace(element, law=number))
