"""What a proof costs, and how many random scenes are proved."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import stickslip

SCENES = 100
SIZES = ((2, 1), (5, 2), (10, 4), (20, 8))  # masses, contacts
TRIES = 5


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
            why = "proved" if proof.reached else proof.reason or proof.status.value
            print(f"{masses:3d} {contacts:2d}: {took:8.1f} {balance:8.1f} {proof.events:4d} {why}")
    proved = 0
    for seed in range(SCENES):
        scene, hz = random_scene(seed)
        proved += stickslip.certify(stickslip.solve(scene, frequency_hz=hz, harmonics=21)).reached
    print(f"{proved} of {SCENES} random scenes proved")
