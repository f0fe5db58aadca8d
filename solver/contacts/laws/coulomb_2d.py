"""The law `coulomb-2d`: friction in two directions, with one limit for the whole force or one for each."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from solver.contacts.fields import Between, NonNegative, Real, Samples
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_parts import Follows, RestStiffness, Row, Slider
from solver.contacts.laws.friction import FrictionContact

if TYPE_CHECKING:
    from solver.contacts.pieces.line import Shares
    from solver.contacts.pieces.piece import ContactPart


class SlidesInAPlane(FrictionContact):
    """Friction in two directions."""

    RUBBING: ClassVar[tuple[int, ...]] = (0, 1)

    between_second: Annotated[
        Between | None, "The ends of the motion in the second direction. Left out where `normal` is given."
    ] = None
    limit: Annotated[
        Literal["circle", "box"] | None,
        "|T| <= mu N for the whole force (also if left out), or each direction by itself.",
    ] = None

    @property
    def kernel(self) -> str:
        """The kernel of its limit."""
        if self.limits_apart:
            return "solver.contacts.kernels.coulomb.line_law:coulomb_box"
        return "solver.contacts.kernels.circle.circle_law:coulomb_circle"

    @property
    def second_kernel(self) -> str:
        """The kernel of the second derivatives of its limit."""
        if self.limits_apart:
            return "solver.contacts.kernels.coulomb.second_law:box_second"
        return "solver.contacts.kernels.circle.circle_hessian:circle_law_second"

    @property
    def force_alone(self) -> bool:
        """Whether its limit is the circle, whose kernel finds the force alone for less."""
        return not self.limits_apart

    @property
    def limits_apart(self) -> bool:
        """Whether each direction has its own limit."""
        return self.limit == "box"

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table; NaN: a second stiffness that is the first's."""
        super().fill(row, highest)
        row[columns.KT_SECOND] = math.nan

    @property
    def tangent_varies(self) -> bool:
        """Whether its force turns while it slips: where one limit is that of both directions."""
        return not self.limits_apart

    @property
    def tangential(self) -> tuple[float, float]:
        """The stiffness of each direction [N/m]."""
        return self.kt, self.kt

    @property
    def friction(self) -> Slider:
        """Its slider."""
        return replace(super().friction, kt_second=self.tangential[1], limits_apart=self.limits_apart)

    def friction_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return both components of the friction force [N] at the angles `tau`, (2, n)."""
        if self.limits_apart:
            return super().friction_at(motions, load, tau)
        from solver.contacts.pieces.circle import force_in_space, path_in_space

        return force_in_space(path_in_space(self.friction, motions, load), tau)

    def shares(self, motions: Real, load: Real) -> Shares | None:
        """Return the shares of the period in stick, slip and separation."""
        if self.limits_apart:
            return super().shares(motions, load)
        from solver.contacts.pieces.circle import path_in_space, shares_in_space

        return shares_in_space(path_in_space(self.friction, motions, load))

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...] | None:
        """Return how it follows small perturbations of a motion."""
        if self.limits_apart:
            return super().perturbed(motions, load)
        from solver.contacts.pieces.circle import circle_pieces, path_in_space
        from solver.contacts.pieces.piece import ContactPart

        path = path_in_space(self.friction, motions, load)
        return (ContactPart(tuple(range(len(motions))), circle_pieces(path)),)

    def rows(self) -> tuple[Row, ...]:
        """Return its rows of the time march, one for each direction; the first has the normal force."""
        first = {**self.row_numbers(), "presses": float(self.moving is not None)}
        second = {**first, "port": 1, "presses": 0.0, "kt": self.tangential[1]}
        if not self.limits_apart:
            first["follows"], second["follows"] = Follows.CIRCLE, Follows.CIRCLE_SECOND
        return Row(name=self.name, **first), Row(name=f"{self.name} (second)", **second)


class PlanarContact(SlidesInAPlane):
    """A friction contact that slides in two directions."""

    LAW: ClassVar[str] = "coulomb-2d"
    FORCE: ClassVar[str] = "friction in two directions with one limit"
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "between_second")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("between_second",)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.KT), RestStiffness(columns.KT))

    law: Literal["coulomb-2d"]
    N0: NonNegative
    samples: Annotated[
        Samples | None,
        "Read and left aside: the samples a period of the circular limit when it was not yet exact to "
        "rounding.",
    ] = None

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        if self.limits_apart:
            return "a limit for each direction by itself: two contacts in closed form"
        return "circular limit: closed form in stick, collocation in slip"


LAW = PlanarContact
