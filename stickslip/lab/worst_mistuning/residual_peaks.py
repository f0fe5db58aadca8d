"""The worst mistuning together with the worst forces that stuck contacts of a disk may hold.

A contact that sticks all the time keeps a force s, whatever brought it there, as long as |kt u + s| ≤ μN at
every instant (`solver.response.contact_response`). Where contacts stick at a peak, what is possible
is therefore the largest max|x| over the factors of the blades, the frequency and these forces together:

    maximise max|x_b|(δ, s, f)   subject to   min over τ of μN − ±(kt u + s) ≥ 0,  δ and f within bounds,

for each blade b, by sequential quadratic programming (SLSQP: Kraft, DFVLR-FB 88-28 (1988)). Amplitude and
rooms have exact derivatives by all of these, through the whole solve; a minimum over τ has those at its
instant (envelope theorem). It begins where, on a grid of frequencies, the amplitude is largest with each
force at the end of its room that the slopes point to: under given loads, where s moves the mean alone, those
are the worst forces. (s alone may exceed the limit: the mean that it moves takes part of it back.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from solver.arrays import Real
from solver.balance.balance import Balance, build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.jit import fourier
from solver.response.contact_response import ContactState, contact_responses
from solver.response.contact_response import LeftForces
from solver.response.wear import lowest
from solver.scene.scene import AnyContact, Scene
from solver.sensitivity.gradient import Sensitivities
from stickslip.lab.worst_mistuning.climbing import Bounds, root_mean_square
from stickslip.lab.worst_mistuning.linear_disk import TWO_PI
from stickslip.lab.worst_mistuning.solved_disk import SolvedDisk
from stickslip.lab.worst_mistuning.worst_result import ResidualPeak

FREQUENCIES = 12  # of the band, at which a climb may begin
FURTHER = 2  # climbs beyond the best of each pattern
KEPT = 1e-6  # share of a limit by which a force may exceed it
_ASIDE = 1e-6
_ROUNDS = 3  # of a climb, each with the contacts that stick where the one before ended
_FLAT = 1e-10  # of the logarithm of the amplitude


@dataclass(frozen=True, slots=True)
class _Place:
    """A disk at a frequency with forces left in its contacts."""

    delta: Real
    forces: Real
    hertz: float


@dataclass(frozen=True, slots=True)
class _Judged:
    """Its largest amplitude and the rooms below the limits, with derivatives by (δ, s, f)."""

    u: Real
    value: float
    slope: Real
    rooms: Real
    room_slopes: Real


_Estimate = tuple[float, int, tuple[int, ...], _Place]  # amplitude, blade, contacts that stick, where


class _NoResponseError(Exception):
    """A place has no response that the search could go on from."""


class ResidualSearch:
    """A disk whose worst mistuning and worst residual forces are looked for.

    Its factors are of parts with parameters; `go_on` is asked before each response.
    """

    def __init__(self, disk: SolvedDisk, go_on: Callable[[], bool]) -> None:
        self._disk, self._rows, self._go_on = disk, disk.paths, go_on
        self._last: tuple[bytes, Scene] | None = None

    def worst(
        self, begins: Sequence[tuple[Real, float]], bounds: Bounds, tuned: float
    ) -> ResidualPeak | None:
        """Return the worst found from some patterns, each with the frequency of its peak.

        None where no contact sticks all the time at any frequency that was looked at.

        Parameters
        ----------
        begins : patterns δ and frequencies [Hz].
        bounds : of δ.
        tuned : peak of the tuned disk [m].
        """
        low, high = self._disk.band
        first, others = [], []
        for delta, own in begins:
            tried = [self._estimates(delta, float(at)) for at in (own, *np.linspace(low, high, FREQUENCIES))]
            # Of a pattern at a frequency one blade: a tuned disk has as many of each as blades.
            ranked = sorted((max(some, key=_height) for some in tried if some), key=_height, reverse=True)
            first += ranked[:1]
            others += ranked[1:]
        found = [*first, *sorted(others, key=_height, reverse=True)[:FURTHER]]
        ends: list[tuple[float, ResidualPeak]] = []
        for start in found:
            end = self._ended(start, bounds, tuned)
            ends += [] if end is None else [(end.peak, end)]
        return max(ends, key=lambda pair: pair[0], default=(0.0, None))[1]

    def _estimates(self, delta: Real, hertz: float) -> list[_Estimate]:
        """Return for each blade the amplitudes with its forces at the ends that the slopes point to."""
        found = []
        try:
            stuck, u = self._natural(_Place(delta, np.zeros(0), hertz))
            if not stuck:
                return []
            annulus = self._annulus(delta)
            limits = np.array([_limit(annulus, i) for i in stuck])
            # A motion as far to both sides has a kink: hardly any force says which of them it looks at.
            aside = _ASIDE * limits * np.cos(np.arange(1.0, limits.size + 1.0))
            here = self._judged(_Place(delta, aside, hertz), 0, stuck, u)
            rooms = np.maximum(here.rooms.reshape(-1, 2), 0.0)
            # d (kt u + s) / ds: a force s moves the mean.
            carried = -here.room_slopes[::2, delta.size : -1]
            left = LeftForces.of(annulus, stuck)
            for blade in range(delta.size):
                by_force = left.by_force(self._seen(_Place(delta, aside, hertz), blade, left, here.u)[1])
                up = np.linalg.solve(carried.T, by_force) >= 0.0
                for way in (up, ~up):
                    ends = np.where(way, rooms[:, 0], -rooms[:, 1])
                    place = _Place(delta, np.asarray(np.linalg.solve(carried, ends), np.float64), hertz)
                    found.append((self._seen(place, blade, left, here.u)[0], blade, stuck, place))
        except (_NoResponseError, np.linalg.LinAlgError):
            pass  # a climb from elsewhere may come by
        return found

    def _seen(self, place: _Place, blade: int, left: LeftForces, guess: Real) -> tuple[float, Real]:
        """Return the amplitude of a blade with forces left in its contacts, and its slopes by these loads."""
        scene = left.on(self._annulus(place.delta, blade), place.forces)
        workspace, u = self._solved(scene, place.hertz, guess)
        found = Sensitivities(workspace.balance, left.paths).gradient(u, place.hertz)
        if not math.isfinite(found.value) or not np.all(np.isfinite(found.by_parameters)):
            raise _NoResponseError
        return found.value, found.by_parameters

    def _ended(self, start: _Estimate, bounds: Bounds, tuned: float) -> ResidualPeak | None:
        """Return where a climb ends; it goes on where another blade or other forces there do better."""
        best: tuple[_Judged, _Place, tuple[int, ...]] | None = None
        of = start[1]
        for _ in range(_ROUNDS):
            _, blade, stuck, place = start
            climbed = self._climbed(blade, stuck, place, bounds)
            if climbed is None or (best is not None and climbed[0].value <= best[0].value):
                break
            best, of = (*climbed, stuck), blade
            again = self._estimates(climbed[1].delta, climbed[1].hertz)
            start = max(again, key=_height, default=start)
            if start[0] <= climbed[0].value:
                break
        if best is None:
            return None
        judged, place, stuck = best
        free = self._judged(_Place(place.delta, 0.0 * place.forces, place.hertz), of, stuck, judged.u)
        names = [contact.name for contact in self._annulus(place.delta).contacts]
        return ResidualPeak(
            factors=tuple((1.0 + place.delta).tolist()), contacts=tuple(names[i] for i in stuck),
            tractions=tuple(place.forces.tolist()), magnification=judged.value / tuned, peak=judged.value,
            blade=of, at_hz=place.hertz, without=free.value,
        )  # fmt: skip

    def _climbed(
        self, blade: int, stuck: tuple[int, ...], begin: _Place, bounds: Bounds
    ) -> tuple[_Judged, _Place] | None:
        """Return the highest place on a climb at which every force is within its limit."""
        N, (low, high) = begin.delta.size, self._disk.band
        annulus = self._annulus(begin.delta)
        limits = np.array([_limit(annulus, i) for i in stuck])
        unit = np.concatenate([np.full(N, bounds.within), limits, [high - low]])
        zero = np.concatenate([bounds.middle, np.zeros(len(stuck)), [low]])
        kept: list[tuple[float, _Judged, _Place]] = []
        known: dict[bytes, _Judged] = {}
        guess: list[Real | None] = [None]

        def at(z: Real) -> _Judged:
            if z.tobytes() not in known:
                y = zero + unit * z
                place = _Place(y[:N], y[N:-1], float(np.clip(y[-1], low, high)))
                here = self._judged(place, blade, stuck, guess[0])
                guess[0], known[z.tobytes()] = here.u, here
                most = math.inf if bounds.rms is None else bounds.rms * (1.0 + KEPT)
                within = root_mean_square(y[:N] - bounds.middle) <= most
                if within and np.all(here.rooms >= -KEPT * np.repeat(limits, 2)):
                    kept.append((here.value, here, place))
            return known[z.tobytes()]

        scales = np.repeat(limits, 2)
        limited = [
            {
                "type": "ineq", "fun": lambda z: at(z).rooms / scales,
                "jac": lambda z: at(z).room_slopes * unit / scales[:, None],
            }
        ]  # fmt: skip
        if bounds.rms is not None:
            rms = bounds.rms
            off = bounds.within / rms
            limited.append({
                "type": "ineq", "fun": lambda z: np.array([1.0 - float(np.mean((off * z[:N]) ** 2))]),
                "jac": lambda z: np.concatenate([-2.0 * off**2 * z[:N] / N, np.zeros(z.size - N)])[None],
            })  # fmt: skip
        first = (np.concatenate([begin.delta, begin.forces, [begin.hertz]]) - zero) / unit
        try:
            scale = at(first).value
            minimize(
                lambda z: (-at(z).value / scale, -at(z).slope * unit / scale), first, jac=True,
                method="SLSQP", bounds=[(-1.0, 1.0)] * N + [(None, None)] * len(stuck) + [(0.0, 1.0)],
                constraints=limited, options={"maxiter": 60, "ftol": _FLAT},
            )  # fmt: skip
        except _NoResponseError:
            pass  # what was reached until then counts
        if not kept:
            return None
        _, judged, place = max(kept, key=lambda one: one[0])
        return judged, place

    def _annulus(self, delta: Real, blade: int = 0) -> Scene:
        """Return the mistuned disk written out, one of its blades observed."""
        if self._last is None or self._last[0] != delta.tobytes():
            self._last = delta.tobytes(), self._disk.annulus(delta)
        disk = self._last[1]
        observe = disk.observe.model_copy(update={"dof": f"{self._disk.dof}@{blade}", "measure": "max_abs"})
        return disk.model_copy(update={"observe": observe})

    def _natural(self, place: _Place) -> tuple[tuple[int, ...], Real]:
        """Return the contacts that stick all the time, on a line, free of force at first, and the motion."""
        workspace, u = self._solved(self._annulus(place.delta), place.hertz, None)
        found = contact_responses(workspace, u, TWO_PI * place.hertz)
        contacts = workspace.balance.scene.contacts
        stuck = (
            i
            for i, (one, given) in enumerate(zip(found, contacts, strict=True))
            if one.state is ContactState.STUCK and given.slides_on_a_line and given.friction is not None
        )
        return tuple(stuck), u

    def _solved(self, scene: Scene, hertz: float, guess: Real | None) -> tuple[Workspace, Real]:
        """Return a response of a disk with all harmonics, the mean among them."""
        if not self._go_on():
            raise _NoResponseError
        balance: Balance = build(scene, harmonics=self._disk.harmonics, effects=Effects(even_harmonics=True))
        workspace = Workspace.of(balance)
        omega = TWO_PI * hertz
        found = workspace.solve(omega) if guess is None else workspace.solve_from(omega, guess)
        if not found.converged and guess is not None:
            found = workspace.solve(omega)
        if not found.converged:
            raise _NoResponseError
        return workspace, found.u.copy()

    def _judged(self, place: _Place, blade: int, stuck: tuple[int, ...], guess: Real | None) -> _Judged:
        """Return the amplitude of a blade with forces left in its contacts, and their room below limits."""
        annulus = self._annulus(place.delta, blade)
        left = LeftForces.of(annulus, stuck)
        scene = left.on(annulus, place.forces)
        workspace, u = self._solved(scene, place.hertz, guess)
        parts = [path for row in self._rows for path in row]
        paths, N = [*parts, *left.paths], len(self._rows)
        moved = np.array([scene.value(path) for path in parts]).reshape(N, -1) / (1.0 + place.delta[:, None])

        def by_place(by_paths: Real, by_hertz: float) -> Real:
            own = by_paths[: len(parts)].reshape(N, -1)
            return np.concatenate([
                (own * moved).sum(axis=1), left.by_force(by_paths[len(parts) :]), [by_hertz]
            ])  # fmt: skip

        seen = Sensitivities(workspace.balance, paths)
        amplitude, moves = seen.gradient(u, place.hertz), seen.motions(u, place.hertz)
        if moves is None or not np.all(np.isfinite(amplitude.by_parameters)):
            raise _NoResponseError
        ks, top = workspace.balance.system.ks, workspace.balance.highest_harmonic
        ports = np.append(0, np.cumsum(annulus.port_counts, dtype=np.int64))
        motions = fourier.to_full(np.concatenate([u.reshape(1, *moves.shape[1:]), moves]), ks, top)
        rooms, slopes = [], []
        for k, i in enumerate(stuck):
            own = motions[:, ports[i] : ports[i + 1]]
            for sign in (1.0, -1.0):
                room, by = _room(annulus.contacts[i], own, float(place.forces[k]), sign)
                slope = by_place(by[1:], TWO_PI * by[0])
                slope[N + k] -= sign
                rooms.append(room)
                slopes.append(slope)
        return _Judged(
            u, amplitude.value, by_place(amplitude.by_parameters, amplitude.by_frequency), np.array(rooms),
            np.array(slopes),
        )  # fmt: skip


def _room(contact: AnyContact, motions: Real, left: float, sign: float) -> tuple[float, Real]:
    """Return how far a contact that sticks stays below its limit [N], the least of μN − ±(kt u + s).

    With its derivatives (P,) at a fixed s, of motions (1 + P, ports, 2H + 1), the first those themselves.
    """
    slider = contact.friction
    if slider is None:
        return math.inf, np.zeros(len(motions) - 1)
    load = contact.normal_load(motions[0])
    room = np.zeros(max(load.size, motions.shape[-1]))
    room[: load.size] += slider.limit(load)
    room[: motions.shape[-1]] -= sign * slider.kt * motions[0, slider.ports[0]]
    room[0] -= sign * left
    at = fourier.basis(np.array([lowest(room)]), (room.size - 1) // 2)[0]
    moved = -sign * slider.kt * motions[1:, slider.ports[0]]
    if slider.normal_port is not None:
        moved = moved + slider.limit_rise * motions[1:, slider.normal_port]
    return float(at @ room), np.asarray(moved @ at[: motions.shape[-1]])


def _height(estimate: _Estimate) -> float:
    return estimate[0]


def _limit(scene: Scene, i: int) -> float:
    """Return the limit of a contact under the load it is given [N] at most, for a scale."""
    slider, load = scene.contacts[i].friction, scene.contacts[i].load
    if slider is None or load is None:
        return 1.0
    return slider.limit(float(np.abs(load.coefficients).sum())) or 1.0
