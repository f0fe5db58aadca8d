"""What a law tells of itself in numbers and records: its parameters, its load, what it holds, its march."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated, NamedTuple, TypeVar

import numpy as np

from solver.contacts.fields import Real

Number = TypeVar("Number", float, Real)
_AROUND, _BOTH_WAYS = 20.0, 4.0  # times its value, how far a parameter is varied by hand


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """What a slider of a parameter covers."""

    low: Annotated[float, "Its lower end."]
    high: Annotated[float, "Its upper one."]
    of: Annotated[
        str | None,
        "The parameter of whose absolute value they are multiples; None: they are values as they stand.",
    ] = None
    logarithmic: Annotated[bool, "Whether equal steps are equal ratios."] = False


def usual_span(key: str, least: float) -> Span:
    """Return what a slider of a parameter covers that has no span of its own: values of the size it has."""
    if least >= 0.0:
        return Span(low=1.0 / _AROUND, high=_AROUND, of=key, logarithmic=True)
    return Span(low=-_BOTH_WAYS, high=_BOTH_WAYS, of=key)


@dataclass(frozen=True, slots=True, kw_only=True)
class LawQuantity:
    """A parameter of a law."""

    column: Annotated[int, "Of the contact table, see `solver.contacts.kernels.columns`."]
    unit: Annotated[str, "Empty of a pure number."]
    wanted: Annotated[str, "What a value must be, for the message of a bad one."] = (
        "must be a number from -1e15 to 1e15"
    )
    least: Annotated[float, "Smallest value that means something to a continuation."] = -math.inf
    unlike_half_waves: Annotated[
        str, 'Why a change of it may call for even harmonics: "changes …"; empty if it does not.'
    ] = ""
    breaks_symmetry: Annotated[
        bool, "Whether with it a motion and its negative half a period later are answered differently."
    ] = False
    varies_load: Annotated[bool, "Whether it makes the normal load vary."] = False
    load_order: Annotated[int, "The harmonic of the load that it makes vary."] = 1
    symbol: Annotated[str, "How people write it; as its key if empty."] = ""
    otherwise: Annotated[
        tuple[str, ...] | None,
        "The parameters whose product it is where a scene leaves it out; None: it is then not there.",
    ] = None
    by_hand: Annotated[bool, "Whether it is worth a slider."] = True
    covered: Annotated[
        Span | None,
        "What its slider covers; None: values of the size it has, of both signs if it may have both.",
    ] = None

    def span(self, key: str) -> Span | None:
        """Return what its slider covers as the parameter `key`; None without a slider."""
        if not self.by_hand:
            return None
        return usual_span(key, self.least) if self.covered is None else self.covered


@dataclass(frozen=True, slots=True, kw_only=True)
class NormalLoad:
    """A given normal load N(τ) = mean + amplitude cos(τ + phase) + Σ A_k cos(kτ + φ_k), k ≥ 2 [N, rad]."""

    mean: float
    amplitude: float
    phase: float
    ratio: Annotated[float | None, "Of the amplitude to the mean where it is tied to it."] = None
    higher: Annotated[tuple[tuple[float, float], ...], "Amplitude and phase of the harmonics 2, 3, …"] = ()

    @property
    def waves(self) -> tuple[tuple[float, float], ...]:
        """Amplitude and phase of the harmonics 1, 2, … [N, rad]."""
        return ((self.amplitude, self.phase), *self.higher)

    @property
    def orders(self) -> tuple[int, ...]:
        """The harmonics in which it varies, ascending."""
        return tuple(order for order, (size, _) in enumerate(self.waves, start=1) if size != 0.0)

    @property
    def in_proportion(self) -> bool:
        """Whether it varies in proportion to its mean, or not at all."""
        return not self.orders or (self.orders == (1,) and self.ratio is not None)

    @property
    def coefficients(self) -> Real:
        """Its Fourier coefficients (1 + 2 K,) [N], K its highest harmonic, 1 or more."""
        pairs = [(size * math.cos(phase), -size * math.sin(phase)) for size, phase in self.waves]
        return np.array([self.mean, *(number for pair in pairs for number in pair)])

    @property
    def least(self) -> float:
        """Its least value in a period [N]; below 0 it would pull."""
        if self.orders in ((), (1,)):
            return self.mean - abs(self.amplitude)
        return self.at(self.least_at)

    @property
    def least_at(self) -> float:
        """The angle of its least value [rad], among the roots of its derivative, a polynomial in e^{iτ}."""
        if self.orders in ((), (1,)):
            return (math.pi if self.amplitude > 0.0 else 0.0) - self.phase
        up = [0.5j * k * size * cmath.exp(1j * phase) for k, (size, phase) in enumerate(self.waves, start=1)]
        roots = np.roots([*reversed(up), 0.0, *(each.conjugate() for each in up)])
        return float(min(np.angle(roots).tolist(), key=self.at))

    def at(self, tau: float) -> float:
        """Its value at an angle [N]."""
        waves = enumerate(self.waves, start=1)
        return self.mean + sum(size * math.cos(k * tau + phase) for k, (size, phase) in waves)


@dataclass(frozen=True, slots=True, kw_only=True)
class Slider:
    """Friction with a limit: a spring and a slider that moves where the spring's force reaches μN."""

    kt: Annotated[float, "Stiffness of the spring in the first direction it slides in [N/m]."]
    mu: Annotated[float, "Friction coefficient."]
    kt_second: Annotated[float | None, "That of the second direction [N/m]; None: the same."] = None
    ports: Annotated[tuple[int, ...], "The relative motions it slides along."] = (0,)
    normal_port: Annotated[int | None, "The motion that changes the load; None where it is given."] = None
    normal_stiffness: Annotated[float, "By how much [N/m]; 0 where it is given."] = 0.0
    limits_apart: Annotated[
        bool, "Each direction has its own limit, in place of one for the whole force."
    ] = False

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """The stiffness of every direction [N/m]."""
        second = self.kt if self.kt_second is None else self.kt_second
        return (self.kt, second)[: len(self.ports)]

    @property
    def limited(self) -> tuple[Slider, ...]:
        """A slider for each limit, which sticks or slips whatever the others do."""
        if not self.limits_apart:
            return (self,)
        return tuple(
            replace(self, kt=kt, kt_second=None, ports=(port,))
            for kt, port in zip(self.stiffnesses, self.ports, strict=True)
        )

    def limit(self, load: Number) -> Number:
        """Return its limit μN [N] for loads N, or the coefficients of one for those of the other."""
        return self.mu * load

    @property
    def limit_rise(self) -> float:
        """By how much the limit grows with the normal motion [N/m]."""
        return self.limit(self.normal_stiffness)

    def pull(self, away: Real) -> Real:
        """Return the forces (directions, ...) [N] of its spring for motions `away` of its directions [m]."""
        return np.asarray([kt * each for kt, each in zip(self.stiffnesses, away, strict=True)])

    def size(self, forces: Real) -> Real:
        """Return what counts against the limit of forces (directions, ...) [N]."""
        return np.asarray(
            np.abs(forces).max(axis=0) if self.limits_apart else np.sqrt((forces**2).sum(axis=0))
        )


class RestStiffness(NamedTuple):
    """What a port begins with at rest: a stiffness, where a number is above 0 (or always).

    Attributes
    ----------
    column : of the stiffness [N/m] in the contact table.
    when, sign : column and sign of that number; sign 0: always.
    """

    column: int
    when: int = 0
    sign: int = 0


class Follows(Enum):
    """What one row of the time march follows; the value is that of `solver.marching.kernels.march_state`."""

    FRICTION = 0
    RUBBING = 1
    GAP = 2
    POLYNOMIAL = 3
    CIRCLE = 4
    CIRCLE_SECOND = 5
    HISTORY = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A contact, or a part of one, as the time march follows it."""

    name: Annotated[str, "As the march calls it."]
    port: Annotated[int, "Which of the contact's relative motions it pulls along."] = 0
    follows: Follows = Follows.FRICTION
    kt: Annotated[float, "Stiffness [N/m]."] = 0.0
    mu: Annotated[float, "Friction coefficient."] = 0.0
    N0: Annotated[float, "Mean normal load [N]."] = 0.0
    N1: Annotated[float, "Its amplitude [N]."] = 0.0
    N1_phase: Annotated[float, "Its phase [rad]."] = 0.0
    higher: Annotated[
        tuple[tuple[float, float], ...],
        "Amplitude and phase of the load's harmonics from the second on [N, rad].",
    ] = ()
    normal_port: Annotated[int | None, "Of a row that rubs: which of them is the normal motion."] = None
    kn: Annotated[float, "Its stiffness [N/m]."] = 0.0
    rest: Annotated[float, "The part of the normal force that is in equilibrium at rest [N]."] = 0.0
    presses: Annotated[float, "0.0 where another row has the normal force already, else 1.0."] = 1.0
    gap: Annotated[float, "Where a spring on one side begins [m]."] = 0.0
    powers: Annotated[
        tuple[float, ...], "a1, a2, … of a polynomial spring [N/m^j]; `kt` is then the size of a1."
    ] = field(default=())
    history: Annotated[int, "Of a law given by functions: its number (`solver.jit.law_functions`)."] = 0
    in_steps: Annotated[bool, "Whether it goes from sample to sample."] = False
    states: Annotated[int, "How many states it has."] = 0
    damping: Annotated[float, "Its damping at rest [N s/m]."] = 0.0
    numbers: Annotated[tuple[float, ...], "Its parameters."] = field(default=())

    @classmethod
    def of_strength(cls, name: str, kt: float, limit: float) -> Row:
        """Return the row of a spring whose slider gives way at a force [N], whatever presses it."""
        return cls(name=name, kt=kt, mu=1.0, N0=limit)


class ContactMotion(Enum):
    """What a contact does at an instant; the value is what a client reads."""

    STICK = 0
    SLIP = 1
    SEPARATION = 2
