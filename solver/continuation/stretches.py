"""A branch of responses as a curve whose steps are stretches of points that compiled steps find.

The steps themselves are of `solver.continuation.kernels.pseudo_arclength`; a stretch has as many as leave the
caller time to watch and stop. Where a walk goes no further it is said why, and whether it can be taken up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.jacobian import factorise
from solver.balance.kernels.mechanics import ALLOWED
from solver.balance.kernels.newton import ACCEPTED
from solver.balance.kernels.output import LOST, MEASURES
from solver.balance.kernels.residual import evaluate
from solver.balance.workspace import PointSolution, Workspace
from solver.contacts.kernels.columns import KT
from solver.contacts.kernels.system import AT_BRANCH_POINT, evaluation_by_value
from solver.continuation.branch import ROWS, BranchStatus, Points
from solver.continuation.kernels import walk_state as walk_states
from solver.continuation.kernels.pseudo_arclength import begin_walk, walk_on
from solver.continuation.kernels.walk_state import (
    COUNT,
    ITERATIONS,
    NUMBERS,
    Control,
    P,
    Walk,
    walk_by_value,
    weights,
)
from solver.continuation.walk import ContinuationSettings, Curve, Pace
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.jit.timer import clock
from solver.linear.kernels.receptance import receptance
from solver.linear.natural_frequencies import undamped_resonance
from solver.results.told import Piece
from solver.scene.scene_harmonics import Amplitudes

STIFFEST = 1e7
NEIGHBOUR = 0.05  # largest change of the vibration, relative, over which a branch is taken up again
MANY, NEAR, STILL = 24, 1e-7, 1e-3  # points within such shares of the range and of the motion lead nowhere
AWAY = 0.03  # share of the motion that a closed curve is wide at least
_MOVES = 1e-6  # share of the largest amplitude of a contact, of harmonics with which one moves
AHEAD = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # of the range, where it is looked why a branch went no further

_STRETCH = Pace(first=64, least=1, largest=64)  # points between two looks at the caller
_SHORT_STRETCH = 4  # the first of them where a point may take long
_LARGE = 200  # unknowns from which it may
_STRETCH_SECONDS = 0.5
_ENDINGS = {
    walk_states.FINISHED: BranchStatus.COMPLETED,
    walk_states.NO_START: BranchStatus.NO_START,
    walk_states.STALLED: BranchStatus.STALLED,
    walk_states.LEFT_RANGE: BranchStatus.TURNED_BACK,
}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stretch(Points, Piece):
    """Some consecutive points of a branch."""

    status: Annotated[BranchStatus | None, "How the branch ended with this stretch; None if it goes on."]
    newton_iterations: Annotated[int, "Since the branch began."]
    rejected_steps: Annotated[int, "Since the branch began."]
    stepped_over: Annotated[int, "Since the branch began."]
    seconds: Annotated[float, "Since the branch began [s]."]
    walk: Annotated[
        Real,
        "The state of the continuation behind the last point; empty if the branch could not begin, (6 "
        "n_unknowns + 18,).",
    ]

    def first(self, count: int) -> Stretch:
        """Return the first points alone, without the state of a continuation, which is that of the last."""
        rows: dict[str, Any] = {name: getattr(self, name)[:count] for name in ROWS}
        return replace(self, **rows, status=None, walk=np.zeros(0))

    def to_arrays(self) -> dict[str, Real | Integer]:
        """Return everything as plain arrays, to be stored."""
        ending = -1 if self.status is None else tuple(BranchStatus).index(self.status)
        counts = [ending, self.newton_iterations, self.rejected_steps, self.stepped_over]
        arrays: dict[str, Real | Integer] = {name: getattr(self, name) for name in ROWS}
        return arrays | {
            "counts": np.array(counts, np.int64), "seconds": np.array([self.seconds]), "walk": self.walk,
        }  # fmt: skip

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Real | Integer]) -> Stretch:
        """Return the stretch of such arrays (KeyError, ValueError or IndexError if they are not that)."""
        real = {name: np.ascontiguousarray(arrays[name], np.float64) for name in (*ROWS, "walk")}
        if real["measures"].shape[1] != MEASURES:
            raise ValueError(f"measures of a branch have {MEASURES} columns")
        ending, iterations, rejected, over = (int(number) for number in arrays["counts"])
        return cls(
            solutions=real["solutions"], tangents=real["tangents"],
            states=np.ascontiguousarray(arrays["states"], np.int64), observed=real["observed"],
            measures=real["measures"], status=None if ending < 0 else tuple(BranchStatus)[ending],
            newton_iterations=iterations, rejected_steps=rejected, stepped_over=over,
            seconds=float(arrays["seconds"][0]), walk=real["walk"],
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Where a branch begins, and who is given its points.

    Attributes
    ----------
    guess : (n_unknowns,) or None
        Slip motions [m] to start from, instead of the start-up ladder.
    resume : Stretch or None
        The beginning of the same branch, to go on behind its last point.
    on_stretch : callable or None
        Called with all consecutive points as they are found; `joined` they are what `resume` takes.
    on_points : callable or None
        Called with the new points, at first with those of `resume`: (k,) values in user units, (k,)
        amplitudes [m].
    """

    guess: Real | None = None
    resume: Stretch | None = None
    on_stretch: Callable[[Stretch], None] | None = None
    on_points: Callable[[Real, Real], None] | None = None


def joined(stretches: Sequence[Stretch]) -> Stretch:
    """Return consecutive stretches as one; at least one."""
    rows: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in stretches]) for name in ROWS}
    return replace(stretches[-1], **rows)


def rows_of(balance: Balance, count: int) -> dict[str, Any]:
    """Return empty rows for `count` points, in the order of `ROWS`."""
    nt, n, contacts = balance.n_unknowns, balance.n_coefficients, len(balance.scene.contacts)
    rows = [np.zeros((count, width)) for width in (nt + 1, nt + 1, contacts, n, MEASURES)]
    return dict(zip(ROWS, rows, strict=True)) | {"states": np.zeros((count, contacts), np.int64)}


def state_of(walk: Walk) -> Real:
    """Return the state of a continuation as one array."""
    return np.concatenate(walk_by_value(walk))


def go_on_from(workspace: Workspace, control: Control, stretch: Stretch) -> tuple[Walk, int]:
    """Return the continuation behind the last point of `stretch`, and the iterations before it began.

    The point is evaluated and its matrix factorised as they were when it was found, so that what follows is
    what would have followed.

    Raises
    ------
    SettingError
        The stretch is not of this balance: other sizes, or its last point is no solution.
    """
    balance, system, linear = workspace.balance, workspace.system, workspace.linear
    fits = all(getattr(stretch, name).shape[1:] == row.shape[1:] for name, row in rows_of(balance, 0).items())
    nt = balance.n_unknowns
    if not fits or stretch.walk.size != 6 * nt + 5 + NUMBERS or not len(stretch.solutions):
        raise _foreign(stretch)
    _, state = begin_walk(system, linear, workspace.point, control, stretch.walk[:nt].copy())
    places = walk_by_value(state)
    ends = np.cumsum([place.size for place in places])[:-1]
    for place, values in zip(places, np.split(stretch.walk, ends), strict=True):
        place[:] = values
    numbers = places.numbers
    receptance(system, numbers[P], linear)
    norm = evaluate(system, linear, places.u, numbers[P], 0.0, workspace.point)
    if not norm <= ACCEPTED or numbers[COUNT] < 0:
        raise _foreign(stretch)
    weight_u, weight_p = weights(system, state, control)
    if factorise(system, linear, workspace.point, places.before_tangent, weight_u, weight_p) != 0.0:
        evaluation_by_value(workspace.point).counts[AT_BRANCH_POINT] = 1
    return state, stretch.newton_iterations - int(numbers[ITERATIONS])


def _foreign(stretch: Stretch) -> SettingError:
    points = f"{len(stretch.solutions)} points"
    return SettingError("resume", points, "must be the beginning of the same branch")


def too_stiff(workspace: Workspace, first: float, last: float) -> bool:
    """Return whether a contact yields less than rounding leaves of its motion, at two λ (inside unit).

    The structure gives way by A per force, an elastic contact by 1/kt: with A kt above `STIFFEST` the force
    kt (u − w) of a contact about to slip is the difference of two motions that agree to the last digits. A
    resonance that nothing damps makes A large too, but at its own place alone: the beginning of the branch
    has to say the same.
    """
    both = [np.abs(np.diagonal(workspace.receptance(at).A[0], axis1=1, axis2=2)) for at in (first, last)]
    A = np.minimum(*both)
    system = workspace.balance.system
    kt = system.contacts[system.owner, KT]
    return bool(np.any(A * kt > STIFFEST))


def ends_undamped(workspace: Workspace, points: Real, start: float) -> bool:
    """Return whether a branch over the frequency ends, or cannot begin, near a resonance without damping.

    The last of its points tells what contacts hold of the motion that has grown.
    """
    balance, held = workspace.balance, None
    p = float(points[-1, -1]) if len(points) else start
    if len(points):
        u = points[-1, :-1].copy()
        evaluate(workspace.system, workspace.linear, u, p, 0.0, workspace.point)
        F = evaluation_by_value(workspace.point).F
        moves = balance.system.ks > 0
        hat = Amplitudes(balance.system.ks)
        pairs = hat.of(u.reshape(F.shape)), hat.of(F)
        motions, forces = (each[:, moves].T for each in pairs)
        seen = np.abs(motions) > _MOVES * np.abs(motions).max(initial=0.0)
        held = np.where(seen, (forces / np.where(seen, motions, 1.0)).real, 0.0)
    at_hz = float(balance.parameter.outside(p))
    return undamped_resonance(balance.scene, at_hz, balance.system.ks, held)


def stands_still(points: Real, control: Control) -> bool:
    """Return whether many points are one but for rounding: a branch that ends within the tolerances."""
    near = NEAR * abs(control.stop - control.start)
    if len(points) < MANY or abs(points[-1, -1] - points[0, -1]) > near or np.ptp(points[:, -1]) > near:
        return False
    moved, size = np.ptp(points[:, :-1], axis=0), np.abs(points[:, :-1]).max(initial=0.0)
    return bool(moved.max(initial=0.0) <= STILL * size)


Ahead = Callable[[float], PointSolution | None]
"""To the solution at such a share of the range further on; None beyond it, and where no part may drift."""


def ahead_of(workspace: Workspace, last: Real, control: Control) -> Ahead:
    """Return what solves behind the last point of a branch, at each place once: a search takes long."""
    p, span = float(last[-1, -1]), control.stop - control.start

    @cache
    def solved(share: float) -> PointSolution | None:
        beyond = (p + share * span - control.stop) * span > 0.0
        if beyond or not len(workspace.balance.system.loose):
            return None
        return workspace.solve(p + share * span, last[-1, :-1], quick=True)

    return solved


def taken_up(
    workspace: Workspace, control: Control, state: walk_states.Walk, last: Real, ahead: Ahead
) -> walk_states.Walk | None:
    """Return the branch taken up a little further on, if a mean that nothing held is all that moves.

    Where a contact begins to stick again its mean has to be what the part's equilibrium asks for, wherever
    the part stood while nothing held it.
    """
    balance, span = workspace.balance, control.stop - control.start
    if len(last) < 2 or (last[-1, -1] - last[-2, -1]) * span <= 0.0:
        return None
    before = last[-1, :-1].reshape(balance.n_ports, -1)[:, 1:]
    for share in AHEAD[:3]:
        found = ahead(share)
        if found is None:
            return None
        if not found.converged:
            continue
        moved = np.abs(found.u.reshape(balance.n_ports, -1)[:, 1:] - before).max()
        if moved > NEIGHBOUR * max(np.abs(before).max(), np.finfo(float).tiny):
            continue
        begun = control._replace(start=float(last[-1, -1]) + share * span)
        code, again = begin_walk(workspace.system, workspace.linear, workspace.point, begun, found.u)
        numbers, old = walk_by_value(again).numbers, walk_by_value(state).numbers
        for each in (walk_states.ITERATIONS, walk_states.REJECTED, walk_states.STEPPED_OVER):
            numbers[each] += old[each]
        numbers[walk_states.STEPPED_OVER] += 1
        return again if code == walk_states.RUNNING else None
    return None


def comes_back(stretches: Sequence[Stretch]) -> bool:
    """Return whether a branch goes round a closed curve: its last points lie where it was before.

    Half of them lie so near to the line between two points that were passed in the same direction, and the
    branch was far away since; a wiggle about a corner does not count.
    """
    *ends, end = (one.solutions[-1, -1] for one in stretches if len(one.solutions))
    if not ends or not min(ends) <= end <= max(ends):
        return False
    points = np.concatenate([one.solutions for one in stretches])
    last, before, hits = points[-MANY:], points[:-MANY], 0
    size = np.abs(last[:, :-1]).max(initial=0.0)
    for point, step in zip(last[1:], np.diff(last[:, -1]), strict=True):
        off = before[:, -1] - point[-1]
        k = np.flatnonzero((off[:-1] * off[1:] < 0.0) & (np.diff(off) * step > 0.0))
        share = (off[k] / (off[k] - off[k + 1]))[:, None]
        between = (1.0 - share) * before[k, :-1] + share * before[k + 1, :-1]
        near = k[np.abs(between - point[:-1]).max(axis=1, initial=0.0) <= STILL * size]
        hits += bool(near.size) and bool(np.abs(before[near[0] :, :-1] - point[:-1]).max() > AWAY * size)
    return hits >= MANY // 2


def control_of(settings: ContinuationSettings, start: float, stop: float, pace: Pace) -> Control:
    """Return the settings of the compiled steps from one λ to another (inside unit)."""
    return Control(
        start=start, stop=stop, first_step=pace.first, largest_step=pace.largest, smallest_step=pace.least,
        wanted_iterations=int(pace.easy), most_iterations=int(pace.hard), predictor=int(settings.predictor),
        largest_turn=settings.largest_turn, range_weight=settings.range_length,
    )  # fmt: skip


class BranchStretches(Curve[Stretch]):
    """A branch as it stands behind its last stretch.

    Parameters
    ----------
    code, state : of `begin_walk`.
    spent : Newton iterations before.
    begun : time at which the work began.
    """

    def __init__(
        self, workspace: Workspace, control: Control, code: int, state: Walk, spent: int, begun: float
    ) -> None:
        self._workspace, self._control, self._code, self._state = workspace, control, code, state
        self._spent, self._begun = spent, begun
        self._last = np.zeros((0, workspace.balance.n_unknowns + 1))
        self._status: BranchStatus | None = None

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""
        return self._status is not None or self._code != walk_states.RUNNING

    @property
    def pace(self) -> Pace:
        """How many points its stretches have."""
        large = self._workspace.balance.n_unknowns > _LARGE
        return replace(_STRETCH, first=_SHORT_STRETCH) if large else _STRETCH

    def tried(self, size: float) -> tuple[Stretch | None, float]:
        """Return the next stretch, of no more than `size` points, and how many the one behind it may have."""
        workspace, control, state, before = self._workspace, self._control, self._state, clock()
        rows, springs = rows_of(workspace.balance, int(size)), workspace.springs.rows(int(size))
        filled = [*rows.values(), springs]
        code, count = walk_on(
            workspace.system, workspace.linear, workspace.point, control, state, int(size), *filled
        )
        workspace.springs.keep(rows["solutions"][:count], springs)
        self._last = last = np.concatenate([self._last, rows["solutions"][:count]])[-MANY:]
        if code == walk_states.RUNNING and stands_still(last, control):
            code = walk_states.STALLED
        status, again = _ENDINGS.get(code), None
        if status is BranchStatus.STALLED:
            ahead = ahead_of(workspace, last, control)
            again = taken_up(workspace, control, state, last, ahead)
            if again is not None:
                status, code = None, walk_states.RUNNING
            elif any(found is not None and found.ratchets for found in map(ahead, AHEAD)):  # a part drifts
                status = BranchStatus.RATCHETS
        stretch = balanced_part(workspace, self._stretch(rows, count, status))
        self._code, self._status, self._state = code, stretch.status, state if again is None else again
        longer = min(2.0, _STRETCH_SECONDS / max(clock() - before, 1e-9))
        return stretch, min(_STRETCH.largest, max(_STRETCH.least, int(size * longer)))

    def _stretch(self, rows: dict[str, Any], count: int, status: BranchStatus | None) -> Stretch:
        numbers = walk_by_value(self._state).numbers
        return Stretch(
            **{name: row[:count] for name, row in rows.items()}, status=status,
            newton_iterations=self._spent + int(numbers[walk_states.ITERATIONS]),
            rejected_steps=int(numbers[walk_states.REJECTED]),
            stepped_over=int(numbers[walk_states.STEPPED_OVER]),
            seconds=clock() - self._begun, walk=state_of(self._state),
        )  # fmt: skip


def balanced_part(workspace: Workspace, stretch: Stretch) -> Stretch:
    """Return a stretch up to the first point that does not obey mechanics; itself if all do.

    What is cut ends as `ending` says of a solution from nothing there.
    """
    wrong = ~(stretch.measures[:, LOST] <= ALLOWED)
    if not wrong.any():
        return stretch
    first = int(np.argmax(wrong))
    found = Workspace.of(workspace.balance).solve(float(stretch.solutions[first, -1]))
    return replace(stretch.first(first), status=ending(found, BranchStatus.STALLED), walk=np.zeros(0))


def ending(found: PointSolution, else_: BranchStatus) -> BranchStatus:
    """Return why a branch ends where this was tried from nothing."""
    if found.ratchets:
        return BranchStatus.RATCHETS
    return BranchStatus.POWER_LOST if found.loses_power else else_
