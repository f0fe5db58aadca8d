"""A law in space of one file: a pad that grips along two tangents, each with its own limit, on a soft base.

Time marching of its parts and the eigenvalues of the gripped structure are the referees; neither knows the
kernel.
"""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from body_scenes import block_in_space
from contact_cases import central_difference
from law_cases import Element, evaluate, jacobian

import optim
import solver
from solver.contacts.fields import Between, Positive, Real
from solver.contacts.kernels import columns
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.stick_slip_events import FAILED, SLIPPING, STUCK, piece_of
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import Follows, LawQuantity, RestStiffness, Row, Slider
from solver.contacts.laws.law_registry import register, unregister
from solver.contacts.pieces.line import friction_pieces, polynomial_pieces
from solver.contacts.pieces.piece import ContactPart
from solver.jit.fourier import Integer
from solver.jit.lapack import fill_block
from solver.jit.separate import apart
from solver.linear.assembly import linear_model

K, LIMIT, BASE = columns.OWN, columns.OWN + 1, columns.OWN + 2
HZ, HARMONICS = 230.0, 15


@apart
def pad(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,  # noqa: ARG001
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """An elastic Coulomb element along each tangent, a spring along the normal."""
    n, stuck, piece = U.shape[1], True, 0
    force, block, by_k, by_mu = np.empty(n), np.empty((n, n)), np.empty(n), np.empty(n)
    own, by_load = np.zeros(load.size), np.empty((n, load.size))
    own[0] = row[LIMIT]
    for i in range(9):
        fill_block(dF_dU[i], 0.0)
    for a in range(2):
        state, count = contact_force(
            U[a], ks, own, load_ks, row[K], 1.0, cos_table, sin_table, segments, block, by_k, by_mu, by_load,
            force,
        )  # fmt: skip
        if state == FAILED:
            return FAILED, piece
        stuck = stuck and state == STUCK
        piece = (1_000_003 * piece + piece_of(segments, count)) & 0xFFFFFFFFFF
        for i in range(n):
            F[a, i] = force[i]
            dF_dp[a, i] = slope[K] * by_k[i] + slope[LIMIT] * by_load[i, 0]
            for j in range(n):
                dF_dU[4 * a, i, j] = block[i, j]
    for i in range(n):
        F[2, i], dF_dp[2, i], dF_dU[8, i, i] = row[BASE] * U[2, i], slope[BASE] * U[2, i], row[BASE]
    return (STUCK if stuck else SLIPPING), piece


class PadContact(AnyContact):
    """A pad between two bodies.

    Attributes
    ----------
    k : float
        Stiffness along each tangent while it grips [N/m].
    limit : float
        Force along a tangent at which it slips [N].
    base : float
        Stiffness along the normal [N/m].
    """

    LAW: ClassVar[str] = "pad"
    FORCE: ClassVar[str] = (
        "a spring `k` with a slider `limit` along each tangent, `base · v` along the normal"
    )
    KERNEL: ClassVar[str] = "test_a_law_in_space:pad"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        "k": LawQuantity(column=K, unit="N/m", least=0.0),
        "limit": LawQuantity(column=LIMIT, unit="N", least=0.0),
        "base": LawQuantity(column=BASE, unit="N/m", least=0.0),
    }
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "between_second", "normal_between")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("between_second", "normal_between")
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(K), RestStiffness(K), RestStiffness(BASE))
    RUBBING: ClassVar[tuple[int, ...]] = (0, 1)

    law: Literal["pad"]
    between_second: Between | None = None
    normal_between: Between | None = None
    k: Positive
    limit: Positive
    base: Positive

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        return (self.k, self.k, self.base)

    @property
    def keeps_together(self) -> bool:
        return True

    def rows(self) -> tuple[Row, ...]:
        grips = [
            Row(name=f"{self.name} ({a})", port=a, kt=self.k, mu=1.0, N0=self.limit) for a in self.RUBBING
        ]
        spring = Row(
            name=f"{self.name} (base)", port=2, follows=Follows.POLYNOMIAL, kt=self.base, powers=(self.base,)
        )
        return (*grips, spring)

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...]:
        del load
        slider, limit = Slider(kt=self.k, mu=1.0), np.array([self.limit, 0.0, 0.0])
        grips = [ContactPart((a,), friction_pieces(slider, motions[a], limit)) for a in self.RUBBING]
        return (*grips, ContactPart((2,), polynomial_pieces(motions[2], (self.base,))))


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    register(PadContact)
    yield
    unregister(PadContact)


def scene(limit: float = 6.0) -> solver.Scene:
    """The block between two masses, each face on pads, which move alike as one group."""
    raw: dict[str, Any] = block_in_space()
    for contact in raw["contacts"]:
        for key in ("kt", "mu", "N0"):
            contact.pop(key)
        contact |= {"law": "pad", "group": "pads", "k": 2e5, "limit": limit, "base": 4e5}
    return solver.Scene.from_dict(raw)


def test_the_kernel_has_the_derivatives_of_its_force() -> None:
    row = np.zeros(columns.COLUMNS)
    row[K], row[LIMIT], row[BASE] = 2.0, 0.9, 1.5
    element = Element(law=PadContact.KERNEL, U=np.random.default_rng(4).normal(size=(3, 7)), row=row)
    here = evaluate(element)

    def moved(U: np.ndarray, row: np.ndarray) -> np.ndarray:
        found = evaluate(Element(law=PadContact.KERNEL, U=U, row=row))
        assert found.piece == here.piece
        return found.F.ravel()

    assert here.state == SLIPPING
    for i, unit in enumerate(np.eye(21)):
        way = unit.reshape(3, 7)
        slope = central_difference(lambda x, d=way: moved(element.U + x * d, row), 1e-6)
        assert jacobian(here)[:, i] == pytest.approx(slope, abs=1e-8)
    for column in (K, LIMIT, BASE):
        unit = np.eye(columns.COLUMNS)[column]
        slope = central_difference(lambda x, d=unit: moved(element.U, row + x * d), 1e-6)
        assert evaluate(element, slope=unit).dF_dp.ravel() == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize("limit", [1.0, 6.0])
def test_the_balance_is_what_marching_its_parts_gives(limit: float) -> None:
    found = solver.solve(scene(limit), frequency_hz=HZ, harmonics=HARMONICS)
    referee = solver.march(scene(limit), frequency_hz=HZ)
    assert found.converged
    assert referee.converged
    assert len(referee.contacts) == 12
    assert found.contacts[0].state.name == "SLIPPING"
    assert found.half_peak_to_peak == pytest.approx(referee.half_peak_to_peak, rel=1e-3)


@pytest.mark.parametrize("path", ["pads.limit", "pads.k", "a0.base"])
def test_its_parameters_have_gradients_and_sweeps(path: str) -> None:
    def amplitude(value: float) -> float:
        changed = scene().with_values({path: value})
        return solver.solve(changed, frequency_hz=HZ, harmonics=HARMONICS).max_abs

    value, step = scene().value(path), 1e-5 * scene().value(path)
    branch = solver.sweep(scene(), start=HZ, stop=HZ + 2.0, harmonics=HARMONICS)
    slopes = solver.Sensitivities(branch.balance, [path])
    gradient = slopes.gradient(branch.solutions[0], HZ).by_parameters[0]
    difference = (amplitude(value + step) - amplitude(value - step)) / (2.0 * step)
    assert gradient == pytest.approx(difference, rel=1e-4)
    along = solver.sweep(scene(), path, frequency_hz=HZ, start=value, stop=1.3 * value, harmonics=HARMONICS)
    assert along.amplitude[-1] == pytest.approx(amplitude(1.3 * value), rel=1e-6)


@pytest.mark.long
def test_its_limit_is_designed() -> None:
    found = optim.design(scene(), variables={"pads.limit": (0.5, 60.0)}, harmonics=3)
    assert found.reached, found.status
    best = found.optimum["pads.limit"]

    def peak(limit: float) -> float:
        return solver.sweep(scene(limit), harmonics=3).peak.value

    assert found.peak.value == pytest.approx(peak(best), rel=1e-6)
    assert found.peak.value <= min(peak(factor * best) for factor in (0.8, 0.98, 1.02, 1.3))


def test_its_multipliers_are_those_of_springs_where_it_grips() -> None:
    gripped = scene(limit=1e6)
    judged = solver.stability(solver.solve(gripped, frequency_hz=HZ, harmonics=3))
    model = linear_model(gripped)
    K0, C, M = (each[0] for each in model.at(np.zeros(1, np.int64), np.zeros(1, np.bool_)))
    L = model.contact_here
    held = K0 + L.T @ (np.concatenate([each.stiffnesses for each in gripped.contacts])[:, None] * L)
    inverse, n = np.linalg.inv(M), len(M)
    generator = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ held, -inverse @ C]])
    slowest = float(np.linalg.eigvals(generator).real.max())
    assert judged.radius == pytest.approx(np.exp(slowest / HZ), rel=1e-6)
    assert judged.stable


def test_it_is_stable_where_it_slips() -> None:
    judged = solver.stability(solver.solve(scene(), frequency_hz=HZ, harmonics=HARMONICS))
    assert judged.stable
    assert judged.radius < 1.0
