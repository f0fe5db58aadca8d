"""What a law tells of itself in numbers and records: its parameters, its load, what it holds, its march."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from solver.contacts.fields import Real

_AROUND, _BOTH_WAYS = 20.0, 4.0  # times its value, how far a parameter is varied by hand


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """What a slider of a parameter covers.

    Attributes
    ----------
    low, high : float
        Its ends.
    of : str or None
        The parameter of whose absolute value they are multiples; None: they are values as they stand.
    logarithmic : bool
        Whether equal steps are equal ratios.
    """

    low: float
    high: float
    of: str | None = None
    logarithmic: bool = False


def usual_span(key: str, least: float) -> Span:
    """Return what a slider of a parameter covers that has no span of its own: values of the size it has."""
    if least >= 0.0:
        return Span(low=1.0 / _AROUND, high=_AROUND, of=key, logarithmic=True)
    return Span(low=-_BOTH_WAYS, high=_BOTH_WAYS, of=key)


@dataclass(frozen=True, slots=True, kw_only=True)
class LawQuantity:
    """A parameter of a law.

    Attributes
    ----------
    column : int
        Of the contact table, see `solver.contacts.kernels.columns`.
    unit : str
        Empty of a pure number.
    wanted : str
        What a value must be, for the message of a bad one.
    least : float
        Smallest value that means something to a continuation.
    unlike_half_waves : str
        Why a change of it may call for even harmonics: "changes …"; empty if it does not.
    breaks_symmetry : bool
        Whether with it a motion and its negative half a period later are answered differently.
    varies_load : bool
        Whether it makes the normal load vary.
    load_order : int
        The harmonic of the load that it makes vary.
    symbol : str
        How people write it; as its key if empty.
    otherwise : tuple of str or None
        The parameters whose product it is where a scene leaves it out; None: it is then not there.
    by_hand : bool
        Whether it is worth a slider.
    covered : Span or None
        What its slider covers; None: values of the size it has, of both signs if it may have both.
    """

    column: int
    unit: str
    wanted: str = "must be a number from -1e15 to 1e15"
    least: float = -math.inf
    unlike_half_waves: str = ""
    breaks_symmetry: bool = False
    varies_load: bool = False
    load_order: int = 1
    symbol: str = ""
    otherwise: tuple[str, ...] | None = None
    by_hand: bool = True
    covered: Span | None = None

    def span(self, key: str) -> Span | None:
        """Return what its slider covers as the parameter `key`; None without a slider."""
        if not self.by_hand:
            return None
        return usual_span(key, self.least) if self.covered is None else self.covered


@dataclass(frozen=True, slots=True, kw_only=True)
class NormalLoad:
    """A given normal load N(τ) = mean + amplitude cos(τ + phase) + Σ A_k cos(kτ + φ_k), k ≥ 2 [N, rad].

    Attributes
    ----------
    ratio : float or None
        Of the amplitude to the mean where it is tied to it.
    higher : tuple of (float, float)
        Amplitude and phase of the harmonics 2, 3, …
    """

    mean: float
    amplitude: float
    phase: float
    ratio: float | None = None
    higher: tuple[tuple[float, float], ...] = ()

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
    """Friction with a limit: a spring and a slider that moves where the spring's force reaches μN.

    Attributes
    ----------
    kt : float
        Stiffness of the spring in the first direction it slides in [N/m].
    kt_second : float or None
        That of the second direction [N/m]; None: the same.
    mu : float
        Friction coefficient.
    ports : tuple of int
        The relative motions it slides along.
    normal_port, normal_stiffness
        The motion that changes the load, and by how much [N/m]; None and 0 where the load is given.
    limits_apart : bool
        Each direction has its own limit, in place of one for the whole force.
    """

    kt: float
    mu: float
    kt_second: float | None = None
    ports: tuple[int, ...] = (0,)
    normal_port: int | None = None
    normal_stiffness: float = 0.0
    limits_apart: bool = False

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
    """What one row of the time march follows; the value is that of `solver.marching.kernels.state`."""

    FRICTION = 0
    RUBBING = 1
    GAP = 2
    POLYNOMIAL = 3
    CIRCLE = 4
    CIRCLE_SECOND = 5
    HISTORY = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A contact, or a part of one, as the time march follows it.

    Attributes
    ----------
    name : str
        As the march calls it.
    port : int
        Which of the contact's relative motions it pulls along.
    kt, mu, N0, N1, N1_phase : float
        Stiffness [N/m], friction coefficient, normal load [N, rad].
    higher : tuple of (float, float)
        Amplitude and phase of the load's harmonics from the second on [N, rad].
    normal_port, kn, rest : of a row that rubs
        Which of them is the normal motion, its stiffness [N/m], and the part of the normal force that is in
        equilibrium at rest [N].
    presses : float
        0.0 where another row has the normal force already, else 1.0.
    gap : float
        Where a spring on one side begins [m].
    powers : tuple of float
        a1, a2, … of a polynomial spring [N/m^j]; `kt` is then the size of a1.
    history, in_steps, states, damping, numbers : of a law given by functions
        Its number (`solver.jit.law_functions`), whether it goes from sample to sample, how
        many states it has, its damping at rest [N s/m], and its parameters.
    """

    name: str
    port: int = 0
    follows: Follows = Follows.FRICTION
    kt: float = 0.0
    mu: float = 0.0
    N0: float = 0.0
    N1: float = 0.0
    N1_phase: float = 0.0
    higher: tuple[tuple[float, float], ...] = ()
    normal_port: int | None = None
    kn: float = 0.0
    rest: float = 0.0
    presses: float = 1.0
    gap: float = 0.0
    powers: tuple[float, ...] = field(default=())
    history: int = 0
    in_steps: bool = False
    states: int = 0
    damping: float = 0.0
    numbers: tuple[float, ...] = field(default=())


class ContactMotion(Enum):
    """What a contact does at an instant; the value is what a client reads."""

    STICK = 0
    SLIP = 1
    SEPARATION = 2
