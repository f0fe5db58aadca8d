"""Which harmonics a balance keeps: those up to the number asked for, and always those of forces and loads."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

from solver.jit.fourier import Flags, Integer, Real
from solver.scene.parameter_paths import changed_quantities, changes_loads
from solver.scene.scene import Scene

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
    orders, waves = load_orders(scene, paths), frozenset(force.harmonic for force in scene.forces)
    forced = _forced(scene, paths, orders, waves)
    return _kept(forced, frozenset(orders), waves, highest, odd, multiples).copy()


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
    waves = frozenset(force.harmonic for force in scene.forces)
    return _forced(scene, paths, load_orders(scene, paths), waves)


def _forced(scene: Scene, paths: Iterable[str], orders: set[int], waves: frozenset[int]) -> tuple[int, ...]:
    found = waves | orders | {scene.observe.harmonic or 0} - {0}
    if orders or any(changes_loads(scene, path) for path in paths):
        found |= {0}
    return tuple(sorted(found))


def load_orders(scene: Scene, paths: Iterable[str] = ()) -> set[int]:
    """Return the harmonics of the normal loads that vary, or would along the paths."""
    loads = (contact.load for contact in scene.contacts)
    found = {order for load in loads if load is not None for order in load.orders}
    changed = (quantity for path in paths for quantity in changed_quantities(scene, path))
    return found | {quantity.load_order for quantity in changed if quantity.varies_load}


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
