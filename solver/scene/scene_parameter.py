"""A parameter of a scene as an object that the owner of the number makes; and what a unit of it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeVar

from pydantic import ValidationError

from solver.contacts.fields import Part, Real
from solver.contacts.laws.contact_parts import LawQuantity, Span, usual_span
from solver.errors import SettingError
from solver.wording import documented

if TYPE_CHECKING:
    from solver.scene.linear_terms import Entry

_PartT = TypeVar("_PartT", bound=Part)


class Term(NamedTuple):
    """One DOF of a linear form, here or in the next sector, and its factor."""

    dof: str
    next: bool
    factor: float


Form = tuple[Term, ...]
Forces = tuple[tuple[str, float], ...]  # constant forces [N] by DOFs


class ActsOn(Enum):
    """What of a scene a parameter changes; of the names of `solver.balance.balance.Kind`."""

    LEVEL = "the amplitude of the excitation"
    FORCE_PHASE = "its phase"
    CONTACTS = "numbers of contacts"
    STRUCTURE = "matrices, constant forces or places of contacts"


@documented
@dataclass(frozen=True, slots=True, kw_only=True)
class Slope:
    """What a unit of a parameter adds to the linear equations of a scene."""

    parts: Annotated[
        tuple[tuple[int, float], ...],
        "Masses, springs and dashpots, counted in this order, and what each gains.",
    ] = ()
    masses: Annotated[Mapping[str, Real], "Mass matrix of bodies, by their names."] = field(
        default_factory=dict
    )
    forces: Annotated[Forces, "Constant forces by DOFs."] = ()
    second_forces: Annotated[Forces, "Likewise, by the unit squared."] = ()
    motions: Annotated[
        Mapping[str, tuple[Form, ...]] | None, "Relative motions of contacts, by their names."
    ] = None
    entries: Annotated[tuple[Entry, ...], "Entries of K and C."] = ()
    damping: Annotated[
        Literal["K", "M"] | None, "C gains the stiffness or the mass of a structure given by its matrices."
    ] = None
    loss: Annotated[bool, "K gains i times the stiffness of what moves."] = False
    speed: Annotated[bool, "The matrices are those of a speed higher by 1/min."] = False


@documented
@dataclass(frozen=True, slots=True, kw_only=True)
class SceneParameter:
    """A parameter path resolved against a scene."""

    get: Annotated[
        Callable[[], float],
        "Gives its value; of a group, its first member's. Raises SettingError where it has none.",
    ]
    with_value: Annotated[
        Callable[[float], Mapping[str, Any]],
        "Gives the fields of the scene that change where it is set. Raises SettingError for a bad value.",
    ]
    unit: Annotated[str, "Of its values."]
    least: Annotated[float, "Smallest value that means something."] = 0.0
    acts_on: Annotated[ActsOn, "What it changes:"] = ActsOn.STRUCTURE
    slope: Annotated[Callable[[], Slope], "what a unit of it adds to the linear equations; or"] = Slope
    contacts: Annotated[
        Mapping[int, float],
        "by the place of each contact in the scene the share of a unit that its number gains, and",
    ] = field(default_factory=dict)
    quantities: Annotated[tuple[LawQuantity, ...], "what that number is in each of them."] = ()
    listed: Annotated[
        bool, "Whether it may be set: numbers of contacts that a shape makes are set by those of the shape."
    ] = True
    in_steps: Annotated[bool, "Whether it is a whole number."] = False
    moves_contacts: Annotated[bool, "Whether it is of the geometry that places contacts."] = False
    by_hand: Annotated[bool, "Whether it is worth a slider."] = True

    def span(self, key: str) -> Span | None:
        """Return what its slider covers, as the parameter `key` of its owner; None without a slider."""
        if self.quantities:
            return self.quantities[0].span(key)
        if self.in_steps or not self.by_hand:
            return None
        if self.moves_contacts:  # a shape of another size is another damper
            return Span(low=0.3, high=3.0, of=key)
        return usual_span(key, self.least)

    @property
    def pulls(self) -> bool:
        """Whether constant forces depend on it."""
        return self.acts_on is ActsOn.STRUCTURE and bool(self.slope().forces)

    def sets_with(self, other: SceneParameter) -> bool:
        """Whether it sets the same number of some contact as another parameter of the scene does."""
        return not self._numbers.isdisjoint(other._numbers)

    @property
    def _numbers(self) -> set[tuple[int, int]]:
        """The rows and columns of the contact table that it sets."""
        return {(i, quantity.column) for i, quantity in zip(self.contacts, self.quantities, strict=True)}


def changed(part: _PartT, update: Mapping[str, object], path: str, new: float, wanted: str) -> _PartT:
    """Return the part with other fields.

    Raises
    ------
    SettingError
        It may not have them; the message says what is `wanted`.
    """
    try:
        return type(part).model_validate({**part.__dict__, **update}, by_name=True)
    except ValidationError as error:
        raise SettingError(path, new, wanted) from error
