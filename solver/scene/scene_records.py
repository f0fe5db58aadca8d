"""The parts of a scene: structure, contacts, excitation, what to observe. Frozen, checked, SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, ClassVar, Literal, Self, cast

from pydantic import Discriminator, Field, GetCoreSchemaHandler, Tag, field_validator, model_validator
from pydantic_core import CoreSchema, core_schema

from solver.contacts.fields import (
    DofName,
    Element,
    MemberName,
    Name,
    NonNegative,
    Part,
    Positive,
    Signed,
    Vector,
)
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.errors import SettingError
from solver.results.known import HALF_PEAK_TO_PEAK
from solver.scene.cyclic.sector_tables import CyclicBoundary as CyclicBoundary
from solver.scene.cyclic.sector_tables import Mistuning as Mistuning
from solver.scene.cyclic.sector_tables import Sectors
from solver.scene.excitation import Excitation as Excitation
from solver.scene.excitation import Shares
from solver.scene.matrices_structure import LossFactor, Ratios
from solver.scene.matrices_structure import MatricesStructure as MatricesStructure
from solver.scene.matrices_structure import Reduction as Reduction


class _Grouped(Part):
    """A part whose value may be set together with others'."""

    name: Annotated[MemberName | None, "Makes it a parameter ``structure.<name>``."] = None
    group: Annotated[Name | None, "Makes the value of the whole group a parameter ``structure.<group>``."] = (
        None
    )
    factor: Annotated[Positive | None, "The part's value as a multiple of its group's; 1 if left out."] = None

    @model_validator(mode="after")
    def _factor_of_a_group(self) -> Self:
        if self.factor is not None and self.group is None:
            raise ValueError(
                f"`factor` = {self.factor!r} needs a `group`: it is relative to the group's value"
            )
        return self


class Mass(_Grouped):
    """A point mass: one degree of freedom."""

    dof: Annotated[str, "The degree of freedom it makes."]
    m: Annotated[Positive, "Mass [kg]."]


class Spring(Element, _Grouped):
    """A spring, with an optional dashpot beside it: `k` [N/m], `c` [N s/m]."""

    k: NonNegative
    c: NonNegative = 0.0


class Damper(Element, _Grouped):
    """A dashpot: `c` [N s/m]."""

    c: NonNegative


class MassEntry(_Grouped):
    """A mass as a scene file gives it: a number, or a table with `m`, `name`, `group` and `factor`."""

    m: Positive

    @model_validator(mode="before")
    @classmethod
    def _number_is_mass(cls, data: object) -> object:
        return data if isinstance(data, dict) else {"m": data}


class _MassTable:
    """Reads a table ``{dof: mass}`` into a tuple of `Mass`, and writes it back as a table."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        table = handler.generate_schema(Annotated[dict[MemberName, MassEntry], Field(min_length=1)])
        masses = core_schema.no_info_after_validator_function(cls._read, table)
        write = core_schema.plain_serializer_function_ser_schema(cls._write)
        return core_schema.no_info_before_validator_function(cls._as_table, masses, serialization=write)

    @classmethod
    def _as_table(cls, data: object) -> object:
        ready = isinstance(data, tuple) and all(isinstance(mass, Mass) for mass in data)
        return cls._write(cast(tuple[Mass, ...], data)) if ready else data

    @staticmethod
    def _read(table: dict[str, MassEntry]) -> tuple[Mass, ...]:
        return tuple(Mass.model_construct(dof=dof, **entry.__dict__) for dof, entry in table.items())

    @staticmethod
    def _write(masses: tuple[Mass, ...]) -> dict[str, object]:
        tables = {mass.dof: mass.model_dump(exclude={"dof"}, exclude_none=True) for mass in masses}
        return {dof: table["m"] if len(table) == 1 else table for dof, table in tables.items()}


class _Structure(Part):
    """Masses, springs and dashpots."""

    stiffness_proportional_damping: NonNegative = 0.0
    loss_factor: Annotated[
        LossFactor, "Structural damping: the stiffness is K (1 + i loss_factor) at every frequency above 0."
    ] = 0.0
    masses: Annotated[tuple[Mass, ...], _MassTable]
    springs: tuple[Spring, ...] = ()
    dampers: tuple[Damper, ...] = ()

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, in the order of the masses."""
        return tuple(mass.dof for mass in self.masses)


class LumpedStructure(_Structure):
    """A structure of point masses."""

    has_sectors: ClassVar[bool] = False
    sector_count: ClassVar[int] = 1

    kind: Literal["lumped"]
    damping_ratio: Annotated[
        Ratios | None,
        "Damping ratio of every mode, or of each from the lowest on (the last one also of those above), "
        "added to the rest; bodies have none.",
    ] = None


class CyclicStructure(_Structure):
    """One sector of a disk of `sectors` sectors; ``X@next`` is DOF X of the next one.

    The sectors are equal but for `mistuning`.
    """

    has_sectors: ClassVar[bool] = True

    kind: Literal["cyclic"]
    sectors: Sectors
    mistuning: Mistuning | None = None
    axis: Annotated[
        Vector | None,
        "Direction of the axis the sectors are turned about, through the origin of all positions; needed "
        "where contacts with a position reach into the next sector, which is turned by 2 pi / sectors.",
    ] = None

    @property
    def sector_count(self) -> int:
        """Number of sectors."""
        return self.sectors


Structure = LumpedStructure | CyclicStructure | MatricesStructure
KINDS: tuple[str, ...] = ("lumped", "cyclic", "matrices")


class Observe(Part):
    """The observed DOF and the frequency band of interest [Hz].

    ``tip@3`` in a cyclic scene is the tip of sector 3, ``tip`` that of sector 0.
    """

    dof: Annotated[DofName, 'The DOF whose amplitude counts; "tip@3" is the tip of sector 3.']
    relative: Annotated[bool, "Where a base moves: the motion relative to it, not the absolute one."] = False
    measure: Annotated[
        Literal["max_abs", "half_peak_to_peak"],
        "What amplitudes, peaks and limits are of: max|x|, or (max x − min x)/2, which does not depend on "
        "the mean.",
    ] = "max_abs"
    harmonic: Annotated[
        Annotated[int, Field(strict=True, ge=1, le=1000)] | None,
        "Measure this harmonic of the motion alone: amplitudes, peaks and limits are then of it; a peak of "
        "a harmonic above the excitation's is a superharmonic resonance.",
    ] = None
    band: Annotated[tuple[Positive, Positive], "Frequencies of interest [low, high] [Hz]."]

    def check_whole(self, study: str) -> None:
        """Raise SettingError where one harmonic alone is measured: `study` is of the whole motion."""
        if self.harmonic is not None:
            wanted = f"must be left out: {study} is of the whole motion"
            raise SettingError("observe.harmonic", self.harmonic, wanted)

    @property
    def centred(self) -> bool:
        """Whether the motion counts from the middle of its range."""
        return self.measure == HALF_PEAK_TO_PEAK

    @field_validator("band")
    @classmethod
    def _ordered(cls, band: tuple[float, float]) -> tuple[float, float]:
        low, high = band
        if not low < high or not math.isfinite(high - low):
            raise ValueError(f"`band` must be [low, high] in Hz with low < high, got [{low!r}, {high!r}]")
        return band


class Recovered(Part):
    """A row of a recovery matrix: a quantity that may be observed like a DOF."""

    name: Annotated[MemberName, "What `observe` and time histories call it."]
    unit: Annotated[
        str, Field(min_length=1, max_length=20), "Its unit, for example MPa; amplitudes are in it."
    ]
    terms: Annotated[Shares, "DOF to its factor [unit/m]; in a scene file also the name of a CSV file."]
    static: Annotated[
        Signed | None,
        "What it is without the motion, by speed and preload: the mean stress of margins [unit].",
    ] = None
    material: Annotated[Name | None, "One of `materials`, for the margin of a stress."] = None


LAW_TAG = "law "  # begins the tags of the union: no key of a contact has a space


def _law_of(data: object) -> str:
    """The tag of a contact's law: of a table or of a contact already read."""
    law = data.get("law") if isinstance(data, Mapping) else getattr(data, "law", None)
    return LAW_TAG + (DEFAULT if law is None else str(law))


class _OfAnyLaw:
    """The union of the classes of all laws there are when the schema of the scene is made."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        members: list[Any] = [Annotated[law, Tag(LAW_TAG + word)] for word, law in laws().items()]
        union = Annotated[reduce(or_, members), Discriminator(_law_of)]  # type: ignore[valid-type]
        return handler.generate_schema(union)


ContactOfAnyLaw = Annotated[AnyContact, _OfAnyLaw]
