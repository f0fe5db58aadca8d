"""The law `coulomb-2d`: friction in two directions, with one limit for the whole force or one for each."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field

from solver.contacts.fields import NonNegative, Real
from solver.contacts.kernels import columns
from solver.contacts.laws.parts import RestStiffness, Row, Slider
from solver.contacts.laws.plane import CIRCLE, CIRCLE_SECOND, SlidesInAPlane
from solver.errors import SettingError

if TYPE_CHECKING:
    from solver.contacts.segments import Shares

MOST_SAMPLES = 65_536
Samples = Annotated[int, Field(strict=True, ge=32, le=MOST_SAMPLES)]


class PlanarContact(SlidesInAPlane):
    """A friction contact that slides in two directions.

    Attributes
    ----------
    between_second : (str, str) or None
        The ends of the motion in the second direction. Left out where `normal` is given.
    limit : "circle", "box" or None
        |T| <= mu N for the whole force (also if left out), or each direction by itself.
    samples : int or None
        Samples a period that the circular limit is evaluated at; if left out it is not sampled, but exact to
        rounding.
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
    def kernel(self) -> str:
        """The kernel of its limit."""
        if self.limits_apart:
            return "solver.contacts.kernels.coulomb.ports:coulomb_ports"
        return CIRCLE if self.samples is None else "solver.contacts.kernels.coulomb.planar:coulomb_plane"

    @property
    def second_kernel(self) -> str | None:
        """The kernel of its second derivatives; a force from samples has none."""
        if self.limits_apart:
            return "solver.contacts.kernels.coulomb.second_law:ports_second"
        return CIRCLE_SECOND if self.samples is None else None

    @property
    def _sampled(self) -> int | None:
        """Samples a period of a circular limit that is sampled."""
        return None if self.limits_apart else self.samples

    @property
    def friction(self) -> Slider:
        """Its slider."""
        return replace(super().friction, sampled=self._sampled is not None)

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table.

        Four samples for the shortest wave at least: with fewer it would be taken for a longer one.
        """
        super().fill(row, highest)
        row[columns.KT_SECOND] = math.nan
        if self._sampled is not None:
            row[columns.SAMPLES] = max(self._sampled, 4 * highest)

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        moved = super().with_numbers(row)
        if self._sampled is None:
            return moved
        return moved.model_copy(update={"samples": int(row[columns.SAMPLES])})

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        if self.limits_apart:
            return "a limit for each direction by itself: two contacts in closed form"
        if self.samples is None:
            return "circular limit: closed form in stick, collocation in slip"
        return f"circular limit, marched over {self.samples} samples a period, of second order"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`, evenly spaced from 0."""
        if self._sampled is None:
            return super().force_at(motions, load, tau)
        from solver.contacts.force_history import plane_force

        return plane_force(motions, load, self.kt, self.mu, tau, self._sampled)

    def shares(self, motions: Real, load: Real) -> Shares:
        """Return the shares of the period in stick, slip and separation."""
        if self._sampled is None:
            return super().shares(motions, load)
        from solver.contacts.segments import sampled_shares

        return sampled_shares(motions, load, self.kt, self.mu, self._sampled)

    def rows(self) -> tuple[Row, ...]:
        """Return its rows of the time march, one for each direction.

        Raises
        ------
        SettingError
            A circular limit that is sampled, which the march does not follow.
        """
        if self._sampled is not None:
            wanted = (
                "has a contact whose circular limit is sampled, which is not marched: leave out `samples`"
            )
            raise SettingError("scene", self.name, wanted)
        return super().rows()


LAW = PlanarContact
