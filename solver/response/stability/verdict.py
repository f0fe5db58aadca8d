"""Whether a response is stable: yes, no, or not known and why; and whether it is the only one.

It is known without Floquet multipliers where loads are given, stiffnesses constant and everything takes out
power, and computed by them where that costs little; `forecast` says what it costs. What computes them is
loaded where it is needed: it brings SciPy's packages along, which an answer does without.

*Monotone.* Friction under loads that are given and springs of constant stiffness never let two motions of a
structure that takes out power move apart (`solver.response.history_dependence`): the response is the only one
but for residual forces where contacts stick.

*Contraction.* Let every contact be a spring and what is left of it: friction under a load that moves is
kt (u − w), and where its slider is held follows motion and limit, in the largest difference over time,

    |δw| ≤ |δu| + |δ(μN)|/kt      (unless it never moves: a residual force),

because w moves only where u − μN/kt or u + μN/kt pushes it: as long as δw is larger, neither slider can move
away from the other, so that a periodic difference is constant or never as large (the play operator of
A. Visintin, Differential Models of Hysteresis, 1994, chapter III, here with bounds that move). A normal load
max(N, 0) or a spring on one side is half its stiffness, and what is left follows the motion by half of it.
Two periodic responses then differ by

    max|δu_i| ≤ Σ_j G_ij Λ_jk max|δu_k|,      G_ij = ∫₀ᵀ |g_ij(t)| dt,

g the T-periodic impulse responses of the structure with these springs. If the spectral radius of G Λ is below
1 the difference is 0. The integral is bounded from above by its sum at midpoints and the largest slope.

*No resonance between.* Springs on one side alone differ from half their stiffness by no more than half of it
at any instant, so that in the mean square over a period the same holds harmonic by harmonic: if at every
multiple of the frequency the largest singular value of √Λ H(kω) √Λ is below 1, there is one response (the
circle criterion, I. W. Sandberg, Bell Syst. Tech. J. 43 (1964) 1601).

Neither can be met near a resonance of little damping. "Not known" does not say that there are others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.continuation.branch import Branch, Peak
from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from solver.lab import LAB, from_lab, is_there
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel
from solver.response.stability.cost import forecast
from solver.response.stability.multipliers import verdict_of
from solver.results import units
from solver.results.known import TAKES_LONG, Stable, Verdict
from solver.results.told import Piece
from solver.scene.cyclic.annulus import annulus
from solver.scene.scene import Scene
from solver.wording import listing

if TYPE_CHECKING:
    from solver.response.solution import Solution

PROVEN, NOT_KNOWN = "proven", "not known"
MARGIN = 0.999  # what rounding may leave of a bound that is below 1
LARGEST = 120  # coordinates above which the proofs for loads that move are not tried
_SAME = 1e-12  # of the largest entry, or power: less is rounding
_ENTRIES = 1_000_000  # of matrices at nodal diameters looked at together
_CELLS = 4096
_MOST_MULTIPLES = 10_000
MONOTONE = (
    "loads are given, stiffnesses constant, and everything takes out power: any two responses come together, "
    "but for residual forces where contacts stick"
)
_POWER = "damping, or a stiffness that is not symmetric, may put in power"
_CONTRACTS = (
    "the structure with its contacts as springs answers what is left of them by less than it is "
    "({:.3g} of 1): two responses are one, but for residual forces where contacts stick"
)
_BETWEEN = "no multiple of the frequency can meet a resonance between open and closed contacts ({:.3g} of 1)"
_MAY_BE = "{} may let responses move apart, and no proof of a single one applies"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Uniqueness(Piece):
    """Whether a response is the only one."""

    unique: Annotated[str, "``proven`` or ``not known``."]
    ground: Annotated[str, "Why."]

    @property
    def proven(self) -> bool:
        """Whether there is no other, but for residual forces."""
        return self.unique == PROVEN


def uniqueness(scene: Scene, frequency_hz: float) -> Uniqueness:
    """Return whether a scene has one periodic response at a frequency, with the period of its excitation.

    Parameters
    ----------
    scene : what vibrates.
    frequency_hz : excitation frequency [Hz].
    """
    scene = scene.at_frequency(frequency_hz)
    model = linear_model(scene)
    if monotone(scene, model):
        return Uniqueness(unique=PROVEN, ground=MONOTONE)
    if all(contact.keeps_together for contact in scene.contacts):
        return Uniqueness(unique=NOT_KNOWN, ground=_POWER)
    others = listing([contact.name for contact in scene.contacts if not contact.keeps_together])
    unknown = Uniqueness(unique=NOT_KNOWN, ground=_MAY_BE.format(others))
    in_time = model.extra is None or model.extra.is_real
    known = in_time and model.every_diameter and not (model.prescribed or model.points)
    if not known or model.n_coordinates * model.sectors > LARGEST:
        return unknown
    if scene.structure.has_sectors:
        scene = annulus(scene)
        model = linear_model(scene)
    springs = [contact.slopes for contact in scene.contacts]
    if any(each is None for each in springs):
        return unknown
    centre, rest = _joined(scene, [each for each in springs if each is not None])
    # What is left of a contact that opens without sliding depends on the instant alone.
    if all(contact.OPENS and contact.friction is None for contact in scene.contacts):
        largest = _largest_gain(model, centre, rest, 2.0 * math.pi * frequency_hz)
        if largest < MARGIN:
            return Uniqueness(unique=PROVEN, ground=_BETWEEN.format(largest))
        return unknown
    gains = _gains(model, centre, 2.0 * math.pi * frequency_hz)
    if gains is None:
        return unknown
    radius = float(np.abs(np.linalg.eigvals(gains @ rest)).max(initial=0.0))
    if radius < MARGIN:
        return Uniqueness(unique=PROVEN, ground=_CONTRACTS.format(radius))
    return unknown


def monotone(scene: Scene, model: LinearModel) -> bool:
    """Whether two motions of a scene never move apart; `model` is that of the scene."""
    return all(contact.keeps_together for contact in scene.contacts) and _takes_out_power(model)


def _takes_out_power(model: LinearModel) -> bool:
    """Whether damping takes out power at every nodal diameter, and stiffness keeps it.

    Not known where a nodal diameter is not, and of terms of the frequency domain.
    """
    if not model.every_diameter or not (model.extra is None or model.extra.is_real):
        return False
    free, diameters = model.free, np.arange(model.sectors)
    parts = max(math.ceil(diameters.size * free.size**2 / _ENTRIES), 1)
    for n in np.array_split(diameters, parts):
        K, C, _ = (each[:, free][:, :, free] for each in model.at(n, np.ones(n.size, np.bool_)))
        if not np.all(np.abs(K - np.swapaxes(K.conj(), 1, 2)) <= _SAME * _largest(K)):
            return False
        values = np.linalg.eigvalsh(0.5 * (C + np.swapaxes(C.conj(), 1, 2)))  # gyroscopic terms do no work
        if np.any(values < -_SAME * _largest(values)):
            return False
    return True


def _largest(stacked: NDArray[Any]) -> NDArray[Any]:
    """Return the largest size of an entry of each matrix or row, with its axes kept."""
    return np.asarray(np.abs(stacked).max(axis=tuple(range(1, stacked.ndim)), keepdims=True, initial=0.0))


def _joined(scene: Scene, springs: list[tuple[Real, Real]]) -> tuple[Real, Real]:
    """Return the stiffnesses of all ports (n_ports,) and how what is left follows, (n_ports, n_ports)."""
    ends = np.append(0, np.cumsum(scene.port_counts, dtype=np.int64))
    centre, rest = np.zeros(ends[-1]), np.zeros((ends[-1], ends[-1]))
    for i, (own, left) in enumerate(springs):
        place = slice(ends[i], ends[i + 1])
        centre[place], rest[place, place] = own, left
    return centre, rest


def _poles(model: LinearModel, centre: Real) -> tuple[Complex, Complex, Complex] | None:
    """Return poles s, and P v and w of the impulse responses Σ P v e^{st} w; None without such a form."""
    K, C, M = (each[0] for each in model.at(np.zeros(1, np.int64), np.ones(1, np.bool_)))
    n, P = len(M), model.contact_here
    inverse = np.linalg.inv(M)
    generator = np.zeros((2 * n, 2 * n))
    generator[:n, n:] = np.eye(n)
    generator[n:, :n] = -inverse @ (K.real + P.T @ (centre[:, None] * P))
    generator[n:, n:] = -inverse @ C.real
    poles, modes = np.linalg.eig(generator)
    if not np.all(poles.real < 0.0) or np.linalg.cond(modes) > 1e8:
        return None
    inputs = np.linalg.solve(modes, np.vstack([np.zeros((n, len(P))), inverse @ P.T]))
    return poles, P @ modes[:n], inputs


def _gains(model: LinearModel, centre: Real, omega: float) -> Real | None:
    """Return upper bounds of ∫₀ᵀ |g_ij(t)| dt [m/N]."""
    found = _poles(model, centre)
    if found is None:
        return None
    poles, outputs, inputs = found
    period = 2.0 * math.pi / omega
    inputs = inputs / (1.0 - np.exp(poles * period))[:, None]
    step = period / _CELLS
    times = step * (np.arange(_CELLS) + 0.5)
    total = np.zeros((len(outputs), inputs.shape[1]))
    for part in np.array_split(times, 16):
        waves = np.exp(part[:, None] * poles)
        total += np.abs(np.einsum("im,tm,mj->tij", outputs, waves, inputs, optimize=True).real).sum(axis=0)
    steepest = np.abs(outputs) @ (np.abs(poles)[:, None] * np.abs(inputs))
    return np.asarray(step * total + 0.25 * step * period * steepest)


def _largest_gain(model: LinearModel, centre: Real, rest: Real, omega: float) -> float:
    """Return the largest singular value of √Λ H(kω) √Λ over all k, infinite where a bound is not reached."""
    found = _poles(model, centre)
    if found is None:
        return math.inf
    poles, outputs, inputs = found
    root = np.sqrt(np.diag(rest))
    outputs, inputs = root[:, None] * outputs, inputs * root
    fastest, largest = float(np.abs(poles).max()), 0.0
    # Beyond twice the fastest pole |jω − s| grows with ω, and the bound by the parts falls.
    parts = np.linalg.norm(outputs, axis=0) * np.linalg.norm(inputs, axis=1)
    for k in range(_MOST_MULTIPLES):
        s = 1j * k * omega
        beyond = float(np.sum(parts / np.abs(s - poles)))
        if k * omega > 2.0 * fastest and beyond < MARGIN:
            return max(largest, beyond)
        response = (outputs / (s - poles)) @ inputs
        largest = max(largest, float(np.linalg.norm(response, 2)))
        if largest >= MARGIN:
            return largest
    return math.inf


CHEAP = 1.0  # s, forecast, up to which an answer has its multipliers by itself
_STARTS = 8  # of the search for a stable response beside one that is not
# Of that search, how many of its parts run: starts, and branches that are followed both ways.
_PARTS, _UNKNOWNS = 20, 200  # with so many unknowns; with more fewer, by their square
_NO_SOLUTION = "there is no solution"
_LONG = TAKES_LONG + " {}: stability() computes them, --stability for a command"
_BELOW = Verdict(stable=Stable.NOT_KNOWN, ground="the peaks above it are as much as is judged by itself")
_ANOTHER = "; a stable response has half peak to peak {} there"
_NONE_FOUND = "; no stable response was found there"


def of_solution(solution: Solution) -> Verdict:
    """Return whether a solution is stable; of one that is not, name a stable one if it is found."""
    if not solution.converged:
        return Verdict(stable=Stable.NOT_KNOWN, ground=_NO_SOLUTION)
    known = _without_multipliers(solution.scene, solution.frequency_hz)
    if known is not None:
        return known
    from solver.response.stability.floquet import stability

    try:
        found = verdict_of(stability(solution))
    except SettingError as error:
        return Verdict(stable=Stable.NOT_KNOWN, ground=str(error))
    if found.stable is not Stable.NO:
        return found
    return Verdict(stable=found.stable, ground=found.ground + _stable_beside(solution))


def of_peaks(branch: Branch) -> tuple[Verdict, ...]:
    """Return whether the response at each peak of a branch is stable, in the order of `Branch.peaks`.

    As many as together are forecast to cost little are judged, the highest first, and at least one.
    """
    found: list[Verdict] = []
    left = CHEAP
    for peak in branch.peaks:
        scene, hertz = branch.scene_at(peak.at)
        known = _without_multipliers(scene, hertz)
        if known is None:
            left -= forecast(scene, hertz)
            known = _BELOW if found and left < 0.0 else _judged(branch, peak)
        found.append(known)
    return tuple(found)


def _judged(branch: Branch, peak: Peak) -> Verdict:
    """Return what the multipliers say at a peak."""
    from solver.response.stability.floquet import branch_stability

    try:
        return verdict_of(branch_stability(branch, at=[(peak.at, peak.solution)])[0])
    except SettingError as error:
        return Verdict(stable=Stable.NOT_KNOWN, ground=str(error))


def _without_multipliers(scene: Scene, frequency_hz: float) -> Verdict | None:
    """Return what is known of a scene's responses without multipliers; None where they cost little."""
    if monotone(scene, linear_model(scene)):
        return Verdict(stable=Stable.YES, ground=MONOTONE)
    seconds = forecast(scene, frequency_hz)
    if seconds > CHEAP:
        return Verdict(stable=Stable.NOT_KNOWN, ground=_LONG.format(units.duration(seconds)))
    return None


def _stable_beside(solution: Solution) -> str:
    """Return the words for the largest stable response of the same frequency, where it can be searched."""
    if not is_there(f"{LAB}.all_solutions"):
        return ""
    solve_all = from_lab("all_solutions.all_solutions:solve_all")
    unknowns = (2 * solution.n_harmonics + 1) * sum(solution.scene.port_counts)
    parts = iter(range(math.ceil(_PARTS * min((_UNKNOWNS / unknowns) ** 2, 1.0))))
    every = solve_all(
        solution.scene, frequency_hz=solution.frequency_hz, harmonics=solution.n_harmonics, starts=_STARTS,
        on_progress=lambda _share, _count: None, should_stop=lambda: next(parts, None) is None,
    )  # fmt: skip
    stable = [each.solution for each in every.solutions if each.solution.stability.stable is Stable.YES]
    largest = max((each.half_peak_to_peak for each in stable), default=math.nan)
    return _ANOTHER.format(units.length(largest)) if stable else _NONE_FOUND
