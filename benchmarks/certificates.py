"""What a proof costs, and how many random scenes are proved."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import stickslip

SCENES, SECONDS = 500, 1500.0  # looked at, in processor time at most
SIZES = ((2, 1), (5, 2), (10, 4), (20, 8))  # masses, contacts
TRIES = 5
NARROW = 1e-15


def certificates() -> None:
    """Proofs of responses: processor time by size, and the share of random scenes."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "cases"))
    from certified_scenes import random_scene

    print("masses, contacts: processor time of a proof (ms), of the balance, events")
    for masses, contacts in SIZES:
        for seed in range(TRIES):
            scene, hz = random_scene(seed, masses, contacts)
            begun = time.process_time()
            found = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
            solved = time.process_time()
            proof = stickslip.certify(found)
            took, balance = 1e3 * (time.process_time() - solved), 1e3 * (solved - begun)
            print(f"{masses:3d} {contacts:2d}: {took:8.1f} {balance:8.1f} {proof.events:4d} {_why(proof)}")
    begun, proved, seen, costs = time.process_time(), 0, 0, []
    for seed in range(SCENES):
        scene, hz = random_scene(seed)
        found = stickslip.solve(scene, frequency_hz=hz, harmonics=21)
        started = time.process_time()
        why = _why(stickslip.certify(found)) if found.converged else found.status.value
        costs.append(time.process_time() - started)
        seen, proved = seen + 1, proved + (why == "proved")
        if why != "proved":
            print(f"scene {seed}: {len(scene.contacts)} contacts, {hz:.4g} Hz: {why}", flush=True)
        if time.process_time() - begun > SECONDS:
            print(f"ended after {SECONDS:.0f} s")
            break
    costs.sort()
    print(f"{proved} of {seen} random scenes proved ({100.0 * proved / seen:.1f} %), seconds of a proof: "
          f"median {costs[len(costs) // 2]:.3f}, most {costs[-1]:.1f}")  # fmt: skip


def _why(proof: stickslip.Certificate) -> str:
    """Return why a response is not proved."""
    low, high = proof.half_peak_to_peak
    if proof.reached and high - low > NARROW * high:
        return f"the enclosure is {(high - low) / high:.1e} wide"
    return "proved" if proof.reached else proof.reason or proof.status.value
