"""The law `coulomb-2d`: friction in two directions, with one limit for the whole force or one for each."""

from __future__ import annotations

from typing import ClassVar, Literal

from solver.contacts.fields import NonNegative, Samples
from solver.contacts.kernels import columns
from solver.contacts.laws.parts import RestStiffness
from solver.contacts.laws.plane import SlidesInAPlane


class PlanarContact(SlidesInAPlane):
    """A friction contact that slides in two directions.

    Attributes
    ----------
    samples : int or None
        Read and left aside: the samples a period of the circular limit when it was not yet exact to rounding.
    """

    LAW: ClassVar[str] = "coulomb-2d"
    FORCE: ClassVar[str] = "friction in two directions with one limit"
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "between_second")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("between_second",)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.KT), RestStiffness(columns.KT))

    law: Literal["coulomb-2d"]
    N0: NonNegative
    samples: Samples | None = None

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        if self.limits_apart:
            return "a limit for each direction by itself: two contacts in closed form"
        return "circular limit: closed form in stick, collocation in slip"


LAW = PlanarContact
