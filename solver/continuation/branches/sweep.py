"""Continuation of periodic responses in any parameter: `sweep`, and the walk it is made of.

It is taken in stretches (`solver.continuation.stretches`), so that the caller can watch and stop; here the
result is put together.

Where the response is unique (`solver.continuation.branches.point_by_point`) every solution at a frequency is
the response there, whatever it was found from. Steps along an arc are short wherever contacts change, also
far below the peaks: who looks for the highest peak alone begins with few points, `sampled`, and solves for
more where it may stand (`solver.continuation.extrema.extrema`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, Kind, build
from solver.balance.kernels.output import MAX_ABS
from solver.balance.rounding import resonates_undamped
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import is_spanned
from solver.continuation.branch import ROWS, Branch, BranchStatus, Peak, Points, uncertain
from solver.continuation.branches.adaptive_harmonics import sweep_to
from solver.continuation.branches.point_by_point import is_unique, rows_before_a_turn, walk_by_points
from solver.continuation.branches.symmetry_breaking import branch_flags
from solver.continuation.extrema.branch_error import branch_error, nothing_damps
from solver.continuation.extrema.extrema import Survey, band_limit
from solver.continuation.extrema.kernels.node_table import WORTH_POLISHING, PointRow
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.from_nothing import solve_from_nothing
from solver.continuation.kernels import walk_state as walk_states
from solver.continuation.kernels.pseudo_arclength import begin_walk
from solver.continuation.parameter_scale import check_range
from solver.continuation.stretches import (
    AHEAD,
    BranchStretches,
    Course,
    Stretch,
    comes_back,
    control_of,
    ending,
    ends_undamped,
    go_on_from,
    joined,
    rows_of,
    too_stiff,
)
from solver.continuation.walk import ContinuationSettings, walk
from solver.errors import SettingError
from solver.jit.fourier import Real, to_full
from solver.jit.timer import clock
from solver.results.known import ABOVE_FRICTION
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.bodies.shape_parts import SPEED
from solver.scene.parameter_paths import FREQUENCY
from solver.scene.scene import Scene

# Unknowns from which a point is so dear that the largest step is longer, and how much: the survey adds what
# it needs. Where fewer motions lead the others so is the first one, and of so many ports the arc grows by the
# root of how many go along with each: so do its steps.
# Forces in space are dear from fewer unknowns on.
DEAR, _LONGER, _DEAR_FORCES, _LONGER_THERE, _ALONG = 1000, 2.5, 200, 2.0, 48
_MOST_FOLLOWED = 500  # points of a look at a resonance beside the branch
LOST_FROM_HERE = (BranchStatus.NO_START, BranchStatus.STALLED, BranchStatus.TURNED_BACK)
_LOST = (*LOST_FROM_HERE[1:], BranchStatus.TOO_MANY_POINTS, BranchStatus.POWER_LOST)

LEAST, STEP = 40, 0.015  # intervals of a range at least, and share of a frequency that one is long at most


@shows_progress("sweep")
def sweep(
    scene: Scene, parameter: str = "frequency", start: float | None = None, stop: float | None = None, *,
    harmonics: int = 11, accuracy: float | None = None, frequency_hz: float | None = None,
    limit: float | None = None, settings: ContinuationSettings | None = None, effects: Effects | None = None,
    course: Course | None = None, on_progress: OnProgress = None, should_stop: ShouldStop = None,
) -> Branch:  # fmt: skip
    """Follow the periodic response over a range of one parameter.

    As `stickslip.sweep` it takes `peaks` and `errors` of the settings and the fields of the course by
    themselves too: ``sweep(scene, errors=False)``.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``frequency`` or ``shroud.N0``. The ``speed`` along an
        engine-order line is the frequency in other units: the branch is one over the frequency.
    start, stop : the range in user units (Hz for a frequency, the scene's band if left out; 1/min for a
        speed). A response that is lost from `start` on is followed from `stop`, and begins there.
    harmonics : highest harmonic kept, unless `accuracy` is given.
    accuracy : estimated error, relative to the amplitude, that the harmonics are chosen for; see
        `solver.continuation.branches.adaptive_harmonics.harmonics_for` for where and how it is judged.
    frequency_hz : excitation frequency [Hz], needed unless it is the parameter.
    limit : amplitude [m] above which the resonance band is measured; peak/√2 if left out.
    settings : of the continuation, and whether peaks and errors are looked for.
    effects : what is paid for though the scene does not call for it; see
        `solver.balance.simplifications.Effects`.
    course : where the branch begins, and who is given its points, before `on_progress`; nobody while
        `accuracy` is looked for, which may begin again with more harmonics.
    on_progress : called with (share of the range reached, points so far).
    should_stop : asked between stretches of points; True ends the branch with the status STOPPED.

    Returns
    -------
    The branch; whatever happened, it holds converged points only, and its status says how it ended.

    Raises
    ------
    SettingError
        A bad path, range, frequency, limit, number of harmonics or accuracy; a beginning of another branch.
    """
    if parameter == SPEED and scene.speed_order is not None:
        parameter = FREQUENCY
        start, stop = (None if end is None else end * scene.speed_order / 60.0 for end in (start, stop))
    course, settings = course or Course(), settings or ContinuationSettings()
    if accuracy is not None and (course.guess is not None or course.resume is not None):
        raise SettingError(
            "accuracy", accuracy, "cannot go with a guess or a beginning, whose harmonics are fixed"
        )
    if parameter == FREQUENCY:
        start = scene.observe.band[0] if start is None else start
        stop = scene.observe.band[1] if stop is None else stop

    def with_harmonics(count: int, course: Course) -> Branch:
        balance = build(scene, parameter, harmonics=count, frequency_hz=frequency_hz, effects=effects)
        found = _swept(balance, start, stop, limit, settings, course, on_progress, should_stop)
        if parameter != FREQUENCY or found.status not in LOST_FROM_HERE or course.guess is not None:
            return found
        again = Course(on_points=course.on_points)
        other = _swept(balance, stop, start, limit, settings, again, on_progress, should_stop)
        return found if other.status in LOST_FROM_HERE else other

    if accuracy is None:
        return with_harmonics(harmonics, course)
    return sweep_to(lambda count: with_harmonics(count, Course()), accuracy)


def _swept(
    balance: Balance, start: float | None, stop: float | None, limit: float | None,
    settings: ContinuationSettings, course: Course, on_progress: OnProgress, should_stop: ShouldStop,
) -> Branch:  # fmt: skip
    """Return the branch of a balance, as `sweep`."""
    begun = clock()
    first, last = check_range(balance.parameter, start, stop)
    check_limit(limit)
    workspace = Workspace.of(balance)
    stretches: list[Stretch] = []
    status, count = BranchStatus.TOO_MANY_POINTS, 0
    for stretch in _covering(workspace, first, last, settings, course):
        stretches.append(stretch)
        count += len(stretch.solutions)
        if course.on_stretch is not None and stretch is not course.resume:
            course.on_stretch(stretch)
        high = stretch.measures[:, MAX_ABS].max(initial=0.0) > settings.highest
        ended = BranchStatus.TOO_HIGH if high else stretch.status
        if ended is not None or comes_back(stretches):
            status = ended or BranchStatus.STALLED
            break
        if course.on_points is not None:
            values = balance.parameter.all_outside(stretch.solutions[:, -1].copy())
            course.on_points(values, stretch.measures[:, MAX_ABS])
        if on_progress is not None:
            here = float(balance.parameter.outside(stretch.solutions[-1, -1]))
            on_progress(min(max((here - first) / (last - first), 0.0), 1.0), count)
        if should_stop is not None and should_stop():
            status = BranchStatus.STOPPED
            break
        if count >= settings.most_points:
            break
    rows = [one.solutions[place, -1] for one in stretches if len(one.solutions) for place in (0, -1)]
    if status in _LOST and rows and too_stiff(workspace, float(rows[0]), float(rows[-1])):
        status = BranchStatus.TOO_STIFF
    peaks = settings.peaks and (settings.unfinished_peaks or status is BranchStatus.COMPLETED)
    earlier = 0.0 if course.resume is None else course.resume.seconds
    competes = settings.competes if peaks else math.inf
    branch = _finish(workspace, stretches, status, first, last, limit, begun - earlier, competes)
    if settings.errors:
        branch = with_error(branch, workspace)
    if on_progress is not None and branch.reached:
        on_progress(1.0, len(branch.values))
    return branch


def _covering(
    workspace: Workspace, start: float, stop: float, settings: ContinuationSettings, course: Course
) -> Iterator[Stretch]:
    """Yield the branch as `walk_branch`; what cannot be followed is solved by points where it is unique."""
    resume = course.resume
    begun = clock() - (0.0 if resume is None else resume.seconds)
    balance = workspace.balance
    first, last = balance.parameter.inside(start), balance.parameter.inside(stop)
    unique = is_unique(balance)
    before, earlier = None, None
    if resume is not None and len(resume.solutions) and not resume.walk.size:
        before = resume
        yield resume
    else:
        for stretch in walk_branch(workspace, start, stop, settings, course.guess, resume):
            turned = rows_before_a_turn(stretch, first, last) if unique else None
            lost = unique and stretch.status in (BranchStatus.STALLED, BranchStatus.TURNED_BACK)
            if turned is None and not lost:
                yield stretch
                earlier = stretch
                continue
            before = stretch.first(len(stretch.solutions) if turned is None else turned)
            if len(before.solutions):
                yield before
            elif earlier is not None:
                before = earlier.first(len(earlier.solutions))
            else:
                yield stretch
                return
            break
    if before is not None and before.status is None:
        yield from walk_by_points(workspace, before, last, abs(last - first), begun)


def check_limit(limit: float | None) -> None:
    """Refuse a limit of the band that is no amplitude, by a SettingError."""
    if limit is not None and not (isinstance(limit, (int, float)) and np.isfinite(limit) and limit > 0.0):
        raise SettingError("limit", limit, "must be an amplitude > 0 m")


def walk_branch(
    workspace: Workspace, start: float, stop: float, settings: ContinuationSettings,
    guess: Real | None = None, resume: Stretch | None = None,
) -> Iterator[Stretch]:  # fmt: skip
    """Yield the branch in stretches; the last one carries the status. The caller owns stop, save and plot.

    Parameters
    ----------
    workspace : of the balance in the parameter that is continued in.
    start, stop : the range in user units.
    guess : (n_unknowns,) slip motions to start from [m].
    resume : the branch so far, to go on behind its last point; it is the first that is yielded.
    """
    begun = clock() - (0.0 if resume is None else resume.seconds)
    balance, inside = workspace.balance, workspace.balance.parameter.inside
    pace = settings.pace
    spanned, dear = is_spanned(workspace.system), balance.n_unknowns >= DEAR
    if dear or (balance.n_unknowns >= _DEAR_FORCES and balance.system.alone.any()):
        longer = _LONGER if dear else _LONGER_THERE
        pace = replace(pace, first=(longer if spanned else 1.0) * pace.first, largest=longer * pace.largest)
    if spanned and balance.n_ports >= _ALONG:
        pace = replace(pace, largest=math.sqrt(balance.n_ports / balance.n_leading) * pace.largest)
    control = control_of(settings, inside(start), inside(stop), pace)
    if resume is None:
        found = solve_from_nothing(workspace, control.start, guess)
        spent = found.iterations
        if not found.converged:
            yield _no_start(balance, spent, begun, ending(found, BranchStatus.NO_START))
            return
        code, state = begin_walk(workspace.system, workspace.linear, workspace.point, control, found.u)
        if code == walk_states.NO_START:
            yield _no_start(balance, spent, begun, BranchStatus.NO_START)
    else:
        state, spent = go_on_from(workspace, control, resume)
        code = walk_states.RUNNING if resume.status is None else walk_states.FINISHED
        yield resume
    branch = BranchStretches(workspace, control, code, state, spent, begun)
    yield from walk(branch, branch.pace)


def _no_start(balance: Balance, iterations: int, begun: float, status: BranchStatus) -> Stretch:
    """Return the stretch of a branch that could not begin."""
    return Stretch(
        **rows_of(balance, 0), status=status, newton_iterations=iterations, rejected_steps=0, stepped_over=0,
        seconds=clock() - begun, walk=np.zeros(0),
    )  # fmt: skip


def _finish(
    workspace: Workspace, stretches: list[Stretch], status: BranchStatus, start: float, stop: float,
    limit: float | None, begun: float, competes: float,
) -> Branch:  # fmt: skip
    """Put the stretches together, polish the peaks that compete, and measure the band."""
    balance = workspace.balance
    whole = joined(stretches)
    inside = balance.parameter.inside
    lost = status in (BranchStatus.STALLED, BranchStatus.NO_START)
    lost = lost and balance.parameter.kind is Kind.FREQUENCY
    if resonates_undamped(balance, inside(start), inside(stop)) or (
        lost and ends_undamped(workspace, whole.solutions, inside(start))
    ):
        status = BranchStatus.UNDAMPED
    branch = replace(
        without_peaks(balance, whole, status, start, stop), newton_iterations=whole.newton_iterations,
        rejected_steps=whole.rejected_steps, stepped_over=whole.stepped_over,
    )  # fmt: skip
    if status is not BranchStatus.UNDAMPED and competes < math.inf:
        top = float(whole.measures[:, MAX_ABS].max(initial=0.0))
        worth = competes if limit is None else min(competes, limit / max(top, limit))
        branch = surveyed(branch, Survey.of(workspace, whole, max(worth, WORTH_POLISHING)), limit)
    flags = branch_flags(workspace, branch.solutions), _drive_flags(workspace, whole, status, start, stop)
    return replace(branch, flags=flags[0] + flags[1], seconds=clock() - begun)


def without_peaks(
    balance: Balance, points: Points, status: BranchStatus, start: float, stop: float
) -> Branch:
    """Return the branch of points alone, on which nothing was looked for and no work is counted."""
    walked = Branch(
        **{name: getattr(points, name) for name in ROWS}, balance=balance, status=status, start=start,
        stop=stop, values=points.solutions[:, -1], peaks=(), band=None, error_estimate=math.nan,
        newton_iterations=0, rejected_steps=0, stepped_over=0, seconds=math.nan, flags=(),
        peak_certificate=uncertain("peaks between its points were not looked for"),
    )  # fmt: skip
    return with_points(walked, points)


def surveyed(branch: Branch, survey: Survey, limit: float | None) -> Branch:
    """Return a branch with the points, the peaks and the band of a survey of it.

    `limit` [m] is the amplitude above which the band is measured; peak/√2 if it is None.
    """
    at = band_limit(limit, survey.peaks, branch.balance.parameter.kind)
    band = None if at is None else survey.band(at)
    return replace(
        with_points(branch, survey.points), peaks=survey.peaks, band=band,
        newton_iterations=branch.newton_iterations + survey.spent,
        peak_certificate=survey.certificate(completed=branch.reached),
    )  # fmt: skip


def with_points(branch: Branch, points: Points) -> Branch:
    """Return a branch with other points of its balance."""
    balance = branch.balance
    return replace(
        branch, values=balance.parameter.all_outside(points.solutions[:, -1].copy()),
        solutions=points.solutions, tangents=points.tangents, states=points.states,
        observed=to_full(points.observed, balance.system.ks, balance.highest_harmonic),
        measures=points.measures,
    )  # fmt: skip


def with_error(branch: Branch, workspace: Workspace | None = None) -> Branch:
    """Return a branch with the estimated error of its highest peak, if that was left out.

    One whose highest peak is rounding has no damping, and no peaks.
    """
    if math.isfinite(branch.error_estimate) or not branch.peaks:
        return branch
    follow = None if branch.status is BranchStatus.STOPPED else highest_between
    error = branch_error(workspace or Workspace.of(branch.balance), Points.of(branch), branch.peaks, follow)
    return _undamped(branch) if error == math.inf else replace(branch, error_estimate=error)


def if_damped(branch: Branch) -> Branch:
    """Return a branch whose error was left out as `with_error` does where nothing damps its highest peak."""
    if branch.peaks and nothing_damps(Workspace.of(branch.balance), Points.of(branch), branch.peaks[0]):
        return _undamped(branch)
    return branch


def _undamped(branch: Branch) -> Branch:
    return replace(branch, status=BranchStatus.UNDAMPED, peaks=(), band=None)


def _drive_flags(
    workspace: Workspace, whole: Stretch, status: BranchStatus, start: float, stop: float
) -> tuple[str, ...]:
    """Return the flag of a branch that ends because friction cannot hold a mean load a little further on."""
    if status is not BranchStatus.RATCHETS:
        return ()
    first, last = (float(workspace.balance.parameter.inside(end)) for end in (start, stop))
    end = float(whole.solutions[-1, -1]) if len(whole.solutions) else first
    beyond = [end + share * (last - first) for share in ((0.0, *AHEAD) if len(whole.solutions) else (0.0,))]
    return () if all(map(workspace.friction_can_hold, beyond)) else (ABOVE_FRICTION,)


def highest_between(balance: Balance, low: float, high: float, guess: Real) -> Peak | None:
    """Return the highest peak of a balance between two λ (inside unit), from `guess`; None without one."""
    workspace, outside = Workspace.of(balance), balance.parameter.outside
    stretches: list[Stretch] = []
    ends = float(outside(low)), float(outside(high))
    for stretch in walk_branch(workspace, *ends, ContinuationSettings(), guess):
        stretches.append(stretch)
        if sum(len(each.solutions) for each in stretches) >= _MOST_FOLLOWED:
            break
    survey = Survey.of(workspace, joined(stretches))
    return survey.peaks[0] if survey.peaks else None


def sampled(
    scene: Scene, start: float | None, stop: float | None, harmonics: int,
    should_stop: ShouldStop = None,
) -> Branch | None:  # fmt: skip
    """Return the response at a few frequencies of a range [Hz], without peaks.

    None if it is not unique, nothing damps it, or a frequency has no solution.
    """
    begun = clock()
    balance = build(scene, harmonics=harmonics)
    if not is_unique(balance) or balance.parameter.kind is not Kind.FREQUENCY:
        return None
    low, high = scene.observe.band
    start, stop = check_range(
        balance.parameter, low if start is None else start, high if stop is None else stop
    )
    workspace = Workspace.of(balance)
    solver = NodeSolver(workspace, Points(**rows_of(balance, 0)))
    first, last = map(balance.parameter.inside, (start, stop))
    if resonates_undamped(balance, first, last):
        return None
    count = max(LEAST, math.ceil(abs(math.log(last / first)) / STEP))
    places = np.geomspace(first, last, count + 1).tolist()
    node, status = solver.at(places[0], [], math.copysign(1.0, last - first)), BranchStatus.COMPLETED
    nodes = [] if node is None else [node]
    for p in places[1:]:
        if should_stop is not None and should_stop():
            status = BranchStatus.STOPPED
            break
        more = _until(solver, nodes[-1], p, count) if nodes else []
        if not more:
            return None
        nodes += more
    rows = solver.points_of([node.number for node in nodes])
    branch = without_peaks(balance, rows, status, start, stop)
    return replace(
        branch, newton_iterations=solver.spent, seconds=clock() - begun,
        flags=branch_flags(workspace, branch.solutions),
    )  # fmt: skip


def _until(solver: NodeSolver, last: PointRow, p: float, intervals: int) -> list[PointRow]:
    """Return the node at the next of so many λ, or those of the arc there where Newton's method fails.

    None where the arc does not lead there either.
    """
    length = p - last.at
    ahead = last.solution[:-1] + length * last.tangent[:-1] / last.tangent[-1]
    node = solver.at(p, [ahead], math.copysign(1.0, length), from_nothing=False)
    if node is not None:
        return [node]
    outside = solver.workspace.balance.parameter.outside
    settings = ContinuationSettings()
    settings = replace(settings, range_length=settings.range_length / intervals)
    ends = float(outside(last.at)), float(outside(p))
    arc = joined(list(walk_branch(solver.workspace, *ends, settings, last.solution[:-1])))
    return solver.added(arc)[1:] if arc.status is BranchStatus.COMPLETED else []
