"""A scene solved by its exact periodic orbit, as a `Solution`.

Harmonics are integrals over the pieces by Gauss's rule on panels over which the motion is a Taylor series;
extremes are zeros of the series of the velocity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.errors import SettingError
from solver.jit.timer import clock
from solver.jit.fourier import Real
from solver.response.contact_response import ContactResponse, ContactState, flags_of
from stickslip.lab.proofs.exact.orbit import orbit_beside
from stickslip.lab.proofs.exact.flow import (
    LiftsError,
    NoMotionError,
    exponential,
    first_root,
    steps_of,
    taylor,
)
from stickslip.lab.proofs.exact.orbit import PERIOD, ROUNDING, Ended, Orbit, find, follow, grazed
from stickslip.lab.proofs.exact.piecewise import MemberState, Mode, Piecewise
from solver.contacts.pieces.line import STICK
from solver.response.solution import Solution, SolutionStatus
from solver.response.stability.multipliers import Stability, growth_of, verdict_of
from solver.scene.scene import Scene

_GAUSS = 12
_TURN = 5.0  # rad by which the highest harmonic asked for turns over a panel at most
_MOVES = 1e-7  # of the largest change of a motion: less is none


@dataclass(frozen=True, slots=True)
class Panels:
    """The orbit at the nodes of all panels, and as series: all that is read off it."""

    tau: Annotated[Real, "Nodes, (m,)."]
    weights: Annotated[Real, "Their weights, (m,)."]
    w: Annotated[Real, "States there, (m, nw)."]
    modes: Annotated[list[Mode], "The mode of each panel."]
    states: list[MemberState]
    series: Annotated[Real, "(panels, DEGREE + 1, nw) by the share of the panel."]
    starts: Annotated[Real, "(panels,) [rad]."]
    widths: Annotated[Real, "Likewise."]

    def values(self, rows: Real) -> Real:
        """Return rows of a mode, one a panel (panels, nw), at all nodes."""
        each = np.repeat(rows, _GAUSS, axis=0)
        return np.asarray(np.einsum("mw,mw->m", each, self.w))

    def coefficients(self, values: Real, highest: int) -> Real:
        """Return the Fourier coefficients (2H + 1,) of values at all nodes."""
        found = np.empty(2 * highest + 1)
        found[0] = self.weights @ values / PERIOD
        for k in range(1, highest + 1):
            found[2 * k - 1] = 2.0 * self.weights @ (values * np.cos(k * self.tau)) / PERIOD
            found[2 * k] = 2.0 * self.weights @ (values * np.sin(k * self.tau)) / PERIOD
        return found

    def extremes(self, row: Real, rate: Real) -> tuple[float, float]:
        """Return the least and the largest value of a motion over the period."""
        values = [self.w @ row]
        for series, width in zip(self.series, self.widths, strict=True):
            velocity, motion = series @ rate * width, series @ row
            size = float(np.abs(velocity).sum())
            for sign in (1.0, -1.0):
                at = first_root(sign * velocity, 1.0) if sign * velocity[0] > 1e-14 * size else None
                if at is not None:
                    values.append(np.array([np.polynomial.polynomial.polyval(at, motion)]))
        every = np.concatenate([*values, self.series[:, 0] @ row])
        return float(every.min()), float(every.max())


def panels_of(orbit: Orbit, highest: int) -> Panels:
    """Return an orbit in panels for harmonics up to `highest`."""
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    shares, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    series, starts, widths, modes, states = [], [], [], [], []
    for piece in orbit.pieces:
        width = min(steps_of(piece.mode).h, _TURN / max(highest, 1))
        count = math.ceil(piece.length / width)
        width = piece.length / count
        step, w = exponential(piece.mode.A * width), piece.w
        for i in range(count):
            series.append(taylor(piece.mode, w, width))
            starts.append(piece.tau + i * width)
            widths.append(width)
            modes.append(piece.mode)
            states.append(piece.state)
            w = step @ w
    every = np.array(series)
    powers = shares[:, None] ** np.arange(every.shape[1])
    w = np.einsum("gk,pkw->pgw", powers, every).reshape(-1, every.shape[2])
    begun, wide = np.array(starts), np.array(widths)
    return Panels((begun[:, None] + wide[:, None] * shares).ravel(), (wide[:, None] * weights).ravel(), w,
                  modes, states, every, begun, wide)  # fmt: skip


def solve_exactly(
    scene: Scene, frequency_hz: float, harmonics: int, *, near: Solution | None = None
) -> Solution:
    """Return the response, to rounding, looked for beside one of the balance; errors as `Piecewise`."""
    return solve_beside(scene, frequency_hz, harmonics, near)[0]


def solve_beside(
    scene: Scene, frequency_hz: float, harmonics: int, near: Orbit | Solution | None = None
) -> tuple[Solution, Orbit | None]:
    """Return the response and its orbit, looked for beside `near`, else from rest; errors as `Piecewise`."""
    begun = clock()
    scene = scene.at_frequency(frequency_hz)
    system, orbit = _orbit_of(scene, frequency_hz, near)
    highest = max(harmonics, system.top)
    if isinstance(orbit, SolutionStatus):
        seconds = clock() - begun
        nothing = Solution.without_numbers(
            scene=scene, frequency_hz=frequency_hz, n_harmonics=harmonics, status=orbit, highest=highest,
            seconds=seconds,
        )  # fmt: skip
        return nothing, None
    solution = _described(system, orbit, frequency_hz, harmonics, highest, begun)
    solution._judged.append(verdict_of(_stability(orbit, frequency_hz, begun)))  # a by-product here
    return solution, orbit


def stability_exactly(scene: Scene, frequency_hz: float) -> Stability:
    """Return the multipliers with rigid contacts; errors as `Piecewise`, or where there is no response."""
    begun = clock()
    _, orbit = _orbit_of(scene, frequency_hz)
    if isinstance(orbit, SolutionStatus):
        raise SettingError("solution", orbit.value, "must have converged")
    return _stability(orbit, frequency_hz, begun)


def _orbit_of(
    scene: Scene, frequency_hz: float, near: Orbit | Solution | None = None
) -> tuple[Piecewise, Orbit | SolutionStatus]:
    """Return the response of a scene as an orbit, or why there is none."""
    if isinstance(near, Solution):
        system, polished = orbit_beside(near)
        if polished is not None:
            return system, polished
        near = None
    system = Piecewise(scene, 2.0 * math.pi * frequency_hz)
    try:
        found = find(system, *system.at_rest()) if near is None else follow(system, near)
    except LiftsError:
        return system, SolutionStatus.RIGID_OPENS
    except NoMotionError:
        return system, SolutionStatus.NO_ORBIT
    if isinstance(found, Ended):
        return system, SolutionStatus.RATCHETS if found is Ended.RATCHETS else SolutionStatus.NO_ORBIT
    return system, found


def _described(
    system: Piecewise, orbit: Orbit, frequency_hz: float, harmonics: int, highest: int, begun: float
) -> Solution:
    panels = panels_of(orbit, highest)
    rate = system.motion(system.observe[: system.n], rate=True)
    low, high = panels.extremes(system.observe, rate)
    observed = panels.coefficients(panels.w @ system.observe, highest)
    contacts = _contacts(system, panels, highest)
    largest = max(abs(low), abs(high))
    gain = max(1.0, float(np.abs(system.observe).sum()))
    amplitudes = np.hypot(observed[1::2], observed[2::2])
    return Solution(
        scene=system.scene, frequency_hz=frequency_hz, n_harmonics=harmonics,
        status=SolutionStatus.CONVERGED, max_abs=largest, half_peak_to_peak=0.5 * (high - low),
        mean=float(observed[0]), harmonics=np.concatenate([[abs(observed[0])], amplitudes]),
        observed=observed, contacts=contacts, flags=_flags(system, orbit, contacts),
        residual=orbit.residual, error_estimate=gain * orbit.error + ROUNDING * largest,
        newton_iterations=orbit.steps, seconds=clock() - begun,
    )  # fmt: skip


def _contacts(system: Piecewise, panels: Panels, highest: int) -> tuple[ContactResponse, ...]:
    """Return what every contact does."""
    found: dict[int, ContactResponse] = {}
    for i in range(len(system.members)):
        each = _friction(system, panels, i, highest)
        found[system.members[i].contact] = each
    for at in range(len(system.gaps)):
        found[system.gaps[at][0]] = _gap(system, panels, at, highest)
    return tuple(found[number] for number in range(len(system.scene.contacts)))


def _friction(system: Piecewise, panels: Panels, i: int, highest: int) -> ContactResponse:
    member = system.members[i]
    slider, modes = member.slider, panels.modes
    load = panels.values(np.array([mode.loads[i] for mode in modes]))
    limit = member.friction.limit(np.maximum(load, 0.0))
    whole = panels.values(np.array([mode.limits[slider] for mode in modes]))
    total = panels.values(np.array([mode.forces[slider] for mode in modes]))
    factor = member.factor
    # Parallel rigid contacts share a force in proportion to their limits.
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.sign(factor) * np.where(whole > 0.0, total / whole, 0.0) * limit
        used = np.where(whole > 0.0, np.abs(total) / whole, 0.0)
    if len(system.of_slider[slider]) == 1:
        force = total / factor
    motion = factor * (panels.w[:, : system.n] @ system.d[slider])
    every = [int(state.sliders[slider]) for state in panels.states]
    state = _state(every, [bool(each.closed[i]) for each in panels.states])
    own = {"slip": motion, "force": force}
    if member.normal is not None:
        own["second_motion"] = panels.w[:, : system.n] @ member.normal
        own["second_force"] = np.maximum(load, 0.0) - member.rest
    coefficients = {key: panels.coefficients(values, highest) for key, values in own.items()}
    utilisation = {
        ContactState.STUCK: min(float(used.max(initial=0.0)), 1.0),
        ContactState.SEPARATED: math.nan,
    }
    return ContactResponse(
        name=system.scene.contacts[member.contact].name, state=state,
        load=panels.coefficients(load, highest), utilisation=utilisation.get(state, 1.0), **coefficients,
    )  # fmt: skip


def _state(sliders: list[int], closed: list[bool]) -> ContactState:
    if not any(closed):
        return ContactState.SEPARATED
    if not all(closed):
        return ContactState.LIFTING
    return ContactState.STUCK if all(each == STICK for each in sliders) else ContactState.SLIPPING


def _gap(system: Piecewise, panels: Panels, at: int, highest: int) -> ContactResponse:
    number, row, k, gap = system.gaps[at]
    motion = panels.w[:, : system.n] @ row
    pressed = [bool(each.pressed[at]) for each in panels.states]
    state = ContactState.TOUCHING
    if all(pressed) or not any(pressed):
        state = ContactState.CLOSED if all(pressed) else ContactState.SEPARATED
    force = k * np.maximum(motion - gap, 0.0)
    return ContactResponse(
        name=system.scene.contacts[number].name, state=state, slip=panels.coefficients(motion, highest),
        force=panels.coefficients(force, highest), load=np.zeros(3),
        utilisation=math.nan if state is ContactState.SEPARATED else 1.0,
    )  # fmt: skip


def _flags(system: Piecewise, orbit: Orbit, contacts: tuple[ContactResponse, ...]) -> tuple[str, ...]:
    """Return the flags; the mean is open where a direction that nothing decides moves what is observed."""
    mean_open, range_open = grazed(system, orbit), False
    for direction in orbit.open_directions.T:
        seen = []
        for piece in orbit.pieces:
            for share in np.linspace(0.0, 1.0, 5):
                way = _through(piece.mode, share * piece.length)
                seen.append(float(system.observe @ (way @ (piece.phi @ direction))))
        size = float(np.abs(direction).max())
        mean_open |= max(map(abs, seen)) > _MOVES * size
        range_open |= max(seen) - min(seen) > _MOVES * size
    return flags_of(contacts, mean_open=mean_open, half_range_open=range_open)


def _through(mode: Mode, length: float) -> Real:
    """Return e^{A length} of any length."""
    steps = steps_of(mode)
    whole, rest = divmod(length, steps.h)
    return np.asarray(np.linalg.matrix_power(steps.powers[1], int(whole)) @ exponential(mode.A * rest))


def _stability(orbit: Orbit, frequency_hz: float, begun: float) -> Stability:
    """Return the multipliers of an orbit, those of open directions apart."""
    neutral = orbit.open_directions.shape[1]
    others = orbit.multipliers[np.argsort(np.abs(orbit.multipliers - 1.0))[neutral:]]
    multipliers = others[np.argsort(-np.abs(others), kind="stable")].astype(np.complex128)
    return Stability(
        multipliers=multipliers, neutral=neutral, growth=growth_of(multipliers), frequency_hz=frequency_hz,
        seconds=clock() - begun,
    )  # fmt: skip
