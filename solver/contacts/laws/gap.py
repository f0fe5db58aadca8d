"""The law `gap`: a spring on one side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np

from solver.contacts.fields import NonNegative, Real, Signed
from solver.contacts.frames import NORMAL
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import ContactMotion, Follows, LawQuantity, RestStiffness, Row

if TYPE_CHECKING:
    from solver.contacts.pieces.line import Shares
    from solver.contacts.pieces.piece import ContactPart


class GapSpring(AnyContact):
    """A spring on one side: F = k max(u - gap, 0)."""

    LAW: ClassVar[str] = "gap"
    FORCE: ClassVar[str] = "`k max(u - gap, 0)`"
    KERNEL: ClassVar[str] = "solver.contacts.kernels.springs:gap_spring"
    SECOND: ClassVar[str | None] = "solver.contacts.kernels.springs:gap_second"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        "k": LawQuantity(
            column=columns.K_GAP, unit="N/m", least=0.0, wanted="must be a number >= 0 and <= 1e15 [N/m]"
        ),
        "gap": LawQuantity(column=columns.GAP, unit="m", wanted="must be a number from -1e15 to 1e15 [m]"),
    }
    DIRECTIONS: ClassVar[tuple[int, ...]] = (NORMAL,)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.K_GAP, columns.GAP, -1),)
    OPENS: ClassVar[bool] = True

    law: Literal["gap"]
    k: Annotated[NonNegative, "Stiffness once the gap is closed [N/m]."]
    gap: Annotated[Signed, "Gap [m]; negative if the spring is pressed at rest."]

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.k,)

    @property
    def answers_unlike(self) -> str:
        """Why it answers a motion and its negative half a period later differently."""
        return f"{self.name} pushes on one side only"

    @property
    def slopes(self) -> tuple[Real, Real]:
        """Half its stiffness, and as much on both sides of it."""
        half = 0.5 * self.k
        return np.array([half]), np.array([[half]])

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        return "a spring on one side: closed form"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`."""
        from solver.contacts.pieces.line import values_at

        del load
        return np.asarray(self.k * np.maximum(values_at(motions[0], tau) - self.gap, 0.0))

    def motion_at(self, motions: Real, load: Real, force: Real, tau: Real) -> list[ContactMotion]:
        """Return what it does at every angle: it is closed where it pushes."""
        del motions, load, tau
        return [ContactMotion.SEPARATION if each == 0.0 else ContactMotion.STICK for each in force]

    def shares(self, motions: Real, load: Real) -> Shares:
        """Return the shares of the period: closed it sticks."""
        from solver.contacts.pieces.line import closed_where, shares_of

        del load
        return shares_of(closed_where(motions[0], self.gap))

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...]:
        """Return how it follows small perturbations of a motion."""
        from solver.contacts.pieces.line import gap_pieces
        from solver.contacts.pieces.piece import ContactPart

        del load
        return (ContactPart((0,), gap_pieces(motions[0], self.k, self.gap)),)

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march."""
        return (Row(name=self.name, follows=Follows.GAP, kt=self.k, gap=self.gap),)


LAW = GapSpring
