"""`wear_life`: what dissipated energy wears off the contacts over hours, and the response meanwhile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.arrays import Real
from solver.balance.balance import check_harmonics
from solver.balance.simplifications import Effects
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.continuation.branches.sweep import sweep
from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from solver.response.solve import known_of_solution
from solver.response.solve import solve
from solver.results.known import NOTHING_KNOWN, Known
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.cyclic.annulus import written_out
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.studies.margin_diagram import judged_rows
from stickslip.lab.wear_life.course import Here, WearCourse
from stickslip.lab.wear_life.life_result import WearLife, WearLifeStatus
from stickslip.lab.wear_life.mission import Mission, is_number
from stickslip.lab.wear_life.operating_conditions import SETTINGS, LostError, OperatingConditions
from stickslip.lab.wear_life.wearing import LOAD, Wearing, WearLaw, wearing_of
from stickslip.lab.wear_life.worn_margin import worn_margin

MOST_POINTS = 10_000
_FOLLOWING = 0.8  # share of the work


@shows_progress("wear life")
def wear_life(
    scene: Scene,
    mission: Mission,
    wear: WearLaw,
    *,
    limit: float | None = None,
    paths: Sequence[str] = (),
    points: int = 40,
    tolerance: float = 1e-6,
    harmonics: int = 11,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> WearLife:
    """Follow what friction wears off the contacts of a scene, with loads and response over the hours.

    The depth of a contact grows by coefficient × power that friction takes out / area, and lowers its normal
    load, which changes the response and with it the power.

    Parameters
    ----------
    scene : not worn yet.
    mission : how long it runs, and at which frequencies.
    wear : which contacts wear, and what a depth takes from them.
    limit : amplitude of the observed DOF [m]: when it is reached.
    paths : parameter paths, or `coefficient` (by name ``coefficient.NAME``), to differentiate by; of the
        faces of a shape those of its contacts and their group.
    points : instants shown, evenly over the hours.
    tolerance : relative error of a step over the hours.
    harmonics : highest harmonic kept.
    on_progress : called with (share done, responses so far).
    should_stop : asked between steps; True ends the life with the status STOPPED.

    Raises
    ------
    SettingError
        An argument out of its range, an unknown contact or path, a contact without area or of which nothing
        says what a depth takes away, rigid contacts; at a peak a law without second derivatives or an
        engine-order line.
    """
    begun = clock()
    course = course_of(
        scene, mission, wear, paths=paths, tolerance=tolerance, harmonics=harmonics, should_stop=should_stop
    )
    check_looks(limit, points)
    course.follow(part_of(on_progress, 0.0, _FOLLOWING), should_stop)
    found = _result(course, scene, limit, points, begun)
    if on_progress is not None and found.reached:
        on_progress(1.0, found.responses)
    return found


def course_of(
    scene: Scene, mission: Mission, wear: WearLaw, *, paths: Sequence[str] = (), tolerance: float = 1e-6,
    harmonics: int = 11, should_stop: ShouldStop = None,
) -> WearCourse:  # fmt: skip
    """Return a life that was not followed yet, by the arguments of `wear_life`; errors as there."""
    # The points of a shape's faces wear each by itself: they become contacts of their own.
    whole = written_out(scene).model_copy(update={"dampers": ()})
    wearing = wearing_of(whole, wear)
    if not is_number(tolerance) or not 1e-12 <= tolerance <= 0.1:
        raise SettingError("tolerance", tolerance, "must be a number from 1e-12 to 0.1")
    own = tuple(path for path in paths if path not in wearing.entries)
    for path in own:
        _check_path(whole, wearing, path)
    every = (*own, *(loss.path for loss in wearing.losses))
    conditions = OperatingConditions(
        blocks=mission.shares(), harmonics=check_harmonics(harmonics), paths=own,
        effects=Effects(even_harmonics=even_harmonics_reason(whole, every) is not None),
        should_stop=should_stop,
    )  # fmt: skip
    if conditions.blocks is None:
        Sensitivities(conditions.balance(whole), every).check_second()
    return WearCourse(
        wearing=wearing, conditions=conditions, paths=tuple(paths), hours=float(mission.hours),
        tolerance=tolerance,
    )  # fmt: skip


def check_looks(limit: float | None, points: int) -> None:
    """Raise SettingError where a limit of the amplitude or a number of instants is out of its range."""
    if limit is not None and (not is_number(limit) or not 0.0 < limit < math.inf):
        raise SettingError("limit", limit, "must be an amplitude > 0 [m]")
    check_count("points", points, 2, MOST_POINTS)


def _check_path(scene: Scene, wearing: Wearing, path: object) -> None:
    """Raise SettingError unless it is a path of the scene; wear coefficients are among what is listed."""
    known = scene.parameter_paths()
    if path not in known:
        wanted = f"must be a value of the scene or one of {', '.join(wearing.entries)}"
        raise SettingError("paths", path, wanted)


def _result(course: WearCourse, scene: Scene, limit: float | None, points: int, begun: float) -> WearLife:
    """Return what a life came to that was followed."""
    wearing, stretches = course.wearing, course.stretches
    rows = _rows(course, points) if stretches else []
    last, highest = (rows[-1], course.maxima()[0]) if rows else (None, None)
    met = None if limit is None else course.reaches(limit)
    nothing, margin = np.full(len(course.paths), math.nan), None
    if rows and judged_rows(course.wearing.scene):
        try:
            margin = worn_margin(course, rows)
        except LostError as lost:
            course.status, course.why = WearLifeStatus.NO_RESPONSE, str(lost)
    known = course.paths and course.smooth
    ends = [_known(course, one) for one in (rows[0], rows[-1])] if rows else [NOTHING_KNOWN] * 2
    return WearLife(
        scene=scene.name, dof=scene.observe.dof, measured=scene.measured, status=course.status,
        ended_by=course.why,
        contacts=wearing.names, hours=np.array([row.hours for row in rows]),
        amplitude=np.array([row.amplitude for row in rows]),
        frequency_hz=np.array([row.motion.hertz for row in rows]),
        depths=_across([row.depths for row in rows], course.n),
        loads=_across([_loads(wearing, row.depths) for row in rows], course.n),
        power=_across([row.power for row in rows], course.n), switches=tuple(course.switches),
        highest=math.nan if highest is None else highest.amplitude,
        highest_hours=math.nan if highest is None else highest.hours,
        limit=math.nan if limit is None else limit, hours_to_limit=math.nan if met is None else met.hours,
        used=np.full(len(rows), math.nan) if margin is None else margin.used,
        hours_to_margin=math.nan if margin is None else margin.hours,
        margin_slopes=margin.slopes if margin is not None and margin.hours > 0.0 else nothing,
        paths=course.paths, end_slopes=last.gradient if last is not None and known else nothing,
        highest_slopes=highest.gradient if highest is not None and known else nothing,
        # What is reached from the beginning on is not reached later for a little more or less.
        limit_slopes=met.instant_moves if met is not None and met.hours > 0.0 and known else nothing,
        depth_slopes=last.slopes if last is not None and known else np.outer(np.ones(course.n), nothing),
        at_peak=course.conditions.blocks is None, n_harmonics=course.conditions.harmonics,
        steps=len(stretches), responses=course.conditions.solved, seconds=clock() - begun,
        begin_known=ends[0], end_known=ends[1],
    )  # fmt: skip


def _rows(course: WearCourse, points: int) -> list[Here]:
    """Return the instants that are shown: evenly spaced, where another peak takes over, and the end."""
    last = course.stretches[-1].end.hours
    rows = [course.stretches[0].begin]
    wanted = [float(hours) for hours in np.linspace(0.0, course.hours, points)[1:] if hours < last]
    before = rows[0]
    for stretch in course.stretches:
        begin, end = stretch.begin.hours, stretch.end.hours
        if before.motion is not stretch.begin.motion and begin in course.switches:
            rows += [before, stretch.begin]
        rows += [course.at(hours) for hours in wanted if begin < hours <= end]
        before = stretch.end
    return [*rows, before]


def _across(rows: Sequence[Real], n: int) -> Real:
    """Return values (T, n) contact by contact, (n, T)."""
    return np.array(rows).reshape(-1, n).T.copy()


def _loads(wearing: Wearing, depths: Real) -> Real:
    """Return the mean normal load of each contact at depths (n,) [N]; NaN of a law without."""
    scene = wearing.at(depths)
    contacts = [scene.contacts[place] for place in wearing.places]
    return np.array([one.value_of(LOAD) if LOAD in one.parameters else math.nan for one in contacts])


def _known(course: WearCourse, here: Here) -> Known:
    """Return how well the response at an instant is known."""
    conditions, scene = course.conditions, course.wearing.at(here.depths)
    if conditions.blocks is None:
        return sweep(scene, harmonics=conditions.harmonics, settings=replace(SETTINGS, errors=True)).known
    there = scene.at_frequency(here.motion.hertz)
    return known_of_solution(solve(there, frequency_hz=here.motion.hertz, harmonics=conditions.harmonics))
