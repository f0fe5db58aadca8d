"""The contract of a contact law: what a scene says of it, and the answers everything else asks for.

A law is a class made from `AnyContact`. Its fields are those of a contact in a scene, with ranges and words;
`PARAMETERS` says where each number stands in the contact table; `KERNEL` names the kernel behind the contract
of `solver.contacts.kernels.laws`. What else a law may answer has a default that is right for a spring of one
motion, or says that the law has no such thing. Nothing outside this folder asks which law a contact has.

Importing a law must not load Numba: what computes is imported inside the methods.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, cast

from pydantic import PrivateAttr, model_validator

from solver.contacts.fields import Between, Element, MemberName, Name, Real
from solver.contacts.frames import NORMAL, TANGENT_1, TANGENT_2, InSpace
from solver.contacts.laws.contact_parts import (
    ContactMotion,
    LawQuantity,
    NormalLoad,
    RestStiffness,
    Row,
    Slider,
)
from solver.errors import SettingError

if TYPE_CHECKING:
    from solver.contacts.pieces.line import Shares
    from solver.contacts.pieces.piece import ContactPart


_ALONG = {"between": TANGENT_1, "between_second": TANGENT_2, "normal_between": NORMAL}


class AnyContact(Element, InSpace):
    """What all contacts have."""

    LAW: ClassVar[str]
    """The word of `law` in a scene."""
    FORCE: ClassVar[str]
    """The force in a line of Markdown, for the table of docs/laws.md."""
    KERNEL: ClassVar[str]
    """``module:NAME`` of the kernel."""
    SECOND: ClassVar[str | None] = None
    """``module:NAME`` of the kernel of its second derivatives (`solver.contacts.kernels.laws`)."""
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {}
    """Its numbers that are parameter paths."""
    WORDS: ClassVar[Mapping[str, str]] = {}
    """What the schema of scenes says of keys, in place of the docstring's words."""
    END_KEYS: ClassVar[tuple[str, ...]] = ("between",)
    """The keys of the ends of each relative motion the force depends on, port after port."""
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ()
    """Those beside `between` that may not be left out, but in space."""
    DIRECTIONS: ClassVar[tuple[int, ...]] = ()
    """The direction of each of these in space; told by the keys if left out."""
    HELD: ClassVar[tuple[RestStiffness, ...]]
    """What each port begins with at rest."""

    DISCRETISED: ClassVar[bool] = False
    """Whether it stands for a law that it meets only nearly, see `unresolved`."""
    JENKINS: ClassVar[bool] = False
    """Whether the force is that of one spring kt and one slider μN under the given load (`friction`).

    What is known in closed form of this element is then used: its events, and that it is a spring between
    nothing and kt.
    """
    OPENS: ClassVar[bool] = False
    """Whether it opens and closes as the parts move."""
    RUBBING: ClassVar[tuple[int, ...]] = ()
    """The ports along which friction works."""
    NORMAL_PORT: ClassVar[int | None] = None
    """The port whose motion changes the normal load, by the stiffness it begins with."""

    name: Annotated[MemberName, "Name in parameter paths."]
    group: Annotated[Name | None, "A name that sets several contacts at once in parameter paths."] = None

    @model_validator(mode="after")
    def _a_motion_each(self) -> Self:
        count = len(self.end_keys)
        if self.motions is not None and len(self.motions) != count:
            raise ValueError(
                f"`motions` of contact `{self.name}` must be {count}, one for each relative motion of its "
                f"law, got {len(self.motions)}"
            )
        return self

    # Ports

    @property
    def end_keys(self) -> tuple[str, ...]:
        """The keys of the ends of its relative motions, port after port: those of `END_KEYS` it has."""
        return self.END_KEYS

    @property
    def directions(self) -> tuple[int, ...]:
        """The direction of each relative motion of a contact with a `normal`."""
        return self.DIRECTIONS or tuple(_ALONG.get(key, TANGENT_1) for key in self.end_keys)

    @property
    def held(self) -> tuple[RestStiffness, ...]:
        """What each of its ports begins with at rest."""
        return self.HELD

    @property
    def force_alone(self) -> bool:
        """Whether its kernel finds the force alone for less, given no blocks for the Jacobian."""
        return False

    @property
    def normal_port(self) -> int | None:
        """The port whose motion changes its normal load, or None."""
        return self.NORMAL_PORT

    # Scene

    @property
    def pairs(self) -> tuple[Between, ...]:
        """The ends of each relative motion the force depends on, DOFs; of a contact without a `normal`."""
        return tuple(getattr(self, key) for key in self.end_keys)

    @property
    def parameters(self) -> Mapping[str, LawQuantity]:
        """Its numbers that are parameter paths, with those it has because of its values."""
        return self.PARAMETERS

    def value_of(self, key: str) -> float:
        """Value of a parameter.

        Raises
        ------
        SettingError
            It has none as the others stand.
        """
        return cast(float, getattr(self, key) or 0.0)

    def changed_by(self, key: str, new: float) -> dict[str, object]:
        """The fields that change where a parameter is set."""
        return {key: new}

    def followers(self, key: str) -> frozenset[str]:
        """The parameters that change while one of its own does, itself among them."""
        return frozenset({key} & self.parameters.keys())

    def in_sector(self, turn: float, share: float | None) -> dict[str, object]:
        """The fields that differ in another sector of an annulus.

        Parameters
        ----------
        turn : the angle by which the wave comes later there [rad].
        share : of the amplitude in a standing wave, None in one that travels.
        """
        del turn, share
        return {}

    def in_period_of(self, turns: int) -> dict[str, object]:
        """The fields that differ where so many turns of its load make up the period."""
        del turns
        return {}

    # Contact table and kernel

    @classmethod
    def prepare(cls) -> None:
        """Compile what its kernel calls beside the kernels."""

    @property
    def kernel(self) -> str:
        """``module:NAME`` of the kernel for its settings."""
        return self.KERNEL

    @property
    def second_kernel(self) -> str | None:
        """``module:NAME`` of the kernel of its second derivatives for its settings; None: it has none."""
        return self.SECOND

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (0.0,) * len(self.end_keys)

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table, for harmonics up to `highest`."""
        del highest
        for key, quantity in self.PARAMETERS.items():
            row[quantity.column] = self.value_of(key)

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        numbers = {key: float(row[quantity.column]) for key, quantity in self.PARAMETERS.items()}
        return self.model_copy(update=numbers)

    # Load and friction

    @property
    def friction(self) -> Slider | None:
        """Its slider if it is friction with a limit μN, else None."""
        return None

    @property
    def is_rigid(self) -> bool:
        """Whether a stiffness of it is infinite: it is then solved by events, not by the balance."""
        return False

    @property
    def tangent_varies(self) -> bool:
        """Whether its stiffness changes without a change of state: in space while it slips, as it bends."""
        return False

    @property
    def slides_on_a_line(self) -> bool:
        """Whether its slider has the events of `solver.contacts.pieces.line`, so that its travel is known."""
        return False

    @property
    def load(self) -> NormalLoad | None:
        """The given normal load; None where the law knows none."""
        return None

    @property
    def load_is_given(self) -> bool:
        """Whether it is friction whose load does not depend on the motion."""
        return self.load is not None and self.normal_port is None

    def normal_load(self, motions: Real) -> Real:
        """Return the coefficients of the normal load not cut at 0 [N]; motions are (ports, 2H + 1) [m]."""
        del motions
        return (self.load or NormalLoad(mean=0.0, amplitude=0.0, phase=0.0)).coefficients

    # What may be taken for granted

    @property
    def answers_unlike(self) -> str | None:
        """Why it answers a motion and its negative half a period later differently, or None."""
        return None

    @property
    def several_responses(self) -> str | None:
        """Why a half-wave symmetric response need not be the only one, or None.

        Friction and springs of a constant stiffness never let two responses move apart.
        """
        return None

    @property
    def keeps_together(self) -> bool:
        """Whether it never lets two motions under the same forces move apart."""
        return False

    @property
    def slopes(self) -> tuple[Real, Real] | None:
        """It as springs, (ports,) [N/m], and how far what is left of it follows, (ports, ports) [N/m].

        The force but for its springs differs between two motions, in the largest value over a period, by no
        more than this matrix times the largest differences of the motions; residual forces aside. None where
        there is no such bound. Of a law that opens without friction it holds at every instant.
        """
        return None

    # Plan

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        return f"the law {self.LAW}"

    @property
    def separation(self) -> tuple[bool, str]:
        """Whether it may open, and why."""
        may = f"{self.name} opens and closes as it moves" if self.OPENS else f"{self.name} has no gap"
        return self.OPENS, may

    # A periodic motion

    def at_frequency(self, omega: float) -> Self:
        """The contact as it answers motions of an angular frequency [rad/s]: only rates make a difference."""
        del omega
        return self

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`, evenly spaced from 0.

        Parameters
        ----------
        motions : (ports, 2H + 1) full coefficients [m]; load : those of the normal load [N].
        """
        del motions, load, tau
        raise SettingError(
            "contact", self.name, f"must have a law whose force is known over time ({self.LAW} is not)"
        )

    def friction_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the friction force along each direction it slides in [N], (directions, n); as `force_at`."""
        return self.force_at(motions, load, tau).reshape(1, -1)

    def utilisation(self, forces: Real, load: Real) -> float:
        """Return the largest share of its limit that it carries while it sticks; forces (ports, 2H + 1)."""
        del forces, load
        return 1.0

    def motion_at(self, motions: Real, load: Real, force: Real, tau: Real) -> list[ContactMotion] | None:
        """Return what it does at every angle, where its force is `force`; None where it knows no such."""
        del motions, load, force, tau
        return None

    def shares(self, motions: Real, load: Real) -> Shares | None:
        """Return the shares of the period in stick, slip and separation; None where it knows no such."""
        del motions, load
        return None

    def unresolved(self, motion: Real) -> Real | None:
        """Return what its own discretisation leaves out of the force [N]; None of a law without one.

        Parameters
        ----------
        motion : (N,) of its first port at evenly spaced instants of a period [m].
        """
        del motion
        return None

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...] | None:
        """Return how it follows small perturbations of a motion: its parts with their states, for stability.

        Parameters
        ----------
        motions : (ports, 2H + 1) full coefficients [m]; load : those of the normal load [N].

        Returns
        -------
        None where the stability is not computed.
        """
        del motions, load
        return None

    def rows(self) -> tuple[Row, ...]:
        """Return the rows of the time march.

        Raises
        ------
        SettingError
            The law cannot be marched.
        """
        raise SettingError("scene", self.name, "has a contact of a law that cannot be marched in time")

    # Limits

    def linear_limit(self, load: float, *, gone: bool) -> dict[str, Any] | None:
        """Return what makes it linear: without force if it is `gone`, else stuck under a large load [N].

        None where it stays as it is. A key whose value is None is left out of the scene.
        """
        del load, gone
        return None

    def held_fast(self) -> Self:
        """Return the contact as one that goes on sticking where it sticks, whatever is put on it."""
        return self

    def least_load_slope(self, key: str) -> float:
        """Return the derivative of the least normal load of a given load by a parameter of its own."""
        del key
        return math.nan


class RateContact(AnyContact):
    """A contact whose force depends on rates: it is known at a frequency."""

    _omega: float = PrivateAttr(default=0.0)  # rad/s; 0 where it is not known

    def at_frequency(self, omega: float) -> Self:
        """The contact as it answers motions of an angular frequency [rad/s]."""
        moved = self.model_copy()
        moved._omega = omega
        return moved

    @property
    def omega(self) -> float:
        """That frequency [rad/s]; SettingError where it is not known."""
        if not self._omega:
            raise SettingError("contact", self.name, "must be one `at_frequency`: its law may depend on it")
        return self._omega


def without_second(contacts: Iterable[AnyContact]) -> str:
    """Return the contacts whose law has no second derivatives, with the law; empty if there are none."""
    return ", ".join(f"{one.name} ({one.LAW})" for one in contacts if one.second_kernel is None)
