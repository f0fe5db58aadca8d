"""The law `coulomb-viscous`: elastic Coulomb friction with a dashpot beside its spring, behind the slider.

While it sticks F = kt (u − w) + c u', where w is what the slider has slipped; where that would pass μN it
slips with F = ± μN, and w follows so that F is continuous, kt (u − w) + c u' = F. So the contact damping of
faces that stick is there, and the force never passes the limit, as it would with a dashpot that goes on in
the slip. It is the element without dashpot of the motion u + (c/kt) u', in closed form as that is; the march
follows it by a step of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np

from solver.contacts.fields import NonNegative, Real
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_law import AnyContact, RateContact
from solver.contacts.laws.contact_parts import Follows, LawQuantity, Row, Slider
from solver.contacts.laws.friction import FrictionContact
from solver.contacts.laws.history.function_law import HistoryLaw, LawParameter
from solver.errors import SettingError

if TYPE_CHECKING:
    from solver.contacts.pieces.line import Shares
    from solver.contacts.pieces.piece import ContactPart

KT, C, LIMIT = range(3)


class ViscousContact(RateContact, FrictionContact):
    """A friction contact under a given load whose tangential spring has a dashpot beside it."""

    LAW: ClassVar[str] = "coulomb-viscous"
    FORCE: ClassVar[str] = "as `coulomb`, in stick `kt u + c u̇ + constant`"
    KERNEL: ClassVar[str] = "solver.contacts.kernels.coulomb.line_law:damped_line"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        **FrictionContact.PARAMETERS,
        "c": LawQuantity(
            column=columns.C_STICK, unit="N s/m", least=0.0,
            wanted="must be a number >= 0 and <= 1e15 [N s/m]",
        ),
    }  # fmt: skip

    law: Literal["coulomb-viscous"]
    N0: NonNegative
    c: Annotated[NonNegative, "Dashpot beside the tangential spring, which acts while it sticks [N s/m]."]

    # What closed forms of the motion itself would say is not that of u + (c/kt) u'.
    friction = AnyContact.friction  # type: ignore[assignment]
    slopes = AnyContact.slopes
    utilisation = AnyContact.utilisation
    keeps_together = AnyContact.keeps_together

    @property
    def slider(self) -> Slider:
        """Its spring and slider, which follow u + (c/kt) u'."""
        return super().friction

    def shares(self, motions: Real, load: Real) -> Shares | None:
        """Return the shares of the period in stick, slip and separation, at a frequency; else None."""
        from solver.contacts.pieces.line import segments_of, shares_of

        if not self._omega:
            return None
        return shares_of(segments_of(self.slider, self._felt(motions)[0], load))

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...] | None:
        """Return None: the stability is not computed."""
        del motions, load
        return None

    @property
    def several_responses(self) -> str:
        """Why a half-wave symmetric response need not be the only one."""
        return f"the dashpot of {self.name} is not known to keep motions together, so others are possible"

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        return "elastic Coulomb friction with a dashpot in stick: closed form"

    def _felt(self, motions: Real) -> Real:
        """The coefficients of u + (c/kt) u'."""
        lead = self.omega * self.c / self.kt * np.arange(1, (motions.shape[1] - 1) // 2 + 1)
        felt = motions.copy()
        felt[:, 1::2] += lead * motions[:, 2::2]
        felt[:, 2::2] -= lead * motions[:, 1::2]
        return felt

    def friction_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the friction force [N] at the angles `tau`, by the segments of the motion that counts.

        Raises
        ------
        SettingError
            The frequency is not known (`at_frequency`).
        """
        from solver.contacts.pieces.line import force_by_segments

        return force_by_segments(self.slider, self._felt(motions)[0], load, tau).reshape(1, -1)

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march, which follows `step` in its own steps.

        Raises
        ------
        SettingError
            The load varies.
        """
        from solver.contacts.laws.history.functions import ready

        if self.load.orders:
            wanted = "must be constant beside a dashpot in stick where it is marched in time"
            raise SettingError(f"{self.name}.N1", self.N1_value, wanted)
        numbers = (self.kt, self.c, self.slider.limit(self.N0))
        return (
            Row(
                name=self.name, follows=Follows.HISTORY, kt=self.kt, history=ready(_in_steps()).number,
                in_steps=True, states=1, damping=self.c, numbers=(*numbers, *(0.0,) * (columns.MOST_OWN - 3)),
            ),
        )  # fmt: skip


def step(u: float, v: float, du: float, dt: float, last: Real, state: Real, p: Real) -> float:
    """Fill w after a step and return F: what sticks is cut at the limit."""
    held = p[KT] * (u - last[0]) + p[C] * v
    found = min(max(held, -p[LIMIT]), p[LIMIT])
    state[0] = last[0] + (held - found) / p[KT]
    return float(found)


@cache
def _in_steps() -> HistoryLaw:
    return HistoryLaw(
        name="coulomb-viscous", step=step, states=1,
        parameters={key: LawParameter() for key in ("kt", "c", "limit")},
    )  # fmt: skip


LAW = ViscousContact
