"""The law `polynomial`: a nonlinear spring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from solver.contacts.fields import Real, Signed
from solver.contacts.frames import NORMAL
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import Follows, LawQuantity, RestStiffness, Row

if TYPE_CHECKING:
    from solver.contacts.pieces.piece import ContactPart


def _coefficient(power: int) -> LawQuantity:
    return LawQuantity(
        column=columns.A_1 + power - 1, unit="N/m" if power == 1 else f"N/m^{power}",
        unlike_half_waves="changes a power of the motion", breaks_symmetry=power % 2 == 0,
    )  # fmt: skip


class PolynomialSpring(AnyContact):
    """A spring with the force a1 u + a2 u^2 + ... + a9 u^9, a_j in N/m^j; what is left out is 0."""

    LAW: ClassVar[str] = "polynomial"
    FORCE: ClassVar[str] = "`a1 u + a2 u² + … + a9 u⁹`"
    KERNEL: ClassVar[str] = "solver.contacts.kernels.springs:polynomial_spring"
    SECOND: ClassVar[str | None] = "solver.contacts.kernels.springs:polynomial_second"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        f"a{j}": _coefficient(j) for j in range(1, columns.MOST_DEGREE + 1)
    }
    WORDS: ClassVar[Mapping[str, str]] = {
        f"a{j}": f"Coefficient of u^{j} [N/m^{j}]." for j in range(1, columns.MOST_DEGREE + 1)
    }
    DIRECTIONS: ClassVar[tuple[int, ...]] = (NORMAL,)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.A_1),)

    law: Literal["polynomial"]
    a1: Signed | None = None
    a2: Signed | None = None
    a3: Signed | None = None
    a4: Signed | None = None
    a5: Signed | None = None
    a6: Signed | None = None
    a7: Signed | None = None
    a8: Signed | None = None
    a9: Signed | None = None

    @model_validator(mode="after")
    def _at_least_one(self) -> PolynomialSpring:
        if all(getattr(self, key) is None for key in self.PARAMETERS):
            raise ValueError(f"`a1` … `a9` of contact `{self.name}`: give at least one coefficient, got none")
        return self

    @property
    def coefficients(self) -> tuple[float, ...]:
        """a1 ... a9."""
        return tuple(getattr(self, key) or 0.0 for key in self.PARAMETERS)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (max(self.a1 or 0.0, 0.0),)

    @property
    def answers_unlike(self) -> str | None:
        """Why it answers a motion and its negative half a period later differently, or None."""
        return f"{self.name} has an even power of the motion" if any(self.coefficients[1::2]) else None

    @property
    def several_responses(self) -> str | None:
        """Why a half-wave symmetric response need not be the only one, or None.

        A spring that stiffens or softens lets two responses move apart, with the inertia, though its force is
        odd: m = k = a3 = 1, c = 0.2, F = 15 has at ω = 1.6 rad/s a symmetric response that is not stable, and
        two with a mean that are.
        """
        first, *others = self.coefficients
        if any(others):
            return f"the stiffness of {self.name} changes with its motion, so other responses are possible"
        return f"the stiffness of {self.name} is negative" if first < 0.0 else None

    @property
    def tangent_varies(self) -> bool:
        """It bends."""
        return True

    @property
    def keeps_together(self) -> bool:
        """Whether it never lets two motions under the same forces move apart: one of constant stiffness."""
        return self.several_responses is None

    @property
    def slopes(self) -> tuple[Real, Real] | None:
        """Its stiffness where that is constant."""
        first, *others = self.coefficients
        return None if any(others) else (np.array([first]), np.zeros((1, 1)))

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        return "a polynomial: exact with enough samples"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`."""
        from solver.contacts.pieces.line import values_at

        del load
        return np.asarray(np.polyval([*self.coefficients[::-1], 0.0], values_at(motions[0], tau)))

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...]:
        """Return how it follows small perturbations of a motion."""
        from solver.contacts.pieces.line import polynomial_pieces
        from solver.contacts.pieces.piece import ContactPart

        del load
        return (ContactPart((0,), polynomial_pieces(motions[0], self.coefficients)),)

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march."""
        powers = self.coefficients
        return (Row(name=self.name, follows=Follows.POLYNOMIAL, kt=abs(powers[0]), powers=powers),)


LAW = PolynomialSpring
