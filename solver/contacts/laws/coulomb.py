"""The law `coulomb`: elastic Coulomb friction under a given normal load, in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from solver.contacts.fields import NonNegative, Real, Stiffness
from solver.contacts.laws.contact_parts import ContactMotion
from solver.contacts.laws.friction import FrictionContact
from solver.errors import SettingError

if TYPE_CHECKING:
    from solver.contacts.pieces.piece import ContactPart


class SlidesOnALine(FrictionContact):
    """Friction in one direction: the events of a period say all that the contact does."""

    @property
    def slides_on_a_line(self) -> bool:
        """Whether it has one slider with the events of `solver.contacts.pieces.line`."""
        return True

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...] | None:
        """Return how it follows small perturbations of a motion."""
        if self.is_rigid:
            wanted = "must be finite here: what is known of the stability of a rigid contact is in the answer"
            raise SettingError(f"{self.name}.kt", self.kt, wanted)
        return super().perturbed(motions, load)


class Contact(SlidesOnALine):
    """A friction contact: elastic Coulomb with a given normal load N(t) = N0 + N1 cos(omega t + N1_phase).

    Of `N1` and `N1_ratio` one is given, or neither (no variation); `N1_value` is the amplitude whichever was.
    Where N1 > N0 the contact opens. With an infinite `kt` it is rigid.
    """

    LAW: ClassVar[str] = "coulomb"
    FORCE: ClassVar[str] = (
        "stick `kt u + c`, slip `± μN`, nothing while `N <= 0`; `N = N0 + N1 cos(ωt + N1_phase)`"
    )
    KERNEL: ClassVar[str] = "solver.contacts.kernels.coulomb.line_law:coulomb_line"
    SECOND: ClassVar[str | None] = "solver.contacts.kernels.coulomb.second_law:line_second"
    JENKINS: ClassVar[bool] = True

    law: Literal["coulomb"] | None = None
    kt: Stiffness
    N0: NonNegative

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        return "elastic Coulomb friction under a given load: closed form"

    def motion_at(self, motions: Real, load: Real, force: Real, tau: Real) -> list[ContactMotion]:
        """Return what it does at every angle, by its segments."""
        from solver.contacts.pieces.line import motion_at, segments_of

        del force
        return motion_at(segments_of(self.friction, motions[0], load), tau)


LAW = Contact
