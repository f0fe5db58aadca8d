"""A law from outside the package: Iwan's element, springs with sliders side by side whose limits rise evenly.

W. D. Iwan, J. Appl. Mech. 33 (1966) 893, doi:10.1115/1.3625199, with `SLIDERS` of them: together they have
the stiffness `k`, and the force `limit` where all slip. The force rounds off from one to the other.
"""

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np

from solver.contacts.fields import Positive, Real
from solver.contacts.kernels import columns
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.stick_slip_events import FAILED, SLIPPING, STUCK, piece_of
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import LawQuantity, RestStiffness, Row, Slider
from solver.jit.fourier import Integer
from solver.jit.lapack import fill_block
from solver.jit.separate import apart

SLIDERS = 5
K, LIMIT = columns.OWN, columns.OWN + 1


@apart
def sliders(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,  # noqa: ARG001
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Add up the sliders, each an elastic Coulomb element under a constant load."""
    n = U.shape[1]
    force, jacobian, by_k, by_mu = np.empty(n), np.empty((n, n)), np.empty(n), np.empty(n)
    own, by_load = np.zeros(load.size), np.empty((n, load.size))
    fill_block(F, 0.0)
    fill_block(dF_dU[0], 0.0)
    fill_block(dF_dp, 0.0)
    stuck, piece = True, 0
    for i in range(SLIDERS):
        share = (2 * i + 1) / SLIDERS**2
        own[0] = share * row[LIMIT]
        state, count = contact_force(
            U[0], ks, own, load_ks, row[K] / SLIDERS, 1.0, cos_table, sin_table, segments, jacobian, by_k,
            by_mu, by_load, force,
        )  # fmt: skip
        if state == FAILED:
            return FAILED, piece
        stuck = stuck and state == STUCK
        piece = (1_000_003 * piece + piece_of(segments, count)) & 0xFFFFFFFFFF
        for a in range(n):
            F[0, a] += force[a]
            dF_dp[0, a] += slope[K] / SLIDERS * by_k[a] + share * slope[LIMIT] * by_load[a, 0]
            for b in range(n):
                dF_dU[0, a, b] += jacobian[a, b]
    return (STUCK if stuck else SLIPPING), piece


class SlidersContact(AnyContact):
    """A joint that slips little by little, Iwan's element.

    Attributes
    ----------
    k : float
        Stiffness while nothing slips [N/m].
    limit : float
        Force at which all of it slips [N].
    """

    LAW: ClassVar[str] = "sliders"
    FORCE: ClassVar[str] = f"{SLIDERS} springs `k / {SLIDERS}`, each with a slider; all slip at `limit`"
    KERNEL: ClassVar[str] = "sliders:sliders"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        "k": LawQuantity(column=K, unit="N/m", least=0.0, wanted="must be a number > 0 and <= 1e15 [N/m]"),
        "limit": LawQuantity(
            column=LIMIT, unit="N", least=0.0, wanted="must be a number > 0 and <= 1e15 [N]"
        ),
    }
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(K),)
    RUBBING: ClassVar[tuple[int, ...]] = (0,)

    law: Literal["sliders"]
    k: Positive
    limit: Positive

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        return (self.k,)

    @property
    def keeps_together(self) -> bool:
        return True

    @property
    def evaluation(self) -> str:
        return f"{SLIDERS} sliders side by side: closed form"

    @property
    def limits(self) -> tuple[float, ...]:
        """The limit of each slider [N]."""
        return tuple(self.limit * (2 * i + 1) / SLIDERS**2 for i in range(SLIDERS))

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        from solver.contacts.pieces.line import force_by_segments

        del load
        slider = Slider(kt=self.k / SLIDERS, mu=1.0)
        loads = [np.array([limit, 0.0, 0.0]) for limit in self.limits]
        return sum(force_by_segments(slider, motions[0], load, tau) for load in loads)

    def rows(self) -> tuple[Row, ...]:
        return tuple(
            Row(name=f"{self.name} ({i + 1})", kt=self.k / SLIDERS, mu=1.0, N0=limit)
            for i, limit in enumerate(self.limits)
        )
