"""The response to two base frequencies that are no multiples of one another: a torus, not a closed orbit.

The ratio of the frequencies is put between two ratios of whole numbers q/p. For each of them the motion
repeats after p turns of the first and q of the second frequency, and the balance of that long period answers
it on the events of the contacts, whose history along the torus is thus followed exactly. Harmonic n of it is
n = k p + l q, a sum k f₁ + l f₂ of the two frequencies: both answers are of the same waves, and what is asked
for lies linearly between them. Longer periods are taken until nothing changes any more.

All harmonics up to the highest are kept, not only low sums |k| + |l|: where sums of a high order meet a
resonance they count (at 29 : 41 the sum 15 f₁ − 10 f₂ is 0.5 % of the motion of `two-dof`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.arrays import Real
from solver.balance.balance import build
from solver.balance.rounding import resonates_undamped
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.balance.workspace import Workspace
from solver.continuation.from_nothing import solve_from_nothing
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.jit.fourier import Integer
from stickslip.lab.quasi_periodic.quasi_periodic_result import LINES, QuasiPeriodic, QuasiPeriodicStatus
from solver.response.solution import MEAN_UNDETERMINED, Solution
from solver.response.solve import describe, solve
from stickslip.lab.quasi_periodic.torus import NOWHERE, ContactMotions, Torus, sizes_on, torus_of
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.excitation import Excitation
from solver.scene.scene_harmonics import MOST_HARMONICS
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

LEAST_TURNS = 12  # of the first look; each further one has twice as many
_EXACT = 1e-12  # relative: a ratio this near to one of whole numbers is that ratio
_SAFETY = 2.0  # fitted to random scenes against marches of very long periods
_SECTION = 240  # points of the section


@dataclass(frozen=True, slots=True)
class _LongPeriods:
    """What periods of at most so many turns tell."""

    torus: Torus
    sizes: Real
    turns: tuple[tuple[int, int], ...]
    nearest: Solution
    repeats: bool
    motions: ContactMotions | None

    def measures(self) -> Real:
        """Return max|x|, (max x - min x) / 2, root mean square and the amplitudes of the two tones."""
        torus = self.torus
        tones = [abs(torus.c[(torus.k == k) & (torus.l == 1 - k)].sum()) for k in (1, 0)]
        return np.array([*self.sizes, math.sqrt(0.5 * float(np.sum(np.abs(torus.c) ** 2))), *tones])

    def change(self, other: _LongPeriods) -> float:
        """Return by how much what is determined may be wrong: by what differs from another look, and more.

        Where sums of high order meet a resonance two looks may agree by accident. So waves of an order that
        curves of so few turns do not tell count by the root of the sum of squares, and half of what the
        extremes of the curves differ from those of the waves between them.
        """
        first, torus = int(MEAN_UNDETERMINED in self.nearest.flags), self.torus
        high = torus.c[~torus.low(min(self.turns, key=sum))]
        off = np.abs(self.measures() - other.measures())[first:]
        between = 0.5 * np.abs(self.sizes - torus.sizes())[first:]
        return float(max(*off, *between, np.linalg.norm(high)))


@shows_progress("quasi-periodic")
def quasi_periodic(
    scene: Scene,
    *,
    frequency_hz: float,
    second_hz: float,
    amplitude: float,
    dof: str | None = None,
    phase: float = 0.0,
    engine_order: int | None = None,
    harmonics: int = 7,
    turns: int = 90,
    tolerance: float = 2e-3,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> QuasiPeriodic:
    """Find the response of a scene to its excitation and one more force that has a frequency of its own.

    Parameters
    ----------
    scene : what vibrates; its excitation and loads turn with the first frequency, as its speed does.
    frequency_hz, second_hz : the two frequencies [Hz]. Where their ratio is one of whole numbers up to
        `turns` the motion repeats, and depends on how the phases of the two stand to one another.
    amplitude, dof, phase : of the second force, amplitude * cos(2 pi second_hz t + phase) [N, rad]; on the
        DOF of the first force if left out.
    engine_order : of the second force on a disk, whose sector j has engine_order * j * 2 pi / sectors added
        to the phase; that of the scene if left out.
    harmonics : multiples of the faster frequency up to which all sums of the two are kept.
    turns : most turns of the faster frequency after which the motion is taken to repeat.
    tolerance : change by longer periods, relative to the amplitude, at which they are long enough.
    on_progress : called with the fraction done and the long periods solved.
    should_stop : asked now and then; True ends it with the status STOPPED.

    Raises
    ------
    SettingError
        An argument out of its range, rigid contacts, a scene whose force has no single DOF and none is given.
    """
    began = clock()
    check(scene, frequency_hz, second_hz, harmonics, turns, tolerance)
    second = second_force(scene, amplitude=amplitude, dof=dof, phase=phase, engine_order=engine_order)
    question = Question(scene.at_frequency(frequency_hz), second, frequency_hz, second_hz, harmonics)
    watch = TorusWatch(on_progress, should_stop)
    return respond(question, turns, tolerance, None, watch, began)[0]


@dataclass(frozen=True, slots=True)
class TorusWatch:
    """Who watches, over a part of the whole."""

    on_progress: OnProgress = None
    should_stop: ShouldStop = None


def respond(
    question: Question, turns: int, tolerance: float, start: ContactMotions | None, watch: TorusWatch,
    began: float,
) -> tuple[QuasiPeriodic, ContactMotions | None]:  # fmt: skip
    """Answer a question, from a motion known to be near; return what another one can begin with, too."""
    on_progress, should_stop = watch.on_progress, watch.should_stop
    looks: list[_LongPeriods] = []
    limits = [turns // 2**i for i in range(int(math.log2(turns / LEAST_TURNS)) + 1)][::-1]
    status, change = QuasiPeriodicStatus.NOT_CONVERGED, math.nan
    if question.undamped():
        status, limits = QuasiPeriodicStatus.UNDAMPED, []
    for number, limit in enumerate(limits):
        if should_stop is not None and should_stop():
            status = QuasiPeriodicStatus.STOPPED
            break
        if (look := question.look(limit, start)) is None:
            continue
        start = look.motions
        status = QuasiPeriodicStatus.ACCURACY_NOT_REACHED
        change = 0.0 if look.repeats else _SAFETY * look.change(looks[-1]) if looks else math.nan
        looks.append(look)
        if on_progress is not None:
            on_progress((number + 1) / len(limits), len(looks))
        if change <= tolerance * look.sizes[1]:
            status = QuasiPeriodicStatus.CONVERGED
            break
    if on_progress is not None:
        on_progress(1.0, len(looks))
    return question.answer(looks, status, change, began), start


def check(
    scene: Scene, frequency_hz: float, second_hz: float, harmonics: int, turns: int, tolerance: float
) -> None:
    """Raise SettingError for what cannot be solved."""
    check_frequency("frequency_hz", frequency_hz)
    check_frequency("second_hz", second_hz)
    scene.observe.check_whole("a response to two frequencies")
    if frequency_hz == second_hz:
        raise SettingError("second_hz", second_hz, "must differ from `frequency_hz`")
    if scene.rigid_contact is not None:
        raise SettingError("scene", f"contact {scene.rigid_contact}", "must have a finite stiffness")
    if not 0 < tolerance <= 0.1:
        raise SettingError("tolerance", tolerance, "must be a number > 0 and <= 0.1")
    if turns < LEAST_TURNS:
        raise SettingError("turns", turns, f"must be at least {LEAST_TURNS}")
    orders = {force.harmonic for force in scene.excitation}
    highest = max(harmonics, 1, *orders)
    if highest * turns > MOST_HARMONICS:
        wanted = f"must be at most {MOST_HARMONICS // highest} with {highest} harmonics"
        raise SettingError("turns", turns, wanted)


def second_force(
    scene: Scene, *, amplitude: float, dof: str | None, phase: float, engine_order: int | None
) -> Excitation:
    """Return the second force; SettingError for a DOF that is none, or where several could be meant."""
    place = scene.excitation[0].dof if dof is None else dof
    if place not in scene.dofs:
        known = ", ".join(scene.dofs)
        raise SettingError("dof", place, f"must be the DOF the second force acts on, one of {known}")
    if engine_order is not None and not scene.structure.has_sectors:
        raise SettingError("engine_order", engine_order, "must be left out: the scene has no sectors")
    order = scene.engine_order if engine_order is None else engine_order
    return Excitation(
        dof=place, amplitude=amplitude, phase=phase,
        engine_order=order if scene.structure.has_sectors else None,
        pattern=scene.excitation[0].pattern,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Question:
    """A scene at its speed, the second force, both frequencies [Hz] and the multiples kept."""

    scene: Scene
    second: Excitation
    first_hz: float
    second_hz: float
    harmonics: int

    def look(self, limit: int, start: ContactMotions | None) -> _LongPeriods | None:
        """Solve for the ratios next to that of the frequencies; None where one has no solution or none is.

        Nor is there one between two ratios on either side of a resonance that nothing damps.
        """
        ratios = list(self._ratios(limit))
        if len(ratios) == 2 and self._meets_undamped(*(self.first_hz * q / p for p, q in ratios)):
            return None
        solved = [self._solved(p, q, start) for p, q in ratios]
        found = [each for each, _ in solved]
        if not found or not all(each.converged for each in found):
            return None
        wanted = self.second_hz / self.first_hz
        off = [q / p - wanted for p, q in ratios]
        tori = [torus_of(each, *turns) for each, turns in zip(found, ratios, strict=True)]
        nearest = int(np.argmin(np.abs(off)))
        exact = abs(off[nearest]) <= _EXACT * wanted
        pairs = list(zip(found, tori, ratios, strict=True))
        torus, sizes = tori[0], np.array([sizes_on(*each, repeats=exact) for each in pairs])
        if len(tori) == 2:
            share = off[0] / (off[0] - off[1])
            torus = torus.beside(tori[1], share)
            sizes = sizes + share * np.diff(sizes, axis=0)
        motions = solved[nearest][1] or start
        return _LongPeriods(torus, sizes[0], tuple(ratios), found[nearest], exact, motions)

    def undamped(self) -> bool:
        """Return whether a force meets a resonance that nothing damps, at which no response has a size."""
        omega = 2.0 * math.pi * self.first_hz
        first = resonates_undamped(build(self.scene, harmonics=self.harmonics), omega, omega)
        return first or self._meets_undamped(self.second_hz, self.second_hz)

    def _meets_undamped(self, low_hz: float, high_hz: float) -> bool:
        """Return the same of the second force alone, with a frequency anywhere between two."""
        alone = build(self.scene.model_copy(update={"excitation": (self.second,)}), harmonics=1)
        return resonates_undamped(alone, 2.0 * math.pi * low_hz, 2.0 * math.pi * high_hz)

    def _ratios(self, limit: int) -> Iterator[tuple[int, int]]:
        """Turns p and q of the two with q/p next below and above the ratio, or equal to it.

        Where the contacts answer half-waves alike p and q are both odd: the motion is then as symmetric as
        that on the torus. On a disk p and q have the residues for which one engine order of the long period
        is both of them.
        """
        p, q = (each.ravel() for each in np.meshgrid(np.arange(1, limit + 1), np.arange(1, limit + 1)))
        wave = self._order_of_long_period(p, q) >= 0
        proper = (np.gcd(p, q) == 1) & (p != q) & wave
        off = q / p - self.second_hz / self.first_hz
        exact = proper & (np.abs(off) <= _EXACT * self.second_hz / self.first_hz)
        # Only long periods, so that no look has a ratio of the one before: their difference tells the error.
        proper &= 2 * np.maximum(p, q) > limit
        symmetric = even_harmonics_reason(self._at(1, 1)) is None
        odd = proper & (p % 2 == 1) & (q % 2 == 1)
        proper = odd if symmetric and odd.any() else proper
        for side in (exact,) if exact.any() else (proper & (off < 0.0), proper & (off > 0.0)):
            if side.any():
                at = np.flatnonzero(side)[np.argmin(np.abs(off[side]))]
                yield int(p[at]), int(q[at])

    def _order_of_long_period(self, p: Integer, q: Integer) -> Integer:
        """The engine order of the long period by which both forces have their own, −1 where there is none."""
        sectors = self.scene.structure.sector_count
        orders = np.arange(sectors)[:, None]
        both = (p * orders - self.scene.engine_order) % sectors == 0
        both &= (q * orders - (self.second.engine_order or 0)) % sectors == 0
        return np.where(both.any(axis=0), np.argmax(both, axis=0), -1)

    def _at(self, p: int, q: int) -> Scene:
        """The scene with p and q turns in its period."""
        order: dict[str, Any] = {}
        if self.scene.structure.has_sectors:
            order = {"engine_order": int(self._order_of_long_period(np.array([p]), np.array([q]))[0])}
        forces = [(force, p) for force in self.scene.excitation] + [(self.second, q)]
        excitation = tuple(
            force.model_copy(update={"harmonic": force.harmonic * each, **order}) for force, each in forces
        )
        contacts = tuple(one.model_copy(update=one.in_period_of(p)) for one in self.scene.contacts)
        return self.scene.model_copy(update={"excitation": excitation, "contacts": contacts})

    def _solved(
        self, p: int, q: int, start: ContactMotions | None, *, estimated: bool = False
    ) -> tuple[Solution, ContactMotions | None]:
        """Solve the balance of p and q turns, from motions known to be near."""
        scene, base, highest = self._at(p, q), self.first_hz / p, self.harmonics * max(p, q)
        begun = clock()
        workspace = Workspace.of(build(scene, harmonics=highest))
        guess = None if start is None else start.guess(workspace.balance, p, q)
        found = solve_from_nothing(workspace, 2.0 * math.pi * base, guess)
        if not found.converged and guess is not None:
            found = solve_from_nothing(workspace, 2.0 * math.pi * base)
        if not found.converged:
            return solve(scene, frequency_hz=base, harmonics=highest), None
        motions = ContactMotions.of(found.u, workspace.balance, p, q)
        return describe(workspace, found, base, begun, estimated=estimated), motions

    def answer(
        self, looks: list[_LongPeriods], status: QuasiPeriodicStatus, change: float, began: float
    ) -> QuasiPeriodic:
        """Read the result off the last look; what the harmonics left out do, off the first and shortest."""
        torus, sizes, section = NOWHERE, np.full(5, math.nan), np.empty(0)
        turns: tuple[tuple[int, int], ...] = ()
        if looks:
            look, shortest = looks[-1], self._solved(*looks[0].turns[0], looks[0].motions, estimated=True)[0]
            torus, sizes, turns = look.torus, look.measures(), look.turns
            change += shortest.error_estimate / shortest.half_peak_to_peak * float(sizes[1])
            p, q = turns[0]
            section = q * np.arange(p) / p % 1.0 if look.repeats else np.linspace(0.0, 1.0, _SECTION)
        angle, still = 2.0 * math.pi * section, np.zeros(section.size)
        hertz = torus.k * self.first_hz + torus.l * self.second_hz
        moving = Torus(torus.k, torus.l, 2j * math.pi * hertz * torus.c, 0.0)
        top = np.argsort(-np.abs(torus.c))[:LINES]
        max_abs, half, rms, first, second = sizes.tolist()
        return QuasiPeriodic(
            scene=self.scene.name, dof=self.scene.observe.dof, status=status, frequency_hz=self.first_hz,
            second_hz=self.second_hz, max_abs=max_abs, half_peak_to_peak=half, rms=rms, mean=torus.mean,
            first_amplitude=first, second_amplitude=second, repeats=bool(looks and looks[-1].repeats),
            line_first=torus.k[top], line_second=torus.l[top], line_hz=np.abs(hertz[top]),
            line_amplitude=np.abs(torus.c[top]), section=torus.at(still, angle),
            section_velocity=moving.at(still, angle), turns=turns,
            contacts={each.name: each.state.value for each in looks[-1].nearest.contacts} if looks else {},
            flags=looks[-1].nearest.flags if looks else (), n_harmonics=self.harmonics,
            error_estimate=change, seconds=clock() - began,
        )  # fmt: skip
