"""What of a scene is hardly meant: a misplaced unit, a slip of the pen. Notes, each once, never a refusal.

All is judged by the linear structure. Of one with more than `natural_frequencies.LARGE` coordinates only what
needs no modes is looked at.

Every study that names a peak asks here whether it is a maximum or stands at an end of its band. At an end of
the band the response still rises outwards: its height says where the band was cut, not how high a resonance
is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.balance.balance import Kind
from solver.jit.fourier import Real
from solver.linear.assembly import linear_model
from solver.linear.condensation import SINGULAR
from solver.linear.model import Identity, LinearModel
from solver.linear.natural_frequencies import LARGE, Resonances, resonances
from solver.matrices.normal_modes import hermitian, least_stiffness, undamped_modes
from solver.results import units
from solver.results.known import Note
from solver.scene.cyclic.annulus import written_out
from solver.scene.scene import Scene
from solver.wording import listing

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch

FAR = 5.0  # times from the band to the nearest natural frequency: Hz are 2 pi rad/s, N/mm 1000 N/m
ROUGH = 1.5  # friction coefficient above what dry contacts have
OVERDAMPED, UNDAMPED = 0.5, 1e-9  # damping ratios: hardly a resonance above, rounding below
STIFF = 1e4  # times the structure's stiffness at a contact: no longer told from rigid
SOUND = 5000.0  # speed of sound in a bar of metal [m/s]
_DRIVEN = 1e-9  # share of the largest static response from which a mode is driven and observed

BAND_END = "band_end"
_SAME = 1e-9  # relative distance from an end within which a frequency is that end


def plausibility(scene: Scene) -> tuple[Note, ...]:
    """Return what of a scene is hardly meant, a note of each kind at most; of a plausible one none."""
    return _plausibility(Identity(scene))


@lru_cache(maxsize=4)
def _plausibility(of: Identity[Scene]) -> tuple[Note, ...]:
    scene = of.it
    found = [*_at_rest(scene), *_rough(scene)]
    model = linear_model(scene)
    if model.n_coordinates <= LARGE:
        linear = resonances(scene)
        found += [] if linear is None else _far(scene, linear)
        if model.extra is None and model.line is None and not model.prescribed:
            structure = _Structure.of(written_out(scene), model)
            found += [] if structure is None else [*structure.notes()]
    return tuple(found)


def _at_rest(scene: Scene) -> Iterator[Note]:
    moving = [force.amplitude for force in scene.excitation if force.harmonic > 0]
    if moving and not any(moving) and scene.speed_order is None:
        words = "the amplitude of the excitation is 0: nothing moves but by what else changes with time"
        yield Note(name="amplitude_zero", words=words, numbers={"amplitude": 0.0})


def _rough(scene: Scene) -> Iterator[Note]:
    every = {one.name: one.friction.mu for one in scene.contacts if one.friction is not None}
    above = {name: mu for name, mu in every.items() if mu > ROUGH}
    if above:
        said = listing([f"{name} {units.number(mu)}" for name, mu in above.items()])
        words = f"a friction coefficient above {ROUGH:g} is more than dry contacts have: {said}"
        yield Note(name="friction", words=words, numbers=above)


def _far(scene: Scene, found: Resonances) -> Iterator[Note]:
    """A band far from all natural frequencies, wherever friction moves these between open and stuck."""
    low, high = scene.observe.band
    every = np.concatenate(found)
    # From the highest down: what moves as a rigid body is missing among those that are open.
    pairs = zip(found.open_hz[::-1], found.stuck_hz[::-1], strict=False)
    if not every.size or any(free <= high and stuck >= low for free, stuck in pairs):
        return
    away = np.maximum(low / every, every / high)
    at, times = float(every[away.argmin()]), float(away.min())
    if times > FAR:
        side = (
            f"above its end, {units.hertz(high)}" if at > high else f"below its beginning, {units.hertz(low)}"
        )
        words = (
            f"the natural frequency nearest to the band is {units.hertz(at)}, a factor of "
            f"{units.number(times, 3)} {side}: are masses in kg, stiffnesses in N/m and the band in Hz?"
        )
        yield Note(name="far_from_band", words=words, numbers={"natural_hz": at, "times": times})


class _Structure(NamedTuple):
    """The linear structure as it is judged: with all contacts open, or stuck where they alone hold it."""

    scene: Scene
    model: LinearModel
    K: NDArray[Any]
    C: NDArray[Any]
    ports: NDArray[Any]
    alone: bool
    force: NDArray[Any]
    omega: Real
    phi: NDArray[Any]

    @classmethod
    def of(cls, scene: Scene, model: LinearModel) -> _Structure | None:
        """Return it; None where nothing holds it, or nothing excites it."""
        wave = min((term.harmonic for term in model.forces if term.harmonic > 0), default=0)
        if wave == 0:
            return None
        k = np.full(1, wave, np.int64)
        diameters = model.diameters(k)
        (K,), (C,), (M,) = model.at(diameters, k > 0)
        (L,) = model.ports_at(diameters)
        alone = least_stiffness(K) > SINGULAR
        if not alone:
            own = np.array([stiffness for one in scene.contacts for stiffness in one.stiffnesses])
            K = K + L.conj().T @ (np.where(np.isfinite(own), own, 0.0)[:, None] * L)
            if not least_stiffness(K) > SINGULAR:
                return None
        modes = undamped_modes(hermitian(K), hermitian(M))
        parts = [np.asarray(term.amplitude * term.vector) for term in model.forces if term.harmonic == wave]
        return cls(
            scene, model, K, C, L, alone, np.asarray(sum(parts)), np.sqrt(np.maximum(modes.omega2, 0.0)),
            modes.phi,
        )  # fmt: skip

    def notes(self) -> Iterator[Note]:
        """What is hardly meant of it."""
        yield from self._damping()
        yield from self._deflection()
        if self.alone:
            yield from self._stiff()

    def _damping(self) -> Iterator[Note]:
        """Of the mode that moves the observed DOF most, of those in the band or nearest to it."""
        low, high = self.scene.observe.band
        hertz = self.omega / (2.0 * math.pi)
        moved = np.abs(self.model.observe @ self.phi) * np.abs(self.phi.conj().T @ self.force) / self.omega**2
        if not moved.max(initial=0.0) > 0.0:
            return
        away = np.maximum(np.maximum(low / hertz, hertz / high), 1.0)
        away[moved < _DRIVEN * moved.max()] = np.inf
        near = np.flatnonzero(away <= away.min())
        i = int(near[moved[near].argmax()])
        shape = self.phi[:, i]
        ratio = float((shape.conj() @ self.C @ shape).real) / (2.0 * float(self.omega[i]))
        mode = f"the observed mode at {units.hertz(float(hertz[i]))}"
        numbers = {"natural_hz": float(hertz[i]), "damping_ratio": ratio}
        if ratio > OVERDAMPED:
            words = f"{mode} has a damping ratio of {units.number(ratio, 3)}: are dashpots in N s/m?"
            yield Note(name="damping", words=words, numbers=numbers)
        elif abs(ratio) < UNDAMPED:
            words = f"nothing but contacts damps {mode}: what bounds its resonance where they do not slip?"
            yield Note(name="damping", words=words, numbers=numbers)

    def _deflection(self) -> Iterator[Note]:
        """Of the loads at rest, beside the nodes' distance or the longest bar with this first frequency."""
        still = [np.asarray(term.amplitude * term.vector) for term in self.model.forces if term.harmonic == 0]
        size = np.abs(self.model.shapes @ np.linalg.solve(self.K, self.force))
        if still:
            size = size + np.abs(self.model.shapes @ np.linalg.solve(self.K, np.asarray(sum(still))))
        i, places = int(size.argmax()), [np.array(node.at) for node in self.scene.nodes]
        apart = max((float(np.linalg.norm(a - b)) for a, b in combinations(places, 2)), default=0.0)
        longest = apart or SOUND * math.pi / (2.0 * float(self.omega.min()))
        if size[i] > longest:
            than = "the nodes are apart" if apart else "a bar of metal with that first frequency is long"
            words = (
                f"the loads bend {self.model.dofs[i]} by {units.length(float(size[i]))} at rest, more than "
                f"{than}, {units.length(longest)}: are loads in N and stiffnesses in N/m?"
            )
            yield Note(
                name="static_deflection", words=words,
                numbers={"deflection_m": float(size[i]), "longest_m": longest},
            )  # fmt: skip

    def _stiff(self) -> Iterator[Note]:
        """Of contacts beside the structure's static stiffness at their places, all others open."""
        flexible = np.einsum("pn,np->p", self.ports, np.linalg.solve(self.K, self.ports.conj().T)).real
        names = [one.name for one in self.scene.contacts for _ in one.stiffnesses]
        own = np.array([stiffness for one in self.scene.contacts for stiffness in one.stiffnesses])
        above: dict[str, float] = {}
        for name, times in zip(names, np.where(np.isfinite(own), own, 0.0) * flexible, strict=True):
            if times > STIFF:
                above[name] = max(float(times), above.get(name, 0.0))
        if above:
            said = listing([f"{name} {units.number(times, 3)} times" for name, times in above.items()])
            words = (
                f"a contact is more than {STIFF:g} times as stiff as the structure at its place: {said}. Is "
                "its stiffness in N/m?"
            )
            yield Note(name="stiff_contact", words=words, numbers=above)


def is_band_end(branch: AnyBranch) -> bool:
    """Whether the highest amplitude over a frequency is at an end of the range, and no maximum."""
    peak = branch.peak
    if peak is None or peak.interior or branch.posed.parameter.kind is not Kind.FREQUENCY:
        return False
    return _at_end(peak.at, (branch.start, branch.stop))


def band_end_of(branch: AnyBranch) -> tuple[Note, ...]:
    """Return the note of a branch whose highest amplitude is at an end of its band; else none."""
    if branch.peak is None or not is_band_end(branch):
        return ()
    return band_end_at(branch.scene, branch.peak.at, (branch.start, branch.stop))


def band_end_at(scene: Scene, at_hz: float, band: tuple[float, float]) -> tuple[Note, ...]:
    """Return the note of a highest amplitude of which no more is known than its place; none inside the band.

    Parameters
    ----------
    scene : what vibrates.
    at_hz : where the highest amplitude over the band is [Hz].
    band : ends of the band looked at [Hz].
    """
    if not _at_end(at_hz, band):
        return ()
    low, high = sorted(band)
    numbers = {"at_hz": at_hz}
    found = resonances(scene)
    if found is not None:
        for name, each in (("open_hz", found.open_hz), ("stuck_hz", found.stuck_hz)):
            outside = each[(each < low) | (each > high)]
            if outside.size:
                numbers[name] = nearest(outside, low, high)
    words = (
        f"the highest amplitude is at an end of the band, {units.hertz(at_hz)}, and no maximum"
        f"{_outside(numbers) if found is not None else ''}"
    )
    return (Note(name=BAND_END, words=words, numbers=numbers),)


def nearest(frequencies: Real, low: float, high: float) -> float:
    """Return which of some frequencies is nearest to a band, in Hz."""
    return float(min(frequencies.tolist(), key=lambda each: max(low - each, each - high)))


def _at_end(at_hz: float, band: tuple[float, float]) -> bool:
    return any(abs(at_hz - end) <= _SAME * abs(end) for end in band)


def _outside(numbers: dict[str, float]) -> str:
    """Where the nearest linear resonances are."""
    told = [
        f"{units.hertz(numbers[name])} with all contacts {words}"
        for name, words in (("open_hz", "open"), ("stuck_hz", "stuck"))
        if name in numbers
    ]
    if not told:
        return "; no linear resonance lies outside it"
    if numbers.get("open_hz") == numbers.get("stuck_hz"):
        told = [units.hertz(numbers["open_hz"])]
    return f"; the nearest linear resonance outside it is {' or '.join(told)}"
