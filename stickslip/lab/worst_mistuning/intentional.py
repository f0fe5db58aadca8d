"""Intentional mistuning: patterns of blade types, repeated round a disk."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.arrays import Real
from solver.errors import SettingError
from stickslip.lab.worst_mistuning.climbing import LARGEST

LETTERS = re.compile(r"[A-Z]+")


@dataclass(frozen=True, slots=True)
class IntentionalMistuning:
    """Patterns of blade types that are compared, and whether random mistuning comes on top of them.

    Attributes
    ----------
    patterns : sequence of str
        A letter for each blade type, repeated round the disk: AB, ABB, AABB.
    detuning : float
        Deviation of the factor of the first type, and negative of the last; others lie evenly between.
    worst_of_patterns : bool
        Find the worst mistuning on top of each pattern too, and rank by that.
    """

    patterns: Sequence[str] = ()
    detuning: float = 0.02
    worst_of_patterns: bool = False

    def check(self, sectors: int, within: float) -> None:
        """Raise SettingError where a pattern does not fit, or a factor with `within` on top may become 0."""
        if self.patterns and not 0.0 <= self.detuning <= LARGEST - within:
            wanted = f"must be a number from 0 to {LARGEST - within:g}, so that factors stay above 0"
            raise SettingError("detuning", self.detuning, wanted)
        for name in self.patterns:
            if not LETTERS.fullmatch(name) or len(name) > sectors:
                wanted = f"must be capital letters, {sectors} at most, such as AB"
                raise SettingError("patterns", name, wanted)

    def deviations(self, sectors: int) -> dict[str, Real]:
        """Return the deviations of the factors of all blades of each pattern, (sectors,)."""
        return {name: pattern_deviations(name, sectors, self.detuning) for name in self.patterns}


def pattern_deviations(pattern: str, sectors: int, detuning: float) -> Real:
    """Return the deviations of the factors of all blades of a pattern, (sectors,).

    The first of its letters in the alphabet is a factor of 1 + detuning, the last 1 − detuning, those between
    lie evenly; the pattern is repeated and cut where the disk ends. Of one letter all are 1 + detuning.
    """
    types = sorted(set(pattern))
    deviations = dict(zip(types, np.linspace(detuning, -detuning, len(types)), strict=True))
    return np.array([deviations[pattern[j % len(pattern)]] for j in range(sectors)])
