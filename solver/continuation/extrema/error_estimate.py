"""How far off an answer is: by the harmonics left out, and by the residual that was left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.balance.balance import less_harmonics, linear_part, more_harmonics, pad
from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.locate import tangent_at
from solver.balance.kernels.output import extremes
from solver.balance.rounding import observed_rounding
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import (
    FROM_REST,
    UTILISED,
    by_reference,
    evaluation_by_value,
    new_receptance,
    receptance_by_value,
)
from solver.continuation.branch import Branch
from solver.continuation.extrema.kernels.error_steps import (
    FIRST,
    SECOND,
    change_of,
    motion_at,
    step_by,
    steps_beyond,
)
from solver.jit.fourier import Real
from solver.linear.kernels.receptance import receptance
from solver.results.told import Piece
from solver.scene.scene_harmonics import MULTIPLES, Amplitudes, among, is_fast

# Harmonics looked at beyond those kept, for a solution with H of them: H + max(H, 8).
_LEAST_BEYOND = 8
# How much farther the receptance is looked at, and entries of it that are held at once.
_TAIL = 4
_AT_ONCE = 2**21
# Fitted to 600 random scenes, see docs/accuracy.md: 98 % of the true errors are below the estimate.
SAFETY = 1.7
# A second step above this share of the first, and a change above this share of the amplitude: the first order
# does not tell what more harmonics do, and the balance with them is solved.
_FIRST_ORDER = 0.1
_INSTANTS = 512  # of a period, at which the force of a law is compared with that of a finer one
_DEAR = 1000  # unknowns: so many are not solved from nothing for an estimate, which takes minutes
_NEARER = 2.0 / 3.0  # of the harmonics added: these are looked at without the others too


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ErrorEstimate(Piece):
    """Estimated errors of an answer [m]; NaN where the balance with more harmonics is singular."""

    max_abs: float
    half_peak_to_peak: float


UNKNOWN = ErrorEstimate(max_abs=math.nan, half_peak_to_peak=math.nan)


class ErrorEstimator:
    """Estimates the errors of solutions of one balance.

    The closed-form contact force of a solution has coefficients beyond H. Put into the balance with about
    twice the harmonics, they are its residual, beside what Newton's method left on the harmonics kept. One
    Newton step there is the first-order change of the solution, a second one with the same matrix shows what
    the first order misses. Harmonic by harmonic the change goes up and down, and its sum may come out near
    zero by accident: so a step by the residual of the nearer of the harmonics added is looked at too.
    Where the second step is long, as where a stiff contact stops the motion for a while, that balance is
    solved at fixed λ and its change counts instead; if no solution is found, from that motion or, if
    that is not dear, from nothing, the difference from the one with half of the harmonics, if that is less.
    The estimate is the largest change of the amplitude, at least a tenth of the change of the motion at its
    worst instant, times `SAFETY`.

    Harmonics still beyond are added with coefficients that fall like 1/k², as those of a force with kinks do,
    weighted by the receptance of the structure with the mean stiffness of its contacts, so that a resonance
    out there is not overlooked. Where these move the contacts more than the harmonics looked at, as they do
    up to the resonance of a light damper on its stiff contacts, the change counts as many times; up to twice
    where they would without these stiffnesses, which contacts that slip do not have, and where contacts are
    stiffer than the structure at the highest harmonic looked at: friction jumps there for all they can tell,
    the error falls like 1/H, and what is found up to 2 H is one half of it.
    """

    def __init__(self, workspace: Workspace) -> None:
        balance = workspace.balance
        highest = balance.n_harmonics
        self._workspace = workspace
        self._top = highest + max(highest, _LEAST_BEYOND)
        self._larger = Workspace.of(more_harmonics(balance, self._top, multiples=2 * MULTIPLES), workspace)
        ks = self._larger.balance.system.ks
        self._hat = Amplitudes(ks)
        self._added = ~among(balance.system.ks, ks)
        added = ks[self._added]
        # Which coefficients are of harmonics kept or of those added, the farthest left out.
        nearer = ks < added[int(_NEARER * added.size)] if added.size else ks >= 0
        self._nearer = np.repeat(nearer, 1 + (ks > 0))
        beyond = linear_part(self._larger.balance, _TAIL * self._top)
        self._is_beyond = ~among(ks, beyond.ks)
        self._all_ks, self._beyond_ks = beyond.ks, beyond.ks[self._is_beyond]
        self._is_fast = is_fast(balance.scene, ks)
        self._later_is_fast = is_fast(balance.scene, self._beyond_ks)
        ports = zip(balance.system.first_port.tolist(), balance.scene.contacts, strict=False)
        self._discretised = [(port, contact) for port, contact in ports if contact.DISCRETISED]
        self._stiffest = np.array([k for each in balance.scene.contacts for k in each.stiffnesses])
        self._beyond = by_reference(beyond)
        self._beyond_linear = new_receptance(self._beyond)

    @property
    def larger(self) -> Workspace:
        """The balance with more harmonics, in which the residual is looked at."""
        return self._larger

    def at(self, u: Real, p: float, *, across: bool = False) -> ErrorEstimate:
        """Estimate the errors at a solution.

        Parameters
        ----------
        u : (n_unknowns,) a converged solution.
        p : its λ (inside unit).
        across : the error across the branch, not that at a fixed λ. It is what counts at a peak: a resonance
            that moves a little in frequency is not wrong in height. At a fold only this one is finite.
        """
        workspace, larger = self._workspace, self._larger
        kept, wide = workspace.balance, larger.balance
        before, tangent = np.empty(kept.n_coefficients), np.zeros(wide.n_unknowns + 1)
        if not motion_at(workspace.system, workspace.linear, workspace.point, u, p, True, before):
            return UNKNOWN
        if across:
            slope = np.empty(u.size + 1)
            if not tangent_at(workspace.system, workspace.linear, workspace.point, slope):
                return UNKNOWN
            tangent[:-1], tangent[-1] = pad(slope[:-1], kept, wide), 1.0
        x, U, after = pad(before, kept, wide), pad(u, kept, wide), np.empty(wide.n_coefficients)
        if not motion_at(larger.system, larger.linear, larger.point, U, p, True, after):
            return UNKNOWN
        tail, more = self._tail(evaluation_by_value(larger.point).F, p)
        rounding, found = observed_rounding(larger, U, p, across=across), np.empty((3, 3))
        if not steps_beyond(
            larger.system, larger.linear, larger.point, U, p, tangent, self._nearer, across, x, found
        ):
            return UNKNOWN
        of_laws = self._of_laws(x, U, p, across=across)
        if of_laws is None:
            return UNKNOWN
        high, _, low, _ = extremes(larger.system, x)
        amplitude, per_motion = max(high, -low), 1.0
        if kept.system.centred == UTILISED:
            amplitude, by_half, by_mean = utilisation(kept.system.haigh, high, low)[:3]
            per_motion = by_half + abs(by_mean)
        largest = found[:, :2].max(axis=0)
        first_order = found[SECOND, 2] <= _FIRST_ORDER * found[FIRST, 2]
        if not (across or first_order) and largest[0] > _FIRST_ORDER * amplitude:
            largest = self._solved(x, U, p, largest)
        changes, rounding = more * SAFETY * largest, per_motion * rounding
        # Changes within the rounding are rounding.
        changes = np.where(changes <= rounding, 0.0, changes) + SAFETY * of_laws
        max_abs, half_range = changes + rounding + per_motion * tail
        if kept.system.centred != FROM_REST:
            max_abs = half_range
        return ErrorEstimate(max_abs=float(max_abs), half_peak_to_peak=float(half_range))

    def _of_laws(self, x: Real, U: Real, p: float, *, across: bool) -> Real | None:
        """Return the changes by what the laws' own discretisations leave out; None where they lead nowhere.

        It is a force beside that of the contacts, put into the balance along the motion found.
        """
        if not self._discretised:
            return np.zeros(2)
        system, linear = self._larger.balance.system, self._larger.receptance(p)
        angles = 2.0 * np.pi / _INSTANTS * np.arange(_INSTANTS)[:, None] * system.ks
        turns = np.exp(1j * angles)
        motions = np.real(self._hat.of(U.reshape(system.owner.size, -1)) @ turns.T)
        forces = np.zeros((system.ks.size, system.owner.size), np.complex128)
        for first, contact in self._discretised:
            left = contact.unresolved(motions[first])
            if left is not None:
                forces[:, first] = 2.0 / _INSTANTS * (left @ turns.conj())
        forces[system.ks == 0] *= 0.5
        pushed = np.matmul(linear.A[0], forces[:, :, None])[:, :, 0]
        larger, moved, found = self._larger, self._hat.coefficients(pushed.T).reshape(-1), np.empty(3)
        place, after = np.empty(U.size + 1), np.empty(x.size)
        where = larger.system, larger.linear, larger.point
        step_by(*where, U, p, moved, across, x, place, found)
        if not np.isfinite(found[0]) or not motion_at(*where, place[:-1], place[-1], across, after):
            return None
        seen = -self._hat.coefficients((linear.B[0] * forces).sum(axis=1))
        return np.array(change_of(larger.system, x, after + seen))

    def _solved(self, x: Real, U: Real, p: float, largest: Real) -> Real:
        """Return the changes of a motion to the solution with more harmonics, or else to that with fewer.

        From U on it may not be found where a harmonic added meets a resonance, but from nothing, if that is
        not dear. The latter are about those of twice the harmonics, if not more, and count below `largest`.
        """
        larger, after = self._larger, np.empty(x.size)
        found = larger.solve_from(p, U)
        if not found.converged and U.size < _DEAR:
            found = larger.solve(p)
        if found.converged and motion_at(larger.system, larger.linear, larger.point, found.u, p, True, after):
            return np.array(change_of(larger.system, x, after))
        fewer = self._with_fewer(p)
        return largest if fewer is None else np.minimum(largest, change_of(larger.system, x, fewer))

    def _with_fewer(self, p: float) -> Real | None:
        """Return the observed coefficients of the solution with half of the harmonics; None without."""
        less = less_harmonics(self._workspace.balance, self._workspace.balance.n_harmonics // 2)
        if less.system.ks.size in (0, self._workspace.balance.system.ks.size):
            return None
        smaller, x = Workspace.of(less, self._workspace), np.empty(less.n_coefficients)
        found = smaller.solve(p)
        good = found.converged and motion_at(
            smaller.system, smaller.linear, smaller.point, found.u, p, True, x
        )
        return pad(x, less, self._larger.balance) if good else None

    def _tail(self, F: Real, p: float) -> tuple[float, float]:
        """Return what harmonics beyond those of the larger balance do.

        That is the motion of the observed DOF [m], NaN where structure and contacts are singular there, and
        how many times as much as the harmonics that only the larger balance has they move the contacts, at
        least 1.
        """
        ks, added = self._larger.balance.system.ks, self._added
        sizes = np.zeros((F.shape[0], ks.size))
        moving = ks > 0
        pairs = F[:, int(ks[0] == 0) :].reshape(F.shape[0], int(moving.sum()), 2)
        sizes[:, moving] = np.hypot(pairs[..., 0], pairs[..., 1])
        # Of each port at harmonics beyond: of waves of their own, each with its own rate.
        weighted, later = sizes * ks**2, np.zeros((self._beyond_ks.size, F.shape[0]))
        for fast in (False, True):
            own = self._is_fast == fast
            late = weighted[:, own][:, np.count_nonzero(own) // 2 :]
            which = self._later_is_fast == fast
            later[which] = np.max(late, axis=1, initial=0.0) / self._beyond_ks[which, None] ** 2
        if not sizes[:, added].any() and not later.any():
            return 0.0, 1.0
        forces = np.zeros((self._all_ks.size, F.shape[0]))
        forces[self._is_beyond], forces[among(ks[added], self._all_ks)] = later, sizes[:, added].T
        try:
            seen, moved, last = self._beyond_motions(forces, p)
        except np.linalg.LinAlgError:
            return math.nan, 1.0
        far, near = (moved[:, part].sum(axis=1) for part in (self._is_beyond, ~self._is_beyond))
        further, bare = far.max(axis=1, initial=0.0) / np.maximum(near.max(axis=1, initial=0.0), 1e-300)
        jumps = 1.0 + float(np.max(last / (1.0 + last), initial=0.0))
        tail = float(seen[self._is_beyond].sum())
        return tail, max(jumps, float(further), min(float(bare), 2.0)) if near.any() else 1.0

    def _beyond_motions(self, forces: Real, p: float) -> tuple[Real, Real, Real]:
        """Return what forces of any phase do at harmonics beyond: forces δF = F + κ δu, motions δu = −A δF.

        Parameters
        ----------
        forces : (nk, nc) amplitudes; only ports with any, of harmonics with any, are looked at.

        Returns
        -------
        (nk,) bounds of the motion of the observed DOF; (2, nk, nc) of the contacts, with κ and without;
        (nc,) the receptance of the highest harmonic looked at times the stiffest slope of each contact.

        Raises
        ------
        numpy.linalg.LinAlgError
            Structure and contacts are singular there.
        """
        system, stiffness = self._larger.balance.system, self._mean_stiffness()
        receptance(self._beyond, p, self._beyond_linear)
        linear = receptance_by_value(self._beyond_linear)
        span = system.span if linear.A.shape[2] < forces.shape[1] else None
        springs = np.diag(stiffness) if span is None else span.T @ (stiffness[:, None] * span)
        pushed = np.flatnonzero(forces.any(axis=0))
        seen, moved = np.zeros(forces.shape[0]), np.zeros((2, *forces.shape))
        wanted = np.flatnonzero(forces.any(axis=1))
        count = math.ceil(wanted.size * forces.shape[1] * pushed.size / _AT_ONCE)
        for part in np.array_split(wanted, count) if count > 1 else (wanted,):
            A, B, sizes = linear.A[0, part], linear.B[0, part, None], forces[part][:, pushed, None]
            bare = A[:, :, pushed] if span is None else A @ span[pushed].T
            held = np.linalg.solve(np.eye(A.shape[1]) + A @ springs, bare)
            weights = B * stiffness if span is None else (B * stiffness) @ span
            seen[part] = (np.abs(B[..., pushed] - weights @ held) @ sizes)[:, 0, 0]
            for way, motions in enumerate((held, bare)):
                real, imag = (each if span is None else span @ each for each in (motions.real, motions.imag))
                moved[way, part] = (np.sqrt(real * real + imag * imag) @ sizes)[..., 0]
        A = linear.A[0, ~self._is_beyond][-1]
        own = np.diagonal(A) if span is None else np.einsum("ca,ca->c", span, span @ A.T)
        return seen, moved, np.abs(own) * self._stiffest

    def _mean_stiffness(self) -> Real:
        """Return what contacts add to the structure at high harmonics where last evaluated, (nc,) [N/m]."""
        system, point = self._larger.balance.system, evaluation_by_value(self._larger.point)
        ports = np.diff(system.first_port)[system.owner]
        port = np.arange(system.owner.size) - system.first_port[system.owner]
        own = system.first_block[system.owner] + port * (ports + 1)
        mean = 0.5 * (point.dF_dU[own, -1, -1] + point.dF_dU[own, -2, -2])  # of cosine and sine
        slopes: Real = np.maximum(mean, 0.0) - system.shift
        return slopes


def truncation_error(workspace: Workspace, u: Real, p: float) -> ErrorEstimate:
    """Estimate the errors of one solution (u, λ = p), see `ErrorEstimator`."""
    return ErrorEstimator(workspace).at(u, p)


def branch_errors(branch: Branch, indices: Sequence[int] | None = None) -> Real:
    """Estimate the error of max|x| at points of a branch [m], measured across the branch.

    Parameters
    ----------
    branch : of `solver.sweep`.
    indices : which points; all of them if left out. A point costs about as much as its computation did.

    Returns
    -------
    (len(indices),) estimates; NaN where the balance with more harmonics is singular.
    """
    estimator = ErrorEstimator(Workspace.of(branch.balance))
    rows = branch.solutions if indices is None else branch.solutions[list(indices)]
    return np.array([estimator.at(row[:-1], float(row[-1]), across=True).max_abs for row in rows])
