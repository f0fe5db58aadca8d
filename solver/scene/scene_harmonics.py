"""Which harmonics a balance keeps: those up to the number asked for, and always those of forces and loads.

A scene whose loads are constant and whose forces have odd harmonics only responds with x(τ + π) = −x(τ) if no
stiffness changes with the motion: even harmonics and mean are zero.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.scene.parameter_paths import FREQUENCY, find_parameter
from solver.scene.scene import Scene
from solver.scene.scene_parameter import SceneParameter

MOST_HARMONICS = 1000
# A force of this harmonic or above is a fast wave of its own: it gets its multiples, as harmonic 1 does.
FAST = 4
MULTIPLES = 5  # of a fast wave; the closed form costs by the highest harmonic
_SIDEBANDS = 2  # harmonics on either side of a fast wave that a slow one makes of it


def kept_harmonics(
    scene: Scene, paths: Iterable[str], highest: int, *, odd: bool, multiples: int = MULTIPLES
) -> Integer:
    """Return the harmonics kept, ascending; more of them for a larger `highest`, never others.

    All up to `highest`; those of every force and of the normal loads, whatever `highest` is, of a load with
    their neighbours; and of a force
    whose harmonic h is 4 or more also its multiples up to 5 h (H h for a smaller `highest` H), and where
    something else drives the structure too h ± 1, h ± 2: friction makes of a fast wave the same multiples as
    of a slow one, and the two together make the sums and differences.

    Parameters
    ----------
    scene : what vibrates.
    paths : parameters that will be changed; a load's amplitude makes the load vary.
    highest : the number of harmonics asked for.
    multiples : most multiples of a fast wave.
    odd : the response is half-wave symmetric: its odd harmonics are enough.
    """
    forced, orders, waves = _forced(scene, _set(scene, paths))
    return _kept(forced, orders, waves, highest, odd, multiples).copy()


@lru_cache(maxsize=64)
def _kept(
    forced: tuple[int, ...], orders: frozenset[int], waves: frozenset[int], highest: int, odd: bool,
    multiples: int,
) -> Integer:  # fmt: skip
    kept = {*range(highest + 1), *forced}
    for k in orders:
        # Friction is the load times the direction of slip: sums and differences with a slow wave.
        kept |= set(range(k - 1, k + 2)) if k > max(highest, 1) else set()
    for h in waves:
        if h < FAST:
            continue
        kept |= {m * h for m in range(1, min(highest, multiples) + 1) if m * h <= MOST_HARMONICS}
        if any(other % h for other in forced):
            reach = min(_SIDEBANDS, max(highest - 1, 0))
            kept |= set(range(h - reach, h + reach + 1))
    chosen = sorted(k for k in kept if not odd or k % 2 == 1)
    return np.array(chosen or [1], dtype=np.int64)


def forced_harmonics(scene: Scene, paths: Iterable[str] = ()) -> tuple[int, ...]:
    """Return the harmonics of the forces and of the normal loads that vary, ascending."""
    return _forced(scene, _set(scene, paths))[0]


def _set(scene: Scene, paths: Iterable[str]) -> list[SceneParameter]:
    """Return what paths are in a scene; the frequency is nothing of it."""
    found = (find_parameter(scene, path) for path in paths if path != FREQUENCY)
    return [each for each in found if each is not None]


def _forced(
    scene: Scene, changed: list[SceneParameter]
) -> tuple[tuple[int, ...], frozenset[int], frozenset[int]]:
    """Return all that are forced, ascending, and those of loads that vary, or would, and of forces."""
    waves = frozenset(force.harmonic for force in scene.forces)
    loads = (contact.load for contact in scene.contacts)
    orders = {order for load in loads if load is not None for order in load.orders}
    orders |= {each.load_order for one in changed for each in one.quantities if each.varies_load}
    found = waves | orders | {scene.observe.harmonic or 0} - {0}
    if orders or any(one.pulls for one in changed):
        found |= {0}
    return tuple(sorted(found)), frozenset(orders), waves


def even_harmonics_reason(scene: Scene, paths: Iterable[str] = ()) -> str | None:
    """Return why even harmonics and the mean are needed, or None if the response has odd harmonics only.

    Parameters
    ----------
    scene : what vibrates.
    paths : parameters that will be changed or differentiated by; a load amplitude breaks the symmetry.
    """
    for contact in scene.contacts:
        reason = contact.answers_unlike or contact.several_responses
        if reason is not None:
            return reason
    for force in scene.forces:
        if force.harmonic % 2 == 0:
            kind = "static" if force.harmonic == 0 else f"of harmonic {force.harmonic}"
            return f"the force on {force.place} is {kind}"
    for path in paths:
        for changed in _set(scene, (path,)):
            if changed.pulls:
                return f"{path} changes a constant force"
            for quantity in changed.quantities:
                if quantity.unlike_half_waves:
                    return f"{path} {quantity.unlike_half_waves}"
    return None


def breaks_symmetry(scene: Scene, paths: Iterable[str] = ()) -> bool:
    """Return whether a motion and its negative half a period later are not answered alike.

    Without that a half-wave symmetric response is always one of the responses, if perhaps not the only one.
    """
    if any(contact.answers_unlike is not None for contact in scene.contacts):
        return True
    if any(force.harmonic % 2 == 0 for force in scene.forces):
        return True
    changed = (each for one in _set(scene, paths) for each in one.quantities)
    return any(quantity.breaks_symmetry for quantity in changed)


def is_fast(scene: Scene, ks: Integer) -> Flags:
    """Return which of the harmonics `ks` are multiples of a fast force's."""
    found = np.zeros(ks.size, np.bool_)
    for h in {force.harmonic for force in scene.forces}:
        if h >= FAST:
            found |= (ks > 0) & (ks % h == 0)
    return found


def spread(coefficients: Real, ks: Integer, wider: Integer) -> Real:
    """Return coefficients (..., n) of the harmonics `ks` among those of `wider`, zero where there is none.

    A harmonic that `wider` lacks is left out.
    """
    size = 2 * wider.size - (wider[0] == 0)
    full = np.zeros((*coefficients.shape[:-1], size))
    here, there = places(ks, wider)
    full[..., there] = coefficients[..., here]
    return full


def among(ks: Integer, wider: Integer) -> Flags:
    """Return which harmonics of `wider` are among `ks`."""
    return _among(ks.tobytes(), wider.tobytes())


@lru_cache(maxsize=64)
def _among(one: bytes, other: bytes) -> Flags:
    found: Flags = np.isin(np.frombuffer(other, np.int64), np.frombuffer(one, np.int64))
    found.flags.writeable = False
    return found


def places(ks: Integer, wider: Integer) -> tuple[Integer, Integer]:
    """Return where the coefficients that two sets of harmonics share stand in each of them."""
    return _places(ks.tobytes(), wider.tobytes())


@lru_cache(maxsize=64)
def _places(one: bytes, other: bytes) -> tuple[Integer, Integer]:
    ks, wider = (_numbers(np.frombuffer(each, np.int64)) for each in (one, other))
    _, here, there = np.intersect1d(ks, wider, assume_unique=True, return_indices=True)
    return here.astype(np.int64), there.astype(np.int64)


def _numbers(ks: Integer) -> Integer:
    """Return where the coefficients of `ks` stand among those of all harmonics, in the order of `fourier`."""
    pairs = np.stack([2 * ks - 1, 2 * ks], axis=1).reshape(-1)
    return pairs[1:] if ks[0] == 0 else pairs


class Amplitudes:
    """Real coefficients of the kept harmonics `ks` as complex amplitudes v̂ = v_c − i v_s."""

    def __init__(self, ks: Integer) -> None:
        self.ks, self._means = ks, int(ks[0] == 0)

    def of(self, coefficients: Real) -> Complex:
        """Return the amplitudes (..., nk) of coefficients (..., n)."""
        means, found = self._means, np.empty((*coefficients.shape[:-1], self.ks.size), np.complex128)
        found[..., :means] = coefficients[..., :means]
        found[..., means:] = coefficients[..., means::2] - 1j * coefficients[..., means + 1 :: 2]
        return found

    def coefficients(self, amplitudes: Complex) -> Real:
        """Return the coefficients (..., n) of amplitudes (..., nk)."""
        means, found = self._means, np.empty((*amplitudes.shape[:-1], 2 * self.ks.size - self._means))
        found[..., :means], later = amplitudes[..., :means].real, amplitudes[..., means:]
        found[..., means::2], found[..., means + 1 :: 2] = later.real, -later.imag
        return found

    def turn(self, tau: float) -> Complex:
        """Return e^{ikτ}, (nk,)."""
        return np.asarray(np.exp(1j * tau * self.ks))
