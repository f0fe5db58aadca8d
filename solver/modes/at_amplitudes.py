"""A nonlinear mode at given amplitudes, with derivatives: what measured curves of it are compared with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.jit.fourier import Integer, Real
from solver.modes.mode_curve import LEAST_SHARE, Corrected, ModeState, correct, follow, share_of_first
from solver.modes.mode_gradient import ModeSensitivities, mode_hessian
from solver.modes.mode_start import begin, phase_of
from solver.modes.nonlinear_mode import MOST_POINTS, ModeProblem, pose
from solver.scene.scene import Scene

_BELOW = 0.9  # of the smallest amplitude, where a curve is begun
_FAR = 0.3  # relative change of ω from a guess beyond which a point may be of another mode


@dataclass(frozen=True, slots=True, kw_only=True)
class ModePoints:
    """A nonlinear mode at n amplitudes."""

    frequency_hz: Annotated[Real, "NaN where no point was found, (n,)."]
    damping_ratio: Annotated[Real, "Likewise, (n,)."]
    by_frequency: Annotated[Real, "Derivatives [Hz per unit of each], (n, n_paths)."]
    by_damping: Annotated[Real, "Derivatives [1 per unit of each], (n, n_paths)."]
    by_amplitude: Annotated[Real, "Derivatives of both by the amplitude [Hz, 1 per √kg m], (n, 2)."]
    states: Annotated[Integer, "What each contact does, (n, n_contacts); −1 where no point was found."]
    points: Annotated[list[ModeState | None], "The unknowns, guesses of the next."]


def mode_at_amplitudes(
    scene: Scene, amplitudes: Real, paths: Sequence[str], *, mode: int = 1,
    nodal_diameter: int | None = None, harmonics: int = 11, guesses: Sequence[ModeState | None] = (),
) -> ModePoints:  # fmt: skip
    """Return frequency and damping ratio of a mode at amplitudes, and their derivatives by parameter paths.

    Parameters
    ----------
    scene, mode, nodal_diameter, harmonics : as of `nonlinear_mode`.
    amplitudes : (n,) modal amplitudes [√kg m].
    paths : by which derivatives are wanted.
    guesses : points of the same amplitudes with other values of the scene; a curve is followed where there
        are none, or they lead nowhere.

    Raises
    ------
    SettingError
        As `nonlinear_mode`, and an unknown path.
    """
    problem = pose(scene, mode, nodal_diameter, harmonics, paths=paths)
    logs = np.log(amplitudes)
    found = _from_guesses(problem, logs, guesses)
    if any(one is None for one in found):
        found = _along_the_curve(problem, logs)
    sensitivities = ModeSensitivities(problem.equations, paths, turns=problem.turns)
    n, contacts = logs.size, len(problem.equations.balance.scene.contacts)
    values, slopes = np.full((n, 2), math.nan), np.full((n, 2, len(paths) + 1), math.nan)
    states = np.full((n, contacts), -1, dtype=np.int64)
    for i, one in enumerate(found):
        if one is None:
            continue
        values[i] = one.state.y[-2] / (2.0 * math.pi), one.state.y[-1]
        by_omega, by_zeta = sensitivities.at(one.state)
        slopes[i] = by_omega / (2.0 * math.pi), by_zeta
        states[i] = problem.equations.point.states
    return ModePoints(
        frequency_hz=values[:, 0], damping_ratio=values[:, 1], by_frequency=slopes[:, 0, :-1],
        by_damping=slopes[:, 1, :-1], by_amplitude=slopes[:, :, -1] / amplitudes[:, None], states=states,
        points=[None if one is None else one.state for one in found],
    )  # fmt: skip


def damping_hessian(
    scene: Scene, paths: Sequence[str], guess: ModeState, *, mode: int = 1, harmonics: int = 11
) -> Real:
    """Return the second derivatives of the damping ratio by paths at a point of a mode, (n_paths, n_paths).

    `guess` is that point, of `mode_at_amplitudes`; the others as there. Raises SettingError as
    `solver.modes.mode_gradient.mode_hessian`.
    """
    problem = pose(scene, mode, None, harmonics, paths=paths)
    sensitivities = ModeSensitivities(problem.equations, paths, turns=problem.turns)
    return mode_hessian(sensitivities, guess)[1]


def _from_guesses(
    problem: ModeProblem, logs: Real, guesses: Sequence[ModeState | None]
) -> list[Corrected | None]:
    """Return the points from guesses; None where one leads nowhere, or to another mode."""
    equations = problem.equations
    size = equations.size + 4
    found: list[Corrected | None] = [None] * logs.size
    for i, guess in enumerate(guesses):
        if guess is None or guess.y.size != size or guess.phase.size != equations.structure.force.size:
            continue
        # A phase that is given is that of the excitation, which may have turned since.
        phase = guess.phase if problem.turns else phase_of(equations)
        phase = phase / np.linalg.norm(phase)
        one = correct(equations, replace(guess, log_amplitude=float(logs[i]), phase=phase))
        moved = abs(float(one.state.y[-2]) / float(guess.y[-2]) - 1.0)
        if one.converged and moved < _FAR and share_of_first(equations, one) >= LEAST_SHARE:
            found[i] = one
    return found


def _along_the_curve(problem: ModeProblem, logs: Real) -> list[Corrected | None]:
    """Return the points where a curve first passes the amplitudes; None beyond its end."""
    equations = problem.equations
    found: list[Corrected | None] = [None] * logs.size
    low = float(logs.min()) + math.log(_BELOW)
    first = begin(equations, problem.mode, problem.rest, low, turns=problem.turns)
    before: ModeState | None = None
    curve = follow(equations, first, float(logs.max()), turns=problem.turns, most_points=MOST_POINTS)
    for each in curve.points:
        here = each.state
        if before is not None:
            for i in np.flatnonzero((logs >= before.log_amplitude) & (logs <= here.log_amplitude)).tolist():
                if found[i] is None:
                    found[i] = _between(problem, before, here, float(logs[i]))
        before = here
    return found


def _between(
    problem: ModeProblem, one: ModeState, other: ModeState, log_amplitude: float
) -> Corrected | None:
    """Return the point of an amplitude between two of a curve."""
    rise = other.log_amplitude - one.log_amplitude
    share = (log_amplitude - one.log_amplitude) / rise if rise else 0.0
    for guess in (one.towards(other, share), one, other):
        found = correct(problem.equations, replace(guess, log_amplitude=log_amplitude), most=40)
        if found.converged:
            return found
    return None
