"""A contact whose law is given by functions of the motion and its history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from solver.contacts.fields import LEAST_SAMPLES, Real, Samples
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_law import AnyContact, RateContact
from solver.contacts.laws.contact_parts import Follows, RestStiffness, Row
from solver.contacts.laws.history.definition import HistoryLaw
from solver.errors import SettingError

NODES_A_HARMONIC, BETWEEN_REVERSALS = 32, 16
_SMALL = 1e-9  # m; the motion whose force tells the stiffness at rest
_FORM = {"steps": 1, "reversals": 2, "alone": 4}  # bits of `solver.contacts.kernels.history.history_law`


class HistoryContact(RateContact):
    """A law given by functions of the motion and its history."""

    DEFINITION: ClassVar[HistoryLaw]
    KERNEL: ClassVar[str] = "solver.contacts.kernels.history.history_law:history_law"
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.KT),)
    WORDS: ClassVar[Mapping[str, str]] = {}

    samples: Annotated[
        Samples | None,
        "Nodes of a period at which the law is followed; 32 for each harmonic if left out, or 16 where "
        "they begin anew at every reversal.",
    ] = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Be sent to another process by the word of its law: the class is made there as it was here."""
        return _of_law, (self.LAW,), self.__getstate__()

    @classmethod
    def prepare(cls) -> None:
        """Compile the functions of the law."""
        from solver.contacts.laws.history.functions import ready

        ready(cls.DEFINITION)

    @property
    def numbers(self) -> Real:
        """Its parameters as its functions take them, (MOST_OWN,)."""
        found = np.zeros(columns.MOST_OWN)
        for i, key in enumerate(self.DEFINITION.parameters):
            found[i] = getattr(self, key)
        return found

    @property
    def stiffness(self) -> float:
        """Its stiffness at rest, of a small motion from where nothing has happened [N/m]; 0 if it is none."""
        return self._slope_at_rest(_SMALL, 1.0, 1.0)

    @property
    def damping(self) -> float:
        """Its damping at rest, of a small velocity where nothing has happened [N s/m]; 0 if it is none."""
        return self._slope_at_rest(0.0, 0.0, _SMALL)

    def _slope_at_rest(self, u: float, v: float, after: float) -> float:
        """Return the slope of the force over a motion `u`, or a velocity that goes from `v` to `after`."""
        law, p = self.DEFINITION, self.numbers
        plain = {place: getattr(one, "py_func", one) for place, one in law.functions.items()}
        state, moved = np.zeros(law.states), np.zeros(law.states)
        with np.errstate(all="ignore"):
            if "step" in plain:
                here = plain["step"](0.0, v, 0.0, _SMALL, state, moved, p)
                there = plain["step"](u, after, u, _SMALL, state, moved, p)
            else:
                if "rate" in plain:
                    plain["rate"](0.0, after, state, p, moved)
                here = plain["force"](0.0, v, state, p)
                there = plain["force"](u, after, state + u / after * moved, p)
        found = (float(there) - float(here)) / _SMALL
        return found if math.isfinite(found) and found > 0.0 else 0.0

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.stiffness,)

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table, with the nodes for harmonics up to `highest`."""
        from solver.contacts.laws.history.functions import WAYS, ready

        super().fill(row, highest)
        law, found = self.DEFINITION, ready(self.DEFINITION)
        row[columns.KT] = self.stiffness
        row[columns.NODES] = self.nodes(highest)
        row[columns.HISTORY_LAW], row[columns.HISTORY_STATES] = found.number, law.states
        bits = {"steps": law.step is not None, "reversals": law.reversals, "alone": law.independent}
        row[columns.HISTORY_FORM] = sum(_FORM[name] for name, has in bits.items() if has)
        row[columns.HISTORY_WAY] = WAYS[found.derivatives]

    def nodes(self, highest: int) -> int:
        """Return the nodes of a period for harmonics up to `highest`: at least four of the shortest wave."""
        given = self.samples or self.DEFINITION.samples
        return max(given, 4 * highest) if given else max(self._nodes_a_harmonic * highest, 2 * LEAST_SAMPLES)

    @property
    def _nodes_a_harmonic(self) -> int:
        return BETWEEN_REVERSALS if self.DEFINITION.reversals else NODES_A_HARMONIC

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        moved = super().with_numbers(row)
        if self.samples is None:
            return moved
        return moved.model_copy(update={"samples": int(row[columns.NODES])})

    @property
    def answers_unlike(self) -> str | None:
        """Why it answers a motion and its negative half a period later differently, or None."""
        return None if self.DEFINITION.odd else f"the law of {self.name} is not said to be odd"

    @property
    def several_responses(self) -> str | None:
        """Why a half-wave symmetric response need not be the only one, or None."""
        if self.DEFINITION.monotone:
            return None
        return f"the law of {self.name} is not said to keep motions together, so others are possible"

    @property
    def keeps_together(self) -> bool:
        """Whether it never lets two motions under the same forces move apart."""
        return self.DEFINITION.monotone

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        from solver.contacts.laws.history.functions import ready

        law, found = self.DEFINITION, ready(self.DEFINITION)
        given = self.samples or law.samples
        nodes = f"{given} nodes" if given else f"{self._nodes_a_harmonic} nodes a harmonic"
        between = " between its reversals" if law.reversals else ""
        slow = "" if found.compiled else "; its functions are called as Python, which is slow"
        return f"the law {law.name} followed over {nodes}{between}, {found.derivatives.value}{slow}"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`, evenly spaced from 0.

        Raises
        ------
        SettingError
            The frequency is not known (`at_frequency`), or the law gives no finite force that repeats.
        """
        from solver.contacts.kernels.history.history_law import history_forces
        from solver.jit import fourier

        del load
        row, highest = np.zeros(columns.COLUMNS), (motions.shape[1] - 1) // 2
        self.fill(row, highest)
        row[columns.OMEGA] = self.omega
        finer = max(1, math.ceil(4 * self.nodes(highest) / tau.size))
        force = np.empty(finer * tau.size)
        if not history_forces(motions[0], fourier.all_harmonics(highest), row, force.size, force):
            raise SettingError("contact", self.name, "must have a law whose force is finite and repeats")
        return force[::finer]

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march, which follows the same functions in its own steps."""
        from solver.contacts.laws.history.functions import ready

        law = self.DEFINITION
        return (
            Row(
                name=self.name, follows=Follows.HISTORY, kt=self.stiffness, history=ready(law).number,
                in_steps=law.step is not None, states=law.states, damping=self.damping,
                numbers=tuple(self.numbers.tolist()),
            ),
        )  # fmt: skip


def _of_law(word: str) -> AnyContact:
    """A contact of a law, as yet without numbers."""
    from solver.contacts.laws.law_registry import laws

    law = laws()[word]
    return law.__new__(law)
