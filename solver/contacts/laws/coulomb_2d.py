"""The law `coulomb-2d`: friction in two directions, with one limit for the whole force or one for each."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field

from solver.contacts.fields import Between, NonNegative, Real
from solver.contacts.kernels import columns
from solver.contacts.laws.friction import FrictionContact
from solver.contacts.laws.parts import Held, Row, Slider
from solver.errors import SettingError

if TYPE_CHECKING:
    from solver.contacts.segments import Shares

MOST_SAMPLES = 65_536
DEFAULT_SAMPLES = 512
Samples = Annotated[int, Field(strict=True, ge=32, le=MOST_SAMPLES)]


class PlanarContact(FrictionContact):
    """A friction contact that slides in two directions.

    Attributes
    ----------
    between_second : (str, str) or None
        The ends of the motion in the second direction. Left out where `normal` is given.
    limit : "circle", "box" or None
        |T| <= mu N for the whole force (also if left out), or each direction by itself.
    samples : int or None
        Samples a period that the circular limit is evaluated at; 512 if left out.
    """

    LAW: ClassVar[str] = "coulomb-2d"
    FORCE: ClassVar[str] = "friction in two directions with one limit"
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "between_second")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("between_second",)
    HELD: ClassVar[tuple[Held, ...]] = (Held(columns.KT), Held(columns.KT))
    RUBBING: ClassVar[tuple[int, ...]] = (0, 1)

    law: Literal["coulomb-2d"]
    N0: NonNegative
    between_second: Between | None = None
    limit: Literal["circle", "box"] | None = None
    samples: Samples | None = None

    @property
    def kernel(self) -> str:
        """The kernel of its limit."""
        if self.limits_apart:
            return "solver.contacts.kernels.coulomb_ports:coulomb_ports"
        return "solver.contacts.kernels.planar:coulomb_plane"

    @property
    def limits_apart(self) -> bool:
        """Whether each direction has its own limit."""
        return self.limit == "box"

    @property
    def friction(self) -> Slider:
        """Its slider; the force under a circular limit comes from samples."""
        return replace(super().friction, limits_apart=self.limits_apart, sampled=not self.limits_apart)

    @property
    def _samples(self) -> int:
        return self.samples or DEFAULT_SAMPLES

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table.

        Four samples for the shortest wave at least: with fewer it would be taken for a longer one.
        """
        super().fill(row, highest)
        row[columns.SAMPLES] = max(self._samples, 0 if self.limits_apart else 4 * highest)

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        samples = None if self.limits_apart else int(row[columns.SAMPLES])
        return super().with_numbers(row).model_copy(update={"samples": samples})

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        if self.limits_apart:
            return "a limit for each direction by itself: two contacts in closed form"
        return f"circular limit, marched over {self._samples} samples a period, of second order"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`, evenly spaced from 0."""
        if self.limits_apart:
            return super().force_at(motions, load, tau)
        from solver.contacts.force_history import plane_force

        return plane_force(motions, load, self.kt, self.mu, tau, self._samples)

    def shares(self, motions: Real, load: Real) -> Shares:
        """Return the shares of the period in stick, slip and separation."""
        from solver.contacts.segments import sampled_shares, segments_of, shares_of

        if self.limits_apart:
            return shares_of(*(segments_of(slip, load, self.kt, self.mu) for slip in motions))
        return sampled_shares(motions, load, self.kt, self.mu, self._samples)

    def rows(self) -> tuple[Row, ...]:
        """Return its rows of the time march, one for each direction.

        Raises
        ------
        SettingError
            A circular limit, which the march does not follow.
        """
        if not self.limits_apart:
            wanted = 'has a contact with a circular limit, which is not marched: try limit = "box"'
            raise SettingError("scene", self.name, wanted)
        names = (self.name, f"{self.name} (second)")
        return tuple(Row(name=name, port=port, **self.row_numbers()) for port, name in enumerate(names))


LAW = PlanarContact
