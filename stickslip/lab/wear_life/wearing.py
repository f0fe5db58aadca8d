"""Which contacts wear, and what a depth takes away from each: load, gap, stiffness.

The depth of a contact grows by its dissipated energy, dw/dt = α P / A (Archard's law in its energy form:
Archard, J. Appl. Phys. 24 (1953) 981, doi:10.1063/1.1721448; Fouvry, Liskiewicz, Kapsa, Hannel, Sauger, Wear
255 (2003) 287, doi:10.1016/S0043-1648(03)00117-0), with the wear coefficient α [1/Pa], the power P that
friction takes out [W] and the nominal area A [m²]. With Archard's K and hardness H it is α = K/(μ H). A depth
w lowers the load by kn w where the contact has a normal stiffness, which is a gap of w.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.arrays import Real
from solver.contacts.fields import LARGEST
from solver.contacts.kernels.columns import KN
from solver.errors import SettingError
from solver.scene.parameter_paths import find_parameter, follows_speed
from solver.scene.scene import AnyContact, Scene
from solver.scene.scene_parameter import changed

LOAD, STIFFNESS = "N0", "kt"
SECONDS_AN_HOUR = 3600.0

PerContact = float | Mapping[str, float]
"""A number of every contact with friction, or by contact or group."""
_NOTHING = 1e-12  # of a stiffness, which laws want above 0


@dataclass(frozen=True, slots=True)
class WearLaw:
    """Which contacts wear how fast, and what a depth takes from them.

    Each is a number of every contact with friction, or by contact or group; of a disk that is written out by
    their names in one sector.

    Attributes
    ----------
    coefficient : float or mapping
        Wear coefficient [1/Pa, which is m³/J]. Where it is given by contact or group the others do not wear.
    area : float or mapping
        Nominal area of each [m²]; of a face with several points that of each point.
    load_loss_per_depth : float, mapping or None
        What a depth of 1 m takes from the normal load [N/m]; the normal stiffness of a contact that has one
        if left out.
    stiffness_loss_per_depth : float, mapping or None
        What it takes from the tangential stiffness kt [N/m²]; nothing if left out.
    """

    coefficient: PerContact
    area: PerContact
    load_loss_per_depth: PerContact | None = None
    stiffness_loss_per_depth: PerContact | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """A number of a contact that a depth lowers."""

    contact: Annotated[int, "Which of the wearing contacts."]
    key: Annotated[str, "Its parameter: `N0` or `kt`."]
    path: Annotated[str, "Likewise as a path."]
    per_depth: Annotated[float, "What a depth of 1 m takes away [N/m or N/m²]."]
    of_kn: Annotated[bool, "It is the normal stiffness of the contact itself."]
    least: Annotated[float, "As low as the number may fall."]


@dataclass(frozen=True, slots=True, kw_only=True)
class Wearing:
    """The contacts of a scene that wear, n of them."""

    scene: Annotated[Scene, "Not worn."]
    places: Annotated[tuple[int, ...], "Each among the contacts of the scene."]
    coefficients: Annotated[Real, "Wear coefficient of each [1/Pa], (n,)."]
    areas: Annotated[Real, "Nominal area of each [m²], (n,)."]
    entries: Annotated[tuple[str, ...], "The names of coefficients as they were given: `coefficient.NAME`."]
    of_entry: Annotated[tuple[int, ...], "Which of them each contact has."]
    losses: Annotated[tuple[Loss, ...], "What depths take away, at least one of each contact."]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(self.scene.contacts[place].name for place in self.places)

    @property
    def per_watt(self) -> Real:
        """Depth an hour of each for a watt [m/(h W)], (n,)."""
        return SECONDS_AN_HOUR * self.coefficients / self.areas

    def number(self, loss: Loss, depths: Real, scene: Scene | None = None) -> float:
        """Return a number of a contact at depths (n,) [m], of a scene whose contacts are not worn."""
        contact = (scene or self.scene).contacts[self.places[loss.contact]]
        return contact.value_of(loss.key) - loss.per_depth * float(depths[loss.contact])

    def at(self, depths: Real) -> Scene:
        """Return the scene worn by `depths` (n,) [m], nothing below its least; or SettingError of a law."""
        contacts = list(self.scene.contacts)
        for loss in self.losses:
            # A step that is tried and not taken may lead anywhere.
            place = self.places[loss.contact]
            value = min(max(self.number(loss, depths), loss.least), LARGEST)
            old = contacts[place]
            contacts[place] = changed(
                old, old.changed_by(loss.key, value), loss.path, value, "must be what its law takes"
            )
        return self.scene.model_copy(update={"contacts": tuple(contacts)})

    def moved(self, paths: Sequence[str], depths: Real) -> Real:
        """Return ∂(number)/∂(path) of each loss at fixed depths beyond that of the scene, (losses, paths).

        A load that falls by kn w falls faster where kn is raised.
        """
        slopes = np.zeros((len(self.losses), len(paths)))
        for i, loss in enumerate(self.losses):
            if loss.of_kn:
                shares = [_share_in_kn(self.scene, path, self.places[loss.contact]) for path in paths]
                slopes[i] = -float(depths[loss.contact]) * np.array(shares)
        return slopes

    def size(self, i: int) -> float:
        """Return the depth that takes all of a number of contact `i` away [m]; infinite where none is."""
        sizes = [
            abs(self.number(loss, np.zeros(len(self.places)))) / loss.per_depth
            for loss in self.losses
            if loss.contact == i and loss.per_depth > 0.0
        ]
        return min((size for size in sizes if size > 0.0), default=math.inf)


def wearing_of(scene: Scene, wear: WearLaw) -> Wearing:
    """Return which contacts of a scene wear, and how.

    Raises
    ------
    SettingError
        A name that is none, or of no contact with friction; a contact without area or without anything that
        wear lowers; a number out of its range; rigid contacts.
    """
    if scene.rigid_contact is not None:
        raise SettingError("scene", scene.rigid_contact, "must not have rigid contacts: they do not wear")
    coefficients = _of_contacts(scene, "coefficient", wear.coefficient, above=False)
    areas = _of_contacts(scene, "area", wear.area, above=True)
    loads = _of_contacts(scene, "load_loss_per_depth", wear.load_loss_per_depth, above=False)
    stiffnesses = _of_contacts(scene, "stiffness_loss_per_depth", wear.stiffness_loss_per_depth, above=False)
    places, losses = tuple(coefficients), list[Loss]()
    for i, place in enumerate(places):
        contact = scene.contacts[place]
        if place not in areas:
            raise SettingError("area", None, f"must be given for the contact {contact.name}, which wears")
        own = [_load_loss(scene, i, contact, loads.get(place))]
        if place in stiffnesses:
            own.append(_loss(scene, i, contact, STIFFNESS, stiffnesses[place][0], of_kn=False))
        found = [loss for loss in own if loss is not None]
        if not found:
            wanted = (
                f"must be given for the contact {contact.name}: without a normal stiffness kn nothing says "
                "what a depth takes from its load"
            )
            raise SettingError("load_loss_per_depth", None, wanted)
        losses += found
    entries = tuple(dict.fromkeys(name for _, name in coefficients.values()))
    return Wearing(
        scene=scene, places=places, coefficients=np.array([coefficients[p][0] for p in places]),
        areas=np.array([areas[p][0] for p in places]), entries=entries,
        of_entry=tuple(entries.index(coefficients[p][1]) for p in places), losses=tuple(losses),
    )  # fmt: skip


def _load_loss(scene: Scene, i: int, contact: AnyContact, given: tuple[float, str] | None) -> Loss | None:
    """Return what a depth takes from the load of a contact; None if nothing says it."""
    if given is not None:
        return _loss(scene, i, contact, LOAD, given[0], of_kn=False)
    moving = getattr(contact, "moving", None)
    return None if moving is None else _loss(scene, i, contact, LOAD, moving[0], of_kn=True)


def _loss(scene: Scene, i: int, contact: AnyContact, key: str, per_depth: float, *, of_kn: bool) -> Loss:
    path, asked = (
        f"{contact.name}.{key}",
        "load_loss_per_depth" if key == LOAD else "stiffness_loss_per_depth",
    )
    if key not in contact.parameters:
        wanted = f"must not be given for the contact {contact.name}: its law {contact.LAW} has no {key}"
        raise SettingError(asked, per_depth, wanted)
    if scene.with_speed and follows_speed(scene, path) is not None:
        raise SettingError(asked, per_depth, f"must not lower {path}, which follows the speed (`with_speed`)")
    least = 0.0 if key == LOAD else _NOTHING * contact.value_of(key)
    if key == LOAD and getattr(contact, "moving", None) is not None:
        least = -math.inf
    return Loss(contact=i, key=key, path=path, per_depth=per_depth, of_kn=of_kn, least=least)


def _of_contacts(
    scene: Scene, key: str, given: PerContact | None, *, above: bool
) -> dict[int, tuple[float, str]]:
    """Return a number of each contact that it is given for, with the name it was given by."""
    rubbing = [i for i, contact in enumerate(scene.contacts) if contact.RUBBING]
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        number = _number(key, given, above=above)
        if not rubbing:
            raise SettingError(key, given, "needs contacts with friction, the scene has none")
        return dict.fromkeys(rubbing, (number, key))
    found: dict[int, tuple[float, str]] = {}
    for name, value in given.items():
        number = _number((key, name), value, above=above)
        members = [i for i in rubbing if name in _called(scene.contacts[i])]
        if not members:
            known = dict.fromkeys(word for i in rubbing for word in _called(scene.contacts[i]))
            wanted = f"must name contacts with friction, or groups of them: {', '.join(known)}"
            raise SettingError((key, name), name, wanted)
        for i in members:
            if i in found:
                raise SettingError((key, name), value, f"gives {scene.contacts[i].name} a second number")
            found[i] = number, f"{key}.{name}"
    return dict(sorted(found.items()))


def _called(contact: AnyContact) -> list[str]:
    """The names a contact may be given by: its own, that in its sector, its group's."""
    names = (contact.group, contact.name.partition("@")[0], contact.name)
    return list(dict.fromkeys(name for name in names if name))


def _number(key: str | tuple[str, str], value: object, *, above: bool) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value)
        if 0.0 <= number <= LARGEST and (number > 0.0 or not above):
            return number
    raise SettingError(key, value, f"must be a number {'>' if above else '>='} 0 and <= {LARGEST:g}")


def _share_in_kn(scene: Scene, path: str, place: int) -> float:
    """Return the share of a path in the normal stiffness of a contact."""
    found = find_parameter(scene, path)
    if found is None or place not in found.contacts:
        return 0.0
    quantity = dict(zip(found.contacts, found.quantities, strict=True))[place]
    return found.contacts[place] if quantity.column == KN else 0.0
