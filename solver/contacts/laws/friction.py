"""What the laws of elastic Coulomb friction share: kt, μ, and a normal load of any harmonics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, cast

import numpy as np
from pydantic import ConfigDict, Field, field_validator, model_validator

from solver.contacts.fields import Angle, Friction, Positive, Real, Signed
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import (
    Follows,
    LawQuantity,
    NormalLoad,
    RestStiffness,
    Row,
    Slider,
    Span,
)
from solver.contacts.laws.load_harmonics import (
    LoadHarmonic,
    as_harmonics,
    higher_quantity,
    named_apart,
    order_of,
)
from solver.errors import SettingError
from solver.results import units

if TYPE_CHECKING:
    from solver.contacts.pieces.line import Shares
    from solver.contacts.pieces.piece import ContactPart

_LEAST_FRICTION = 0.1  # in a linear limit: what must stick does so with a load of reason
_MOST_FRICTION = 100.0
_VARIATION = "changes the variation of a normal load"


class FrictionContact(AnyContact):
    """Elastic Coulomb friction with a normal load N(t) = N0 + N1 cos(omega t + N1_phase) + higher harmonics.

    A scene may give the load as a list, `load = [N0, {order, amplitude, phase}, ...]`: N0, N1 and N1_phase
    are then read from its first entries, so that both ways of writing give equal contacts.
    """

    model_config = ConfigDict(serialize_by_alias=True)

    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        "N0": LawQuantity(
            column=columns.N0, unit="N", least=0.0,
            wanted="must be a number >= 0 (from -1e15 with the law elastic-normal) and <= 1e15 [N]",
        ),
        "N1": LawQuantity(
            column=columns.N1, unit="N", wanted="must be a number from -1e15 to 1e15 [N]",
            unlike_half_waves=_VARIATION, breaks_symmetry=True, varies_load=True,
            otherwise=("N1_ratio", "N0"), covered=Span(low=0.0, high=4.0, of="N0"),
        ),
        "N1_ratio": LawQuantity(
            column=columns.RATIO, unit="", unlike_half_waves=_VARIATION, breaks_symmetry=True,
            varies_load=True, by_hand=False,
        ),
        "N1_phase": LawQuantity(
            column=columns.PHASE, unit="rad", wanted="must be a number from -1e4 to 1e4 [rad]", by_hand=False
        ),
        "kt": LawQuantity(
            column=columns.KT, unit="N/m", least=0.0, wanted="must be a number > 0 and <= 1e15 [N/m]"
        ),
        "mu": LawQuantity(
            column=columns.MU, unit="", least=0.0, wanted="must be a number >= 0 and <= 100", symbol="μ",
            covered=Span(low=0.0, high=1.0),
        ),
    }  # fmt: skip
    WORDS: ClassVar[Mapping[str, str]] = {
        "load": "The normal load as a Fourier list: its mean [N], which may stand as N0 instead, then for "
        "each harmonic amplitude cos(order ωt + phase) a table of `order`, `amplitude` [N], `phase` [rad].",
    }
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.KT),)
    RUBBING: ClassVar[tuple[int, ...]] = (0,)
    IN_THE_LIMIT: ClassVar[frozenset[str]] = frozenset({"mu", "N0"})
    """Parameters of which a steady limit tells the product alone."""

    kt: Annotated[Positive, "Tangential contact stiffness [N/m]."]
    mu: Annotated[Friction, "Friction coefficient."]
    N0: Annotated[Signed, "Mean normal load [N]."]
    N1: Annotated[Signed | None, "Amplitude of the normal load [N]; in place of N1_ratio."] = None
    N1_ratio: Annotated[
        Signed | None, "Amplitude of the normal load as a multiple of N0; in place of N1."
    ] = None
    N1_phase: Annotated[Angle, "Phase of the normal load [rad]: N0 + N1 cos(ωt + N1_phase)."] = 0.0
    higher_load: Annotated[
        tuple[LoadHarmonic, ...] | None, "The harmonics of the load from the second on, ascending."
    ] = Field(default=None, alias="load")

    @model_validator(mode="before")
    @classmethod
    def _names_of_the_first(cls, data: Any) -> Any:
        return named_apart(data)

    @field_validator("higher_load", mode="before")
    @classmethod
    def _a_list_of_harmonics(cls, given: Any) -> Any:
        return as_harmonics(given)

    @field_validator("higher_load")
    @classmethod
    def _those_without_names(cls, given: tuple[LoadHarmonic, ...] | None) -> tuple[LoadHarmonic, ...] | None:
        kept = [each for each in given or () if each.order > 1]
        return tuple(sorted(kept, key=lambda each: each.order)) or None

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
    def moving(self) -> tuple[float, bool] | None:
        """The stiffness by which its load moves with the parts [N/m], and whether v counts from equilibrium.

        None: its load is given.
        """
        return None

    @property
    def normal_port(self) -> int | None:
        """The port whose motion changes its normal load, or None."""
        return None if self.moving is None else len(self.RUBBING)

    @property
    def tangential(self) -> tuple[float, ...]:
        """The stiffness of each direction [N/m]."""
        return (self.kt,) * len(self.RUBBING)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (*self.tangential, *(() if self.moving is None else self.moving[:1]))

    @property
    def friction(self) -> Slider:
        """Its slider."""
        normal = self.normal_port
        return Slider(
            kt=self.kt, mu=self.mu, ports=self.RUBBING, normal_port=normal,
            normal_stiffness=0.0 if normal is None else self.stiffnesses[normal],
        )  # fmt: skip

    @property
    def is_rigid(self) -> bool:
        """Whether a stiffness of it is infinite."""
        return math.inf in self.stiffnesses

    @property
    def load(self) -> NormalLoad:
        """The given normal load."""
        given = {each.order: (each.amplitude, each.phase) for each in self.higher_load or ()}
        return NormalLoad(
            mean=self.N0, amplitude=self.N1_value, phase=self.N1_phase, ratio=self.N1_ratio,
            higher=tuple(given.get(order, (0.0, 0.0)) for order in range(2, max(given, default=1) + 1)),
        )  # fmt: skip

    @property
    def parameters(self) -> Mapping[str, LawQuantity]:
        """Its numbers that are parameter paths: amplitude and phase of every harmonic of the load too."""
        found = dict(self.PARAMETERS)
        for each in self.higher_load or ():
            for key in (f"N{each.order}", f"N{each.order}_phase"):
                found[key] = higher_quantity(key)
        return found

    def value_of(self, key: str) -> float:
        """Value of a parameter; of the load's amplitude whichever way it was given."""
        if key == "N1":
            return self.N1_value
        if key not in self.PARAMETERS and (order := order_of(key)) is not None:
            given = next((each for each in self.higher_load or () if each.order == order), None)
            return 0.0 if given is None else given.phase if key.endswith("_phase") else given.amplitude
        if key != "N1_ratio":
            return cast(float, getattr(self, key))
        if self.N1_ratio is not None:
            return self.N1_ratio
        if self.N0 == 0.0 and self.N1_value != 0.0:
            raise SettingError(
                f"{self.name}.N1_ratio", None, f"is undefined with N0 = 0 and N1 = {self.N1_value:g}"
            )
        return self.N1_value / self.N0 if self.N0 else 0.0

    def changed_by(self, key: str, new: float) -> dict[str, object]:
        """The fields that change where a parameter is set: N1 unties the amplitude, N1_ratio ties it."""
        if key in ("N1", "N1_ratio"):
            return {"N1": None, "N1_ratio": None, key: new}
        order = order_of(key)
        if order is None:
            return {key: new}
        changed = {
            "order": order,
            "amplitude": self.value_of(f"N{order}"),
            "phase": self.value_of(f"N{order}_phase"),
        }
        changed["phase" if key.endswith("_phase") else "amplitude"] = new
        return {"higher_load": (*(each for each in self.higher_load or () if each.order != order), changed)}

    def followers(self, key: str) -> frozenset[str]:
        """The parameters that change while one of its own does: the amplitude with what it is tied to."""
        ties = {"N1", "N1_ratio"} if self.N1_ratio is None else {"N0", "N1", "N1_ratio"}
        return super().followers(key) | ({"N1"} if key in ties else frozenset())

    def in_sector(self, turn: float, share: float | None) -> dict[str, object]:
        """The load in another sector: later in a wave that travels, smaller in a standing one."""
        if share is None:
            changed: dict[str, object] = {"N1_phase": self.N1_phase + turn}
        else:
            changed = {key: share * value for key in ("N1", "N1_ratio") if (value := getattr(self, key))}
        higher = tuple(each.in_sector(turn, standing=share is not None) for each in self.higher_load or ())
        return {**changed, "higher_load": higher or None}

    def in_period_of(self, turns: int) -> dict[str, object]:
        """The load as harmonics of a period of so many turns."""
        first = LoadHarmonic(order=1, amplitude=self.N1_value, phase=self.N1_phase)
        every = (*((first,) if self.N1_value else ()), *(self.higher_load or ()))
        if turns == 1 or not every:
            return {}
        later = tuple(each.model_copy(update={"order": turns * each.order}) for each in every)
        return {"N1": None, "N1_ratio": None, "N1_phase": 0.0, "higher_load": later}

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table; a load that is not tied has a ratio NaN."""
        del highest
        for key, quantity in self.parameters.items():
            if key != "N1_ratio":
                row[quantity.column] = self.value_of(key)
        row[columns.RATIO] = math.nan if self.N1_ratio is None else self.N1_ratio
        row[columns.PRESTRESSED] = float(self.moving is not None and self.moving[1])

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        moved = super().with_numbers(row)
        tied = not math.isnan(row[columns.RATIO])
        higher = tuple(
            LoadHarmonic(order=order, amplitude=row[column], phase=row[column + 1])
            for order, column in enumerate(range(columns.COLUMNS, row.size, 2), start=2)
            if row[column] != 0.0 or order in {each.order for each in self.higher_load or ()}
        )
        return moved.model_copy(update={"N1" if tied else "N1_ratio": None, "higher_load": higher or None})

    def normal_load(self, motions: Real) -> Real:
        """Return the coefficients of the normal load not cut at 0 [N], with what the normal motion adds."""
        given = self.load.coefficients
        if self.normal_port is None:
            return given
        moving = self.friction.normal_stiffness * motions[self.normal_port]
        given = np.pad(given, (0, max(moving.size - given.size, 0)))
        given[: moving.size] += moving
        return given

    @property
    def answers_unlike(self) -> str | None:
        """Why it answers a motion and its negative half a period later differently, or None."""
        if self.normal_port is not None:
            return f"the normal load of {self.name} moves with the parts"
        if self.N1_value != 0.0:
            return f"the normal load of {self.name} varies by {units.quantity(abs(self.N1_value), 'N')}"
        # A load of even harmonics is the same half a period later.
        odd = [order for order in self.load.orders if order % 2]
        return f"the normal load of {self.name} varies with harmonic {odd[0]}" if odd else None

    @property
    def keeps_together(self) -> bool:
        """Whether it never lets two motions under the same forces move apart: under a load that is given."""
        return self.normal_port is None

    @property
    def slopes(self) -> tuple[Real, Real] | None:
        """Stuck, what its sliders catch up is left: no more than motion and limit change.

        That holds between two bounds; within a circle whose size changes, or rigid, no such is known.
        """
        if self.is_rigid:
            return None
        if len(self.RUBBING) > 1 and not (self.friction is not None and self.friction.limits_apart):
            return None
        count, normal = len(self.end_keys), self.normal_port
        centre, rest = np.array(self.stiffnesses[:count]), np.zeros((count, count))
        for port in self.RUBBING:
            rest[port, port] = centre[port]
        if normal is not None:
            rest[list(self.RUBBING), normal] = self.friction.limit_rise
            centre[normal] *= 0.5
            rest[normal, normal] = centre[normal]
        return centre, rest

    @property
    def separation(self) -> tuple[bool, str]:
        """Whether it may open, and why."""
        if self.moving is not None:
            return True, f"{self.name} opens and closes as it moves"
        least = self.load.least
        if least < 0.0:
            return True, f"the normal load of {self.name} falls to {units.quantity(least, 'N')}"
        return False, f"the normal load of {self.name} stays at {units.quantity(least, 'N')} or more"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`."""
        return np.asarray(self.friction_at(motions, load, tau)[0])

    def friction_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the friction force along each direction [N] at the angles `tau`, by its segments."""
        from solver.contacts.pieces.line import force_by_segments

        return np.array([
            force_by_segments(slider, motions[slider.ports[0]], load, tau) for slider in self.friction.limited
        ])  # fmt: skip

    def shares(self, motions: Real, load: Real) -> Shares | None:
        """Return the shares of the period in stick, slip and separation, by its segments."""
        from solver.contacts.pieces.line import segments_of, shares_of

        sliders = self.friction.limited
        return shares_of(*(segments_of(slider, motions[slider.ports[0]], load) for slider in sliders))

    def perturbed(self, motions: Real, load: Real) -> tuple[ContactPart, ...] | None:
        """Return how it follows small perturbations of a motion: each direction by itself."""
        from solver.contacts.pieces.line import friction_pieces
        from solver.contacts.pieces.piece import ContactPart

        behind = () if self.normal_port is None else (self.normal_port,)
        return tuple(
            ContactPart(
                (port, *behind), friction_pieces(slider, motions[port], load, presses=port == self.RUBBING[0])
            )
            for slider in self.friction.limited
            for port in slider.ports
        )

    def utilisation(self, forces: Real, load: Real) -> float:
        """Return the largest share of its limit that it carries while it sticks."""
        from solver.contacts.pieces.line import values_at

        tau = np.linspace(0.0, 2.0 * np.pi, max(360, 8 * forces.shape[1]), endpoint=False)
        limit = self.friction.limit(values_at(load, tau))
        carried = self.friction.size(values_at(forces[list(self.RUBBING)], tau))
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(carried > 0.0, carried / limit, 0.0)
        return float(min(shares.max(), 1.0))

    def row_numbers(self) -> dict[str, Any]:
        """Return what every row of the time march has of it."""
        load, moving = self.load, self.moving
        given: dict[str, Any] = {
            "kt": self.kt, "mu": self.mu, "N0": load.mean, "N1": load.amplitude, "N1_phase": load.phase,
            "higher": load.higher, "follows": Follows.FRICTION,
        }  # fmt: skip
        if moving is not None:
            kn, prestressed = moving
            given |= {"follows": Follows.RUBBING, "normal_port": self.normal_port, "kn": kn}
            given["rest"] = max(self.N0, 0.0) if prestressed else 0.0
        return given

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march."""
        return (Row(name=self.name, **self.row_numbers()),)

    def linear_limit(self, load: float, *, gone: bool) -> dict[str, Any]:
        """Return what makes it linear: no load if it is `gone`, else stuck under a large load [N].

        A load that moves acts on the parts: removed it never closes, stuck it counts from the pressed state.
        """
        changed: dict[str, Any] = {"N1_ratio": None, "N1": 0.0, "N0": 0.0 if gone else load, "load": None}
        if self.moving is not None:
            changed |= {"N0": -load} if gone else {"prestressed": True}
        if self.mu < _LEAST_FRICTION:
            changed["mu"] = _LEAST_FRICTION
        return changed

    def held_fast(self) -> Self:
        """Return the contact as one that goes on sticking where it sticks, whatever is put on it."""
        return self.model_copy(update={"mu": _MOST_FRICTION})

    def least_load_slope(self, key: str) -> float:
        """Return the derivative of the least value of a given load by a parameter of its own."""
        tau = self.load.least_at
        along = math.cos(tau + self.N1_phase)
        by_key = {
            "N0": 1.0 + along * (self.N1_ratio or 0.0), "N1": along, "N1_ratio": along * self.N0,
            "N1_phase": -self.N1_value * math.sin(tau + self.N1_phase),
        }  # fmt: skip
        order = order_of(key)
        if order is None:
            return by_key.get(key, 0.0)
        angle = order * tau + self.value_of(f"N{order}_phase")
        return -self.value_of(f"N{order}") * math.sin(angle) if key.endswith("_phase") else math.cos(angle)
