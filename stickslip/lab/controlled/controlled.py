"""Responses at a held amplitude: the force that keeps harmonic 1 of one DOF at A, over the frequency.

Test rigs are run so, because the amplitude settles the state of the contacts: response by response hardly
anything changes but the phase, folds of the response to a held force vanish, and its unstable parts are
reached (T. Karaağaçlı, H. N. Özgüven, Mech. Syst. Signal Process. 146 (2021) 107023,
doi:10.1016/j.ymssp.2020.107023). The equations are `solver.modes.mode_equations.Held`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from solver.balance.balance import fewer_harmonics
from solver.balance.contact_hessian import check_no_line
from solver.balance.workspace import FEWEST_HARMONICS
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.jit.fourier import Real, cosine_position
from solver.modes.mode_curve import Corrected, ModeState, correct
from solver.modes.mode_curve import FollowedCurve, follow
from solver.modes.mode_equations import BESIDES, Held
from solver.modes.mode_start import slopes_at_rest
from solver.continuation.bracketing import least_between
from solver.response.stability.cost import left_out
from solver.modes.nonlinear_mode import LEAST, MOST_POINTS, pose
from solver.modes.nonlinear_mode import PointRecord, Recorder, Wider, last_unknowns, curve_fields
from stickslip.lab.controlled.held_result import HeldAmplitude, HeldStatus, LeastForce
from solver.response.stability.floquet import motions_stability
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene_harmonics import spread

if TYPE_CHECKING:
    from solver.scene.scene import Scene

LEVEL = "excitation.amplitude"
_FAINT = 1e-12  # share of a motion in phase with the force below which the amplitude has no force to hold it
_SAME = 1e-9  # relative distance of an end of the range within which a point is at it


_RUNGS = 24  # of amplitude, each `_RISE` times the one before, from which a start is walked up
_RISE = 1.6
_MOST_AT_FIRST = 60
_LEAST_RISE = 1.01
_CLOSE, _MOST_TRIES = 1e-9, 60  # of ln ω, where the force is least


def held_amplitude(
    scene: Scene, amplitude: float, *, start: float | None = None, stop: float | None = None,
    dof: str | None = None, harmonics: int = 11, errors: bool = True, stability: bool | None = None,
    most_points: int = MOST_POINTS, on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> HeldAmplitude:  # fmt: skip
    """Follow the responses whose amplitude at one DOF is held, over the frequency: which force they take.

    Every point is a response to the scene's excitation times a factor, exact but for the harmonics left out.

    Parameters
    ----------
    scene : what vibrates; the size of its excitation does not matter.
    amplitude : of harmonic 1 of the DOF [m].
    start, stop : frequencies [Hz], the scene's band if left out; from low to high.
    dof : the DOF; that of the scene's `observe` if left out.
    harmonics : highest harmonic kept.
    errors : estimate what more harmonics would change, for about as much time again.
    stability : Floquet multipliers of every point; of a disk they are of all its sectors. Left out, they are
        computed of structures of at most 200 coordinates: of more they take minutes.
    most_points : of the curve.
    on_progress : is told the share of the range that is done and the number of points.
    should_stop : is asked at every point whether to stop there.

    Raises
    ------
    SettingError
        An amplitude, range, DOF or number of harmonics that cannot be; an excitation that is not of harmonic
        1 alone, does not move the DOF, or follows the speed along an engine-order line.
    """
    begun = clock()
    scene = _checked(scene, amplitude, dof)
    low, high = _range(scene, start, stop)
    problem = pose(scene, 1, None, harmonics, kind=Held)
    equations = cast(Held, problem.equations)
    equations.target = float(amplitude)
    _check_moves(equations, scene, 2.0 * math.pi * low)
    first = first_held(equations, problem.rest, 2.0 * math.pi * low)
    last, least = math.log(2.0 * math.pi * high), math.log(2.0 * math.pi * low * (1.0 - _SAME))
    curve = follow(
        equations, first, last, turns=False, most_points=most_points, least_share=0.0, least=least,
        done=lambda at: (math.exp(at) / (2.0 * math.pi) - low) / (high - low), on_progress=on_progress,
        should_stop=should_stop,
    )  # fmt: skip
    unknown = left_out(scene, stability)
    return _collect(equations, curve, errors=errors, unknown=unknown, begun=begun)


def _checked(scene: Scene, amplitude: float, dof: str | None) -> Scene:
    """Return the scene that observes the DOF."""
    number = isinstance(amplitude, (int, float)) and not isinstance(amplitude, bool)
    if not number or not LEAST <= amplitude <= 1.0 / LEAST:
        wanted = f"must be an amplitude > 0, from {LEAST:g} to {1.0 / LEAST:g} m"
        raise SettingError("amplitude", amplitude, wanted)
    check_no_line(scene)
    if any(force.harmonic != 1 for force in scene.excitation):
        wanted = "must be of harmonic 1 alone: its size is what holds the amplitude"
        raise SettingError("excitation", [force.place for force in scene.excitation], wanted)
    if dof is None:
        return scene
    if dof not in scene.dofs:
        raise SettingError("dof", dof, f"must be one of {', '.join(scene.dofs)}")
    return scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})})


def _range(scene: Scene, start: float | None, stop: float | None) -> tuple[float, float]:
    """Return the frequencies [Hz]."""
    low, high = (
        check_frequency(name, scene.observe.band[i] if end is None else end)
        for i, (name, end) in enumerate((("start", start), ("stop", stop)))
    )
    if not low < high:
        raise SettingError("stop", high, f"must be above the start {low!r}")
    return low, high


def _check_moves(equations: Held, scene: Scene, omega: float) -> None:
    """Raise SettingError where the excitation does not move the DOF."""
    s = equations.structure
    dynamics = s.at(omega, 0.0, s.nearest(omega, 0.0))
    x = dynamics.solve(equations.by_force())[s.first]
    seen = abs(complex(np.sum(s.observe[s.first] * x)))
    if not seen > _FAINT * float(np.linalg.norm(s.observe[s.first]) * np.linalg.norm(x)):
        wanted = f"must move {scene.observe.dof!r}: no force of it holds an amplitude there"
        raise SettingError("excitation", [force.place for force in scene.excitation], wanted)


def _collect(
    equations: Held, curve: FollowedCurve, *, errors: bool, unknown: str, begun: float
) -> HeldAmplitude:
    """Return the result of a curve."""
    balance, points = equations.balance, curve.points
    recorder = Recorder(equations, turns=False)
    rows = [recorder.of(point) for point in points]
    observed = np.array([row.observed for row in rows]).reshape(-1, 2 * balance.highest_harmonic + 1)
    error = np.full(len(points), math.nan)
    if errors and points:
        wider = Wider(equations)
        error = np.array([wider.estimate(point)[1] for point in points])
    frequency, z = last_unknowns(points)
    stable, unknown = _stable(equations, frequency, z, rows, unknown)
    return HeldAmplitude(
        **curve_fields(equations, points, rows, begun), held=equations.target,
        n_harmonics=balance.n_harmonics,
        status=HeldStatus[curve.end.name], frequency_hz=frequency, excitation=z * equations.unit,
        excitation_error=error * equations.unit,
        phase_deg=np.degrees(np.angle(observed[:, 1] - 1j * observed[:, 2])),
        stable=stable, unknown=unknown, observed=observed,
        least=_force_of(equations, least_force(equations, points)),
    )  # fmt: skip


def _force_of(equations: Held, point: Corrected | None) -> LeastForce:
    """Return the factor on the excitation and the frequency [Hz]; NaN without a point."""
    if point is None:
        return LeastForce(math.nan, math.nan)
    return LeastForce(float(point.state.y[-1]) * equations.unit, float(point.state.y[-2]) / (2.0 * math.pi))


def _stable(
    equations: Held, frequency: Real, z: Real, rows: list[PointRecord], unknown: str
) -> tuple[tuple[bool | None, ...], str]:
    """Return whether each point is stable while its force is held, and why that is not known."""
    if unknown:
        return (None,) * len(rows), unknown
    scene, found = equations.balance.scene, []
    ends = np.cumsum([len(contact.end_keys) for contact in scene.contacts])[:-1]
    for row, hertz, factor in zip(rows, frequency.tolist(), z.tolist(), strict=True):
        there = scene.with_values({LEVEL: factor * equations.unit * scene.value(LEVEL)})
        motions = tuple(np.split(row.motions, ends))
        try:
            found.append(motions_stability(there, hertz, motions).stable)
        except SettingError as error:  # a law or a term without a motion in time
            return (None,) * len(rows), str(error)
    return tuple(found), ""


def first_held(equations: Held, rest: Real, omega: float) -> Corrected:
    """Return the response at ω with the amplitude asked for.

    Where Newton's method does not lead there, it begins with fewer harmonics, or with smaller amplitudes.

    Parameters
    ----------
    rest : (r, n) the equilibrium at the leading ports.
    """
    wanted = equations.target
    guess = _linear(equations, rest, omega)
    found = _solved(equations, guess)
    if not found.converged:
        found = _from_fewer(equations, rest, omega) or found
    for rung in range(1, _RUNGS + 1):
        if found.converged:
            break
        equations.target = wanted / _RISE**rung
        found = _solved(equations, _scaled(equations, guess, rest, _RISE**-rung))
    spent, rise = found.iterations, _RISE
    while found.converged and equations.target < wanted:
        before = equations.target
        equations.target = min(before * rise, wanted)
        raised = _scaled(equations, found.state, rest, equations.target / before)
        there = _solved(equations, raised)
        spent += there.iterations
        if there.converged:
            found, rise = there, min(rise * rise, _RISE)
            continue
        equations.target, rise = before, math.sqrt(rise)
        if rise < _LEAST_RISE:
            found = replace(there, converged=False)
    equations.target = wanted
    return replace(found, iterations=spent)


def _from_fewer(equations: Held, rest: Real, omega: float) -> Corrected | None:
    """Return the response at ω found from that with fewer harmonics; None if it is not."""
    ks = equations.structure.ks
    fewer = equations.over(fewer_harmonics(equations.balance, max(2 * ks.size // 3, FEWEST_HARMONICS)))
    few = fewer.structure.ks
    if few.size == ks.size:
        return None
    begun = first_held(fewer, spread(rest, ks, few), omega)
    if not begun.converged:
        return None
    w = spread(begun.state.y[: fewer.size].reshape(fewer.r, fewer.n), few, ks)
    y = np.append(w, begun.state.y[-BESIDES:])
    y[-1] *= fewer.unit / equations.unit
    found = _solved(equations, replace(begun.state, y=y))
    return replace(found, iterations=begun.iterations + found.iterations) if found.converged else None


def _solved(equations: Held, guess: ModeState) -> Corrected:
    """Return the solution from a guess; converged only with a force in its own phase, z > 0."""
    found = correct(equations, guess, most=_MOST_AT_FIRST)
    return found if found.state.y[-1] > 0.0 else replace(found, converged=False)


def least_force(equations: Held, points: Sequence[Corrected]) -> Corrected | None:
    """Return the point with the least force, solved for between points; None without a point.

    A force held instead has a peak there: |x| is stationary over the frequency where the force is.
    """
    if not points:
        return None
    i = int(np.argmin([point.state.y[-1] for point in points]))
    best = points[i]
    if not 0 < i < len(points) - 1:
        return best
    tried = [best]

    def at(log_omega: float) -> Corrected | None:
        near = min(tried, key=lambda each: abs(each.state.log_amplitude - log_omega))
        y = near.state.y.copy()
        y[-2] = math.exp(log_omega)
        found = correct(equations, replace(near.state, y=y, log_amplitude=log_omega), most=_MOST_AT_FIRST)
        if not found.converged or not found.state.y[-1] > 0.0:
            return None
        tried.append(found)
        return found

    def force(point: Corrected) -> float:
        return float(point.state.y[-1])

    low, high = sorted((points[i - 1].state.log_amplitude, points[i + 1].state.log_amplitude))
    least_between(at, force, low, high, _CLOSE, _MOST_TRIES, 2.0 * max(map(force, points)))
    return min(tried, key=force)


def _linear(equations: Held, rest: Real, omega: float) -> ModeState:
    """Return a guess: the response with the contacts as they are at rest, in the amplitude asked for."""
    s, first = equations.structure, equations.structure.first
    number = s.nearest(omega, 0.0)
    slopes = slopes_at_rest(equations, rest, omega)
    span = np.eye(equations.r) if equations.span is None else equations.span
    shift = np.diag(equations.balance.system.shift).astype(np.complex128)
    tied = np.zeros_like(shift) if slopes is None else slopes - shift
    K = s.back[first] @ (span.T @ tied @ span) @ s.contact[first]
    x = np.linalg.lstsq(s.stiffness(omega) + K, s.force, rcond=1e-14)[0]
    seen = abs(complex(np.sum(s.observe[first] * x)))
    factor = equations.target / max(seen, 1e-300)
    equations.unit = factor
    x = factor * x
    moved = s.contact[first] @ x
    w, here = rest.copy(), int(cosine_position(s.ks, first))
    if equations.size:
        w[:, here], w[:, here + 1] = moved.real, -moved.imag
    q = complex(np.vdot(s.carried[:, number], x))
    y = np.concatenate([w.reshape(-1), [q.real, q.imag, omega, 1.0]])
    return ModeState(
        y=y, log_amplitude=math.log(omega), mode=number, phase=np.zeros(s.force.size, np.complex128)
    )


def _scaled(equations: Held, state: ModeState, rest: Real, factor: float) -> ModeState:
    """Return a guess with what moves, and the force, times a factor."""
    guess = state.scaled(equations.size, factor, rest.reshape(-1))
    guess.y[-1] *= factor
    return guess
