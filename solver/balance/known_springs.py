"""The contacts at solutions of a walk as springs, kept for who looks at these solutions again."""

from __future__ import annotations

import numpy as np

from solver.balance.parameter import Kind
from solver.contacts.kernels.system import System
from solver.jit.fourier import Complex, Real

MOST_ENTRIES = 1_000_000  # 16 MB; beyond, they are worked out anew


class KnownSprings:
    """ĝ at solutions, see `solver.balance.kernels.linearised_contacts.fill_springs`; by the bits of these.

    They are kept where forces are dear, and over the frequency alone, where resonances are looked for.
    """

    def __init__(self, system: System, kind: Kind) -> None:
        self._shape = system.ks.size, int(system.first_block[-1])
        self._wanted = kind is Kind.FREQUENCY and bool(system.alone.any())
        self._known: dict[bytes, Complex] = {}

    def rows(self, count: int) -> Complex:
        """Return empty rows for `count` solutions; none where they are not kept."""
        full = (len(self._known) + count) * self._shape[0] * self._shape[1] > MOST_ENTRIES
        return np.empty((0 if full or not self._wanted else count, *self._shape), np.complex128)

    def keep(self, solutions: Real, springs: Complex) -> None:
        """Keep the springs (at least P, or no row) of solutions (P, nt + 1), λ last."""
        if len(springs):
            self._known |= {row.tobytes(): one for row, one in zip(solutions, springs, strict=False)}

    def of(self, solutions: Real) -> list[Complex | None]:
        """Return the springs (nk, blocks) of solutions (P, nt + 1), None where they are not known."""
        return [self._known.get(row.tobytes()) for row in solutions]
