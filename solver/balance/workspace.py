"""The arrays one run works in, and the operations on a single point that everything else is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, Kind, fewer_harmonics
from solver.balance.closed_loop_poles import ClosedLoop
from solver.balance.kernels.jacobian import fill_jacobian, whole_jacobian
from solver.balance.kernels.locate import slope_by_parameter
from solver.balance.kernels.mechanics import ALLOWED, unaccounted
from solver.balance.kernels.newton import from_stuck, ladder, newton, stuck_start
from solver.balance.kernels.output import MEASURES
from solver.balance.kernels.residual import evaluate
from solver.balance.mean_loads import friction_can_hold, may_stick
from solver.contacts.kernels.columns import KT, KT_SECOND
from solver.contacts.kernels.stick_slip_events import FAILED, STUCK
from solver.contacts.kernels.system import (
    UNHELD,
    Evaluation,
    Receptance,
    System,
    by_reference,
    evaluation_by_value,
    new_evaluation,
    new_receptance,
    of_all_ports,
    receptance_by_value,
)
from solver.jit.fourier import Complex, Integer, Real, coefficient_count
from solver.linear.kernels.receptance import receptance
from solver.scene.scene_harmonics import spread

MOST_ENTRIES = 1_000_000  # 16 MB; beyond, they are worked out anew


class KnownSprings:
    """ĝ at solutions, see `solver.balance.kernels.linearised_contacts.fill_springs`; by the bits of these.

    They are kept where forces are dear, and over the frequency alone, where resonances are looked for.
    """

    def __init__(self, system: System, kind: Kind) -> None:
        self._shape = system.ks.size, int(system.first_block[-1])
        self._wanted = kind is Kind.FREQUENCY and bool(system.alone.any())
        self._known: dict[bytes, Complex] = {}

    def rows(self, count: int) -> Complex:
        """Return empty rows for `count` solutions; none where they are not kept."""
        full = (len(self._known) + count) * self._shape[0] * self._shape[1] > MOST_ENTRIES
        return np.empty((0 if full or not self._wanted else count, *self._shape), np.complex128)

    def keep(self, solutions: Real, springs: Complex) -> None:
        """Keep the springs (at least P, or no row) of solutions (P, nt + 1), λ last."""
        if len(springs):
            self._known |= {row.tobytes(): one for row, one in zip(solutions, springs, strict=False)}

    def of(self, solutions: Real) -> list[Complex | None]:
        """Return the springs (nk, blocks) of solutions (P, nt + 1), None where they are not known."""
        return [self._known.get(row.tobytes()) for row in solutions]


# The mean and the first: with these Newton's method from full stick nearly always ends well.
FEWEST_HARMONICS = 2
ALONG = 1e-6  # share of a motion below which it has no part along a direction


Way = Callable[[Real, float], tuple[bool, int, float]]
"""From nothing or a guess to (whether u solves at λ, iterations, relative residual), u in place."""
Arc = Callable[["Workspace", float], tuple[Real | None, int]]
"""To (slip motions at λ [m], None where it does not lead there; iterations)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointSolution:
    """One attempt to solve the balance at one value of λ."""

    converged: Annotated[bool, "Whether `u` satisfies the balance."]
    u: Annotated[Real, "Slip motions [m], contact after contact, (n_unknowns,)."]
    iterations: Annotated[int, "Newton iterations spent, the start-up ladder included."]
    residual: Annotated[float, "Relative residual at `u`."]
    ratchets: Annotated[
        bool,
        "There is no periodic motion: a part that contacts alone hold drifts a little further every "
        "period. `u` is the motion it has where a constant force holds it.",
    ] = False
    above_friction: Annotated[bool, "It does because the mean load on it is more than friction can hold."] = (
        False
    )
    loses_power: Annotated[bool, "Residuals were small, but powers or mean forces did not balance."] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMeasures:
    """What is observed at a solution, with slopes by λ (inside unit)."""

    observed: Annotated[Real, "Coefficients of the observed DOF [m], (n,)."]
    values: Annotated[Real, "Indexed by the column names of `solver.balance.kernels.output`, (MEASURES,)."]


@dataclass(frozen=True, slots=True)
class Workspace:
    """A balance with the scratch arrays of the compiled loops; not for two threads at once."""

    balance: Balance
    system: System
    linear: Receptance
    point: Evaluation
    loop: Annotated[ClosedLoop, "What is known of its resonances over the frequency."]
    springs: Annotated[KnownSprings, "The contacts at solutions that were walked to."]

    @classmethod
    def of(
        cls, balance: Balance, like: Workspace | None = None, observing_another: Workspace | None = None
    ) -> Workspace:
        """Return a fresh workspace for a balance.

        Parameters
        ----------
        like : of the same scene with other harmonics.
        observing_another : of the same scene and harmonics with another DOF observed: its resonances are
            shared.
        """
        system = by_reference(balance.system)
        if observing_another is None:
            loop = ClosedLoop(balance, None if like is None else like.loop)
        else:
            loop = observing_another.loop
        springs = KnownSprings(balance.system, balance.parameter.kind)
        return cls(balance, system, new_receptance(system), new_evaluation(system), loop, springs)

    def solve(
        self, p: float, guess: Real | None = None, arc: Arc | None = None, *, quick: bool = False
    ) -> PointSolution:  # fmt: skip
        """Solve at λ = `p` (inside unit): from `guess` if given, else from nothing.

        From nothing, Newton starts at the fully stuck response; if that fails, the harmonics are added
        little by little, beginning with the first alone, the contacts are made soft and then stiffer, and
        the load is walked down rung by rung from full stick. Where contacts alone hold a part, it is looked
        first whether friction can hold its mean load, and where no contact holds it, whether a force drives
        it away. What is found obeys mechanics, see `solver.balance.kernels.mechanics`.

        Behind all these ways an `arc` is followed. Under constant forces most of them take long and fail: it
        is followed before those, which are not taken where it has to be `quick`.
        """
        ways, first = self._ways(arc, quick)
        if not len(self.balance.system.loose) or self.balance.system.hold:
            return self._plain(p, ways, guess)
        if not self.friction_can_hold(p):
            return replace(self._nothing(), ratchets=True, above_friction=True)
        # Under given loads what holds a part shows at once; a load that moves may hold it elsewhere.
        together = all(contact.keeps_together for contact in self.balance.scene.contacts)
        if together:
            first = 1
        found = self._plain(p, ways[:first], guess)
        if not found.converged:
            held = self._held_in_place(p, found.iterations, guess, quick or arc is not None)
            if held.ratchets and not together:
                # Where residual friction forces let every contact stick it does not.
                sticks = may_stick(self.balance, self.system, self.receptance(p), self._stuck(p), p)
                held = replace(held, ratchets=not sticks)
            found = held if held.converged or held.ratchets or first == len(ways) else found
        if found.converged or found.ratchets or first == len(ways):
            return found
        last = self._plain(p, ways[first:])
        lost = found.loses_power or last.loses_power
        return replace(last, iterations=found.iterations + last.iterations, loses_power=lost)

    def _nothing(self) -> PointSolution:
        """Return an attempt that was not made."""
        u = np.zeros(self.balance.n_unknowns)
        return PointSolution(converged=False, u=u, iterations=0, residual=np.inf)

    def friction_can_hold(self, p: float) -> bool:
        """Return whether friction can hold the mean loads on parts that contacts alone hold."""
        return friction_can_hold(self.balance, self.system, self.linear, p)

    def _plain(self, p: float, ways: Sequence[Way], guess: Real | None = None) -> PointSolution:
        """Solve the balance as it stands, from `guess` and then by these ways."""
        u, spent, lost = np.zeros(self.balance.n_unknowns), 0, False
        if guess is not None:
            ways = (partial(self._newton, guess), *ways)
        for way in ways:
            good, more, norm = way(u, p)
            spent += more
            if good and self.obeys(u):
                return PointSolution(converged=True, u=u, iterations=spent, residual=float(norm))
            lost |= bool(good)
        return PointSolution(converged=False, u=u, iterations=spent, residual=float(norm), loses_power=lost)

    def _ways(self, arc: Arc | None, quick: bool) -> tuple[tuple[Way, ...], int]:
        """Return the ways to a solution from nothing in their order, each as `newton` with u in place.

        The number of them that are tried before a part is held in place is the second value. Under constant
        forces the others take most of the time and find no motion of a part that a force drives away.
        """
        system, linear, point = self.system, self.linear, self.point
        stuck, rungs = (
            lambda u, p, way=way: way(system, linear, u, p, point) for way in (from_stuck, ladder)
        )
        soft = partial(solve_softened, self.balance.system, linear, point)
        along = () if arc is None else (partial(self._along, arc),)
        if self.balance.system.constant_mean:
            fewer = partial(self._from_fewer, arc)
            return (fewer, stuck, *along, *(() if quick else (soft, rungs))), 2
        fewer = partial(self._from_fewer, None)
        if np.any(self.balance.system.shift):  # contacts hold it: the less they stick the farther it may seem
            # What sticks with all it can carry is at its limit, where Newton's method is slow.
            onward = (self._onward,) if self.balance.system.hold else ()
            ways = (stuck, *onward, rungs, fewer, soft)
        else:
            ways = (stuck, fewer, soft, rungs)
        return (*ways, *along), len(ways)

    def _onward(self, u: Real, p: float) -> tuple[bool, int, float]:
        """Go on from `u` while that brings it ten times nearer, the result in `u`; as `newton`."""
        spent, before = 0, np.inf
        while True:
            good, more, norm = self._newton(u.copy(), u, p)
            spent += more
            if good or not norm < 0.1 * before:
                return good, spent, norm
            before = norm

    def _along(self, arc: Arc, u: Real, p: float) -> tuple[bool, int, float]:
        """Follow an arc, the result in `u`; as `newton`."""
        end, spent = arc(self, p)
        if end is None:
            return False, spent, np.inf
        good, more, norm = self._newton(end, u, p)
        return good, spent + more, norm

    def _from_fewer(self, arc: Arc | None, u: Real, p: float) -> tuple[bool, int, float]:
        """Add the harmonics little by little, the result in `u`; as `newton`.

        They become half as many again each time. Where Newton's method fails from one number to the next it
        is tried for the one between, and where none is from stuck contacts, then along an arc.
        """
        counts, spent = [self.balance.system.ks.size], 0
        last: tuple[Real, Integer] | None = None
        while (fewer := max(2 * counts[-1] // 3, FEWEST_HARMONICS)) < counts[-1]:
            counts.append(fewer)
        while counts:
            whole = len(counts) == 1
            here = self if whole else Workspace.of(fewer_harmonics(self.balance, counts[-1]))
            v, good, norm = np.zeros(here.balance.n_unknowns), False, np.inf
            if last is not None:
                good, more, norm = here._newton(here._padded(*last), v, p)
                spent += more
                between = (counts[-1] + last[1].size) // 2
                if not good and between > last[1].size:
                    counts.append(between)
                    continue
            if not good and not whole:
                good, more, norm = from_stuck(here.system, here.linear, v, p, here.point)
                spent += more
                if not good and arc is not None:
                    good, more, norm = here._along(arc, v, p)
                    spent, arc = spent + more, arc if good else None
            last = (v, here.balance.system.ks) if good else None
            counts.pop()
        u[:] = v
        return bool(good), int(spent), float(norm)

    def solve_from(self, p: float, guess: Real) -> PointSolution:
        """Solve at λ = `p` (inside unit) by Newton's method from `guess` alone."""
        return self._plain(p, (partial(self._newton, guess),))

    def obeys(self, u: Real) -> bool:
        """Return whether u obeys mechanics where it was last evaluated: powers and mean forces balance.

        The residual is relative to motions: of a light part far away it is small whatever the forces are.
        """
        return bool(unaccounted(self.system, self.linear, u, self.point) <= ALLOWED)

    def _stuck(self, p: float) -> Real:
        """Return the response of stuck contacts."""
        receptance(self.system, p, self.linear)
        u = np.zeros(self.balance.n_unknowns)
        stuck_start(self.system, self.linear, p, u)
        return u

    def law_fails(self, p: float, u: Real | None = None) -> bool:
        """Return whether a contact has no force at u, without one at the stuck response."""
        u = self._stuck(p) if u is None else u
        states = evaluation_by_value(self.point).states
        states[:] = STUCK
        self.forces(u, p)
        return bool(np.any(states == FAILED))

    def _unheld(self, u: Real) -> bool:
        """Return whether nothing holds a part against the mean force on it, where u was last evaluated.

        Each of its contacts slips both ways, is open, or carries all it can.
        """
        system, point = self.balance.system, evaluation_by_value(self.point)
        way = self._mean_forces(point) @ system.loose
        # A contact that sticks with all the mean force it can carry, and was pulled beyond, holds the part
        # the other way.
        full = point.elastic > 0.0
        beyond = point.elastic * u[:: self.balance.n_coefficients] - point.F[:, 0]
        if not np.all(way[full] * beyond[full] <= 0.0):
            return False
        # A contact that opens, or is pressed, along the way may hold the part elsewhere.
        contacts = self.balance.scene.contacts
        moves = np.zeros(way.size, bool)
        for first, contact in zip(system.first_port.tolist(), contacts, strict=False):
            if contact.normal_port is not None:
                moves[first + contact.normal_port] = True
            elif contact.OPENS:
                moves[first : first + len(contact.end_keys)] = True
        if np.any(np.abs(way[moves]) > ALONG * np.abs(way).max()):
            return False
        return bool(full.any() or point.counts[UNHELD])

    def _mean_forces(self, point: Evaluation) -> Real:
        """Return the mean forces along the motions of loose parts that were left where last evaluated.

        Of the parts' rigid-body motions l, Σ_c l_c kt_c r_c is the sum of all mean forces along them.
        """
        system = self.balance.system
        forces: Real = system.loose @ (system.shift * point.residual[:: self.balance.n_coefficients])
        return forces

    def _held_in_place(self, p: float, spent: int, guess: Real | None, quick: bool) -> PointSolution:
        """Solve where a constant force holds what no contact does: is the force 0, nothing drives the part.

        Under given loads the friction forces of two motions never work on their difference, so the motion of
        a part that needs such a force is no periodic one without it.
        """
        other = self.holding()
        found = other.solve(p, guess, quick=quick)
        u, spent, good = found.u, spent + found.iterations, found.converged
        failed = PointSolution(
            converged=False, u=u, iterations=spent, residual=np.inf, loses_power=found.loses_power
        )
        for side in range(2):
            if not good:
                break
            norm, _ = self.forces(u, p)
            if self.obeys(u):
                return PointSolution(converged=True, u=u, iterations=spent, residual=norm)
            if self._unheld(u):
                return replace(failed, iterations=spent, ratchets=True)
            start = self._other_side(u, p) if side == 0 else None
            if start is None:
                break
            good, more, _ = other._newton(start, u, p)
            spent += more
        return replace(failed, iterations=spent)

    def holding(self) -> Workspace:
        """Return the same where a constant force holds what no contact does."""
        return Workspace.of(replace(self.balance, system=self.balance.system._replace(hold=1)))

    def _other_side(self, u: Real, p: float) -> Real | None:
        """Return u with loose parts driven on, to where contacts that stick hold them the other way, or None.

        It is None where no contact that sticks all the time may.
        """
        system, n = self.balance.system, self.balance.n_coefficients
        _, point = self.forces(u, p)
        way = -(self._mean_forces(point) @ system.loose)
        may = (point.elastic > 0.0) & (way != 0.0)
        if not np.any(may):
            return None
        # As far as takes each from its limit on one side beyond that on the other.
        pulled = point.elastic * np.abs(u[::n]) + np.abs(point.F).max(axis=1)
        far = 2.0 * float((pulled[may] / (point.elastic[may] * np.abs(way[may]))).max())
        moved = u.copy()
        moved[::n] += far * way
        return moved

    def _newton(self, guess: Real, u: Real, p: float) -> tuple[bool, int, float]:
        """Run Newton's method from `guess`, the result in `u`."""
        u[:] = guess
        receptance(self.system, p, self.linear)
        return newton(self.system, self.linear, u, p, 0.0, self.point)

    def _padded(self, u: Real, ks: Integer) -> Real:
        """Return a solution with the fewer harmonics `ks`, filled up with zeros."""
        kept = u.reshape(self.balance.n_ports, coefficient_count(ks))
        return spread(kept, ks, self.balance.system.ks).reshape(-1)

    def evaluate(self, u: Real, p: float) -> tuple[float, Evaluation]:
        """Return the relative residual at (u, p) and everything evaluated there (views of scratch arrays)."""
        norm, point = self.forces(u, p)
        if point.jacobian.shape[0] == u.size:
            fill_jacobian(self.system, self.linear, self.point)
            return norm, point
        point = point._replace(jacobian=np.empty((u.size, u.size)))
        A = of_all_ports(self.balance.system, receptance_by_value(self.linear)).A
        whole_jacobian(self.system, A[0], self.point, point.jacobian)
        return norm, point

    def forces(self, u: Real, p: float) -> tuple[float, Evaluation]:
        """Return the same without the Jacobian, which is not in place."""
        receptance(self.system, p, self.linear)
        norm = evaluate(self.system, self.linear, u, p, 0.0, self.point)
        return float(norm), evaluation_by_value(self.point)

    def receptance(self, p: float) -> Receptance:
        """Return the condensed linear part of all ports at λ = `p` (views of scratch arrays, or new ones)."""
        receptance(self.system, p, self.linear)
        return of_all_ports(self.balance.system, receptance_by_value(self.linear))

    def measure(self, u: Real, p: float) -> PointMeasures | None:
        """Return what is observed at the solution (u, p) with slopes by λ; None where dr/du is singular."""
        receptance(self.system, p, self.linear)
        evaluate(self.system, self.linear, u, p, 0.0, self.point)
        observed, values = np.zeros(self.balance.n_coefficients), np.zeros(MEASURES)
        good = slope_by_parameter(self.system, self.linear, u, self.point, observed, values)
        return PointMeasures(observed=observed, values=values) if good else None


SOFTEST = 1e-4  # share of the stiffness to begin with
_FACTOR, _LARGEST, _LEAST = 10.0, 100.0, 1.1  # from one stiffness to the next
_FEW = 8  # iterations up to which the next factor is larger


def solve_softened(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float
) -> tuple[bool, int, float]:
    """Raise the tangential stiffness of every contact to its own, the result in `u`; as `newton`.

    Stiff contacts that slip far beyond what their springs give are nearly rigid friction, where Newton's
    method from full stick wanders. With springs so soft that no contact slips the response is found at once;
    on the way to the stiffness given each solution is the guess of the next.
    """
    contacts, own = system.contacts, by_reference(system)

    def softened(share: float) -> System:
        table = contacts.copy()
        table[:, [KT, KT_SECOND]] *= share
        return by_reference(system._replace(contacts=table))

    here, factor = SOFTEST, _FACTOR
    good, spent, norm = from_stuck(softened(here), linear, u, p, point)
    while good and here < 1.0:
        ahead, trial = min(1.0, here * factor), u.copy()
        receptance(own, p, linear)
        closer, more, norm = newton(softened(ahead), linear, trial, p, 0.0, point)
        spent += more
        if closer:
            u[:], here = trial, ahead
            factor = min(_LARGEST, factor**2) if more <= _FEW else factor
        else:
            factor = math.sqrt(factor)
            good = factor > _LEAST
    return bool(good), int(spent), float(norm) if good else np.inf
