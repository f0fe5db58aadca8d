"""The contacts of a scene, one class for each law: where they act, their parameters, their checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from solver.scene.parts import (
    Angle,
    Between,
    Element,
    End,
    Friction,
    MemberName,
    Name,
    NonNegative,
    Positive,
    Signed,
    parse_end,
)

MOST_SAMPLES = 65_536
LAW_TAG = "law "  # begins the tags of the union: no key of a contact has a space
Samples = Annotated[int, Field(strict=True, ge=32, le=MOST_SAMPLES)]


class AnyContact(Element):
    """What all contacts have.

    Attributes
    ----------
    name : str
        Name in parameter paths.
    between : (str, str)
        Its ends; the relative motion is x(first) - x(second), and the force resists it.
    group : str or None
        A name that sets several contacts at once in parameter paths.
    """

    PARAMETERS: ClassVar[tuple[str, ...]] = ()

    name: MemberName
    group: Name | None = None

    @property
    def pairs(self) -> tuple[Between, ...]:
        """The ends of each relative motion the force depends on."""
        return (self.between,)

    @property
    def pair_ends(self) -> tuple[tuple[End, End], ...]:
        """The same, read."""
        return tuple((parse_end(first), parse_end(second)) for first, second in self.pairs)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (0.0,) * len(self.pairs)


class FrictionContact(AnyContact):
    """Elastic Coulomb friction with a normal load N(t) = N0 + N1 cos(omega t + N1_phase)."""

    PARAMETERS: ClassVar[tuple[str, ...]] = ("N0", "N1", "N1_ratio", "N1_phase", "kt", "mu")

    kt: Positive
    mu: Friction
    N0: Signed
    N1: Signed | None = None
    N1_ratio: Signed | None = None
    N1_phase: Angle = 0.0

    @model_validator(mode="after")
    def _one_of_n1(self) -> FrictionContact:
        if self.N1 is not None and self.N1_ratio is not None:
            raise ValueError(
                f"`N1` and `N1_ratio` of contact `{self.name}` exclude each other: give one, "
                f"got N1 = {self.N1!r} and N1_ratio = {self.N1_ratio!r}"
            )
        return self

    @property
    def N1_value(self) -> float:
        """Amplitude of the normal load [N], from `N1` or `N1_ratio`."""
        if self.N1_ratio is not None:
            return self.N1_ratio * self.N0
        return 0.0 if self.N1 is None else self.N1

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.kt,) * len(self.pairs)


class Contact(FrictionContact):
    """A friction contact: elastic Coulomb with a given normal load N(t) = N0 + N1 cos(omega t + N1_phase).

    Attributes
    ----------
    kt : float
        Tangential contact stiffness [N/m].
    mu : float
        Friction coefficient.
    N0 : float
        Mean normal load [N].
    N1, N1_ratio : float or None
        Amplitude of the load [N], or that amplitude as a multiple of N0; one of them or neither (no
        variation). `N1_value` is the amplitude whichever was given. Where N1 > N0 the contact opens.
    N1_phase : float
        Phase of the load [rad].
    """

    law: Literal["coulomb"] | None = None
    N0: NonNegative


class ElasticNormalContact(FrictionContact):
    """A rubbing contact: the load moves with the parts, N = N0 + N1 cos(omega t + N1_phase) + kn v.

    The friction is that of `Contact`, without force while N <= 0; max(N, 0) acts on the normal pair.

    Attributes
    ----------
    normal_between : (str, str)
        The ends of the normal motion v = x(first) - x(second); v > 0 presses.
    kn : float
        Normal contact stiffness [N/m].
    N0 : float
        Load [N] at v = 0; -kn * gap for an initial gap.
    prestressed : bool
        Whether v counts from the state in which a positive N0 is in equilibrium already: the force on the
        normal pair is then max(N, 0) - max(N0, 0). Else it is the whole max(N, 0).
    """

    PARAMETERS: ClassVar[tuple[str, ...]] = (*FrictionContact.PARAMETERS, "kn")

    law: Literal["elastic-normal"]
    normal_between: Between
    kn: Positive
    prestressed: bool = False

    @property
    def pairs(self) -> tuple[Between, ...]:
        """The tangential and the normal pair."""
        return (self.between, self.normal_between)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.kt, self.kn)


class PlanarContact(FrictionContact):
    """A friction contact that slides in two directions.

    Attributes
    ----------
    between_second : (str, str)
        The ends of the motion in the second direction.
    limit : "circle", "box" or None
        |T| <= mu N for the whole force (also if left out), or each direction by itself.
    samples : int or None
        Samples a period that the circular limit is evaluated at; 512 if left out.
    """

    law: Literal["coulomb-2d"]
    N0: NonNegative
    between_second: Between
    limit: Literal["circle", "box"] | None = None
    samples: Samples | None = None

    @property
    def pairs(self) -> tuple[Between, ...]:
        """The pairs of both directions."""
        return (self.between, self.between_second)


class GapSpring(AnyContact):
    """A spring on one side: F = k max(u - gap, 0).

    Attributes
    ----------
    k : float
        Stiffness once the gap is closed [N/m].
    gap : float
        Gap [m]; negative if the spring is pressed at rest.
    """

    PARAMETERS: ClassVar[tuple[str, ...]] = ("k", "gap")

    law: Literal["gap"]
    k: NonNegative
    gap: Signed

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.k,)


class PolynomialSpring(AnyContact):
    """A spring with the force a1 u + a2 u^2 + ... + a9 u^9, a_j in N/m^j; what is left out is 0."""

    PARAMETERS: ClassVar[tuple[str, ...]] = tuple(f"a{j}" for j in range(1, 10))

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


def _law_of(data: object) -> str:
    """The tag of a contact's law: of a table or of a contact already read."""
    law = data.get("law") if isinstance(data, Mapping) else getattr(data, "law", None)
    return LAW_TAG + ("coulomb" if law is None else str(law))


LAWS: dict[str, type[AnyContact]] = {
    "coulomb": Contact,
    "elastic-normal": ElasticNormalContact,
    "coulomb-2d": PlanarContact,
    "gap": GapSpring,
    "polynomial": PolynomialSpring,
}
ContactOfAnyLaw = Annotated[
    Annotated[Contact, Tag(LAW_TAG + "coulomb")]
    | Annotated[ElasticNormalContact, Tag(LAW_TAG + "elastic-normal")]
    | Annotated[PlanarContact, Tag(LAW_TAG + "coulomb-2d")]
    | Annotated[GapSpring, Tag(LAW_TAG + "gap")]
    | Annotated[PolynomialSpring, Tag(LAW_TAG + "polynomial")],
    Discriminator(_law_of),
]
