"""What an amplitude is of: the one place where a measure gets its name, its word and its unit.

Axes, tables, reports, notebooks, the command and the page take them from here, the page from the JSON.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from solver.results import units
from solver.results.told import Piece

MAX_ABS, HALF_PEAK_TO_PEAK = "max_abs", "half_peak_to_peak"
WORDS: Mapping[str, str] = MappingProxyType(
    {MAX_ABS: "max|x|", HALF_PEAK_TO_PEAK: "half peak to peak", "mean": "mean"}
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Measured(Piece):
    """What the amplitudes, peaks and limits of a result are of."""

    JSON: ClassVar = "name dof measure harmonic unit"

    dof: Annotated[str, "The DOF, or the recovered sum, that is observed; ``x`` if it is not known."] = "x"
    measure: Annotated[str, "``max_abs`` or ``half_peak_to_peak``."] = MAX_ABS
    harmonic: Annotated[int | None, "The harmonic that is measured alone; None: the whole motion."] = None
    unit: Annotated[str, "Unit of it: m, or that of a recovered sum."] = "m"

    @classmethod
    def of_result(cls, found: Mapping[str, Any]) -> Measured:
        """Return what the JSON of a result says; of one of an earlier version the DOF, if it is there."""
        known = found.get("measured") or {"dof": found.get("dof", "x")}
        return cls(**{key: value for key, value in known.items() if key != "name"})

    @property
    def subject(self) -> str:
        """The DOF, or one harmonic of it."""
        return self.dof if self.harmonic is None else f"harmonic {self.harmonic} of {self.dof}"

    @property
    def name(self) -> str:
        """It with what it is of, as on an axis."""
        return f"max |{self.subject}|" if self.measure == MAX_ABS else f"{self.word} of {self.subject}"

    @property
    def word(self) -> str:
        """The measure alone."""
        return WORDS[self.measure]

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """What texts say of it: nothing of max|x| of the whole motion."""
        plain = self.measure == MAX_ABS and self.harmonic is None
        return [] if plain else [("amplitudes", self.name)]

    def unit_for(self, largest: float) -> units.LengthUnit:
        """The unit in which `largest` is drawn."""
        return units.length_unit(largest) if self.unit == "m" else units.LengthUnit(self.unit, 1.0)

    def label(self, what: str, unit: units.LengthUnit) -> str:
        """The name of an axis: `what` stands on it, such as ``amplitude``."""
        return f"{what}, {self.name} [{unit.name}]" if what else f"{self.name} [{unit.name}]"


OF_X = Measured()
"""Of what is not known more than that it is max|x|."""
