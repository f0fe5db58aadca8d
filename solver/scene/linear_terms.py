"""What a structure has beside masses, springs and dashpots: linear terms, and what depends on its speed.

Couplings that are not symmetric, gyroscopic, of the gas: all of them are entries of K and C. The equation of
the DOF `on` gains (k + i k_imaginary) x + c x' of the DOF `of`, here or some sectors further on. A nodal
diameter sees Σ X_m e^{jmθ} of entries at the offsets m.

Normal loads and forces may follow the speed. Along an engine-order line the speed follows the frequency,
speed [1/min] = 60 f / order, so that a sweep over the frequency is one over the speed; `Scene.at_frequency`
is the scene at one point of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, GetCoreSchemaHandler, Tag, model_validator
from pydantic_core import CoreSchema

from solver.contacts.fields import DofName, MemberName, Name, NonNegative, Part, Positive, Signed
from solver.extensions import Kinds
from solver.matrices.values import ByContent, Matrix, differs

if TYPE_CHECKING:
    from solver.scene.scene_records import Structure

Offset = Annotated[int, Field(strict=True, ge=-10_000, le=10_000)]
_ROUNDING = 1e-14  # of the largest coefficient: less is what a Fourier transform leaves


@dataclass(frozen=True, slots=True, eq=False)
class Along(ByContent):
    """A sum of DOFs, or of the rows of a structure's matrices, as what an entry acts on."""

    factors: Annotated[NDArray[np.float64], "Read-only, (n,)."]
    dofs: Annotated[tuple[str, ...] | None, "Their DOFs; None: the rows of the matrices."] = None
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        self._hold({"factors": self.factors}, self.dofs)


End = str | Along


def dofs_at(end: End) -> tuple[str, ...]:
    """The DOFs that an end of an entry names."""
    return (end,) if isinstance(end, str) else end.dofs or ()


class Entry(NamedTuple):
    """One entry of K and C between two DOFs, or sums of them.

    Attributes
    ----------
    on, of : row and column.
    offset : the column is of the sector so many ahead.
    k : complex stiffness [N/m]; its imaginary part is of a motion e^{iωt}, ω > 0, and has no static share.
    c : damping [N s/m].
    g : damping per speed of rotation [N s/m per rad/s].
    k_omega2 : stiffness per squared speed [N/m per (rad/s)²].
    """

    on: End
    of: End
    offset: int
    k: complex
    c: complex
    g: float
    k_omega2: float

    @property
    def turns(self) -> bool:
        """Whether it depends on the speed of rotation."""
        return self.g != 0.0 or self.k_omega2 != 0.0


class LinearTerm(Part, ABC):
    """What adds entries to K and C."""

    KIND: ClassVar[str] = ""
    """Its `kind` in ``[[couplings]]``; one from outside has a field `kind` of that word."""
    DOFS: ClassVar[tuple[str, ...]] = ()
    """Its fields that name a DOF, or several; `of` is of the sector `offset` ahead, where it has that."""
    TURNING: ClassVar[tuple[str, ...]] = ()
    """Its fields that need a speed of rotation."""
    PARAMETERS: ClassVar[Mapping[str, str]] = {}
    """Its fields that are parameters, with their units; what it adds is affine in each."""
    POSITIVE: ClassVar[bool] = False
    """Whether they must be above 0."""

    name: Annotated[
        Name | None, "Makes its numbers parameters ``<name>.<key>``; terms of one name are set together."
    ] = None

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the DOFs without inertia that it makes."""
        return ()

    def misfit(self, structure: Structure) -> str | None:
        """What is wrong with it beside a structure, or None."""
        del structure
        return None

    @abstractmethod
    def entries(self, sectors: int) -> tuple[Entry, ...]:
        """What it adds to the matrices of a disk of so many sectors, or (1) of no disk."""

    def slope(self, key: str, sectors: int) -> tuple[Entry, ...]:
        """What a unit of a parameter adds."""
        unit, nothing = (self.model_copy(update={key: at}).entries(sectors) for at in (1.0, 0.0))
        less = (Entry(e.on, e.of, e.offset, -e.k, -e.c, -e.g, -e.k_omega2) for e in nothing)
        return (*unit, *less)

    def in_sector(self, named: Callable[[str, int], str]) -> Self:
        """The same in one sector of a disk that is written out; `named` names a DOF so many sectors ahead."""
        moved: dict[str, object] = {} if getattr(self, "offset", None) is None else {"offset": 0}
        for key in self.DOFS:
            dof, ahead = getattr(self, key), getattr(self, "offset", 0) if key == "of" else 0
            if isinstance(dof, tuple):
                moved[key] = tuple(named(each, ahead) for each in dof)
            elif dof is not None:
                moved[key] = named(dof, ahead)
        return self.model_copy(update=moved)


class Coupling(LinearTerm):
    """Entries of stiffness and damping in the row of one DOF and the column of another."""

    KIND = "coupling"
    DOFS = ("on", "of")
    TURNING = ("gyroscopic", "k_omega2")
    PARAMETERS: ClassVar = {
        "k": "N/m", "k_imaginary": "N/m", "c": "N s/m", "gyroscopic": "N s^2/m", "k_omega2": "N s^2/m",
    }  # fmt: skip

    kind: Annotated[Literal["coupling"] | None, "The other kinds say what they are; may be left out."] = None
    on: Annotated[
        DofName,
        "DOF in whose equation of motion it stands (with the sign of the left-hand side, as a spring's k).",
    ]
    of: Annotated[DofName, "DOF whose motion it multiplies."]
    offset: Annotated[
        Offset, "Cyclic structures only: `of` is that of the sector so many ahead (negative: behind)."
    ] = 0
    antisymmetric: Annotated[
        bool, "Also the negative in the row of `of` and the column of `on`, as gyroscopic terms have it."
    ] = False
    k: Annotated[Signed, "Stiffness [N/m]."] = 0.0
    k_imaginary: Annotated[
        Signed,
        "Imaginary part of the stiffness [N/m]: damping that does not depend on the frequency; none at rest.",
    ] = 0.0
    c: Annotated[Signed, "Damping [N s/m]."] = 0.0
    gyroscopic: Annotated[
        Signed,
        "Damping per speed of rotation [N s/m per rad/s]: of a disk on tilting DOFs its polar moment of "
        "inertia [kg m²].",
    ] = 0.0
    k_omega2: Annotated[Signed, "Stiffness per squared speed of rotation [N/m per (rad/s)²]."] = 0.0

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if self.antisymmetric and self.on == self.of and self.offset == 0:
            raise ValueError(f"`antisymmetric` couples two different DOFs, got {self.on!r} twice")
        return self

    def entries(self, _sectors: int) -> tuple[Entry, ...]:
        """What it adds to the matrices."""
        k = complex(self.k, self.k_imaginary)
        first = Entry(self.on, self.of, self.offset, k, self.c, self.gyroscopic, self.k_omega2)
        if not self.antisymmetric:
            return (first,)
        back = Entry(self.of, self.on, -self.offset, -k, -self.c, -self.gyroscopic, -self.k_omega2)
        return first, back


class MaxwellBranch(LinearTerm):
    """A spring in series with a dashpot, joined in a point without inertia: a branch of a viscoelastic part.

    Its dynamic stiffness is k iωτ / (1 + iωτ). Branches beside a spring k_inf are the generalised Maxwell
    model, k_inf + Σ k_j iωτ_j / (1 + iωτ_j), the Prony series of a relaxation k_inf + Σ k_j e^{−t/τ_j}
    (R. M. Christensen, Theory of Viscoelasticity, 1982, chapter 1).

    Attributes
    ----------
    on : str
        DOF at the end of the spring.
    of : str
        DOF at the end of the dashpot; the ground if left out.
    point : str
        Names the point between both: a DOF that may be observed.
    k : float
        Stiffness of the spring [N/m].
    tau : float
        Relaxation time [s]: the dashpot has k tau [N s/m].
    """

    KIND = "maxwell"
    DOFS = ("on", "of", "point")
    PARAMETERS: ClassVar = {"k": "N/m", "tau": "s"}
    POSITIVE = True

    kind: Literal["maxwell"]
    on: DofName
    of: DofName | None = None
    offset: Annotated[
        Offset, "Cyclic structures only: `of` is that of the sector so many ahead (negative: behind)."
    ] = 0
    point: MemberName
    k: Positive
    tau: Positive

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if self.on == self.of and self.offset == 0:
            raise ValueError(f"a branch joins two different ends, got {self.on!r} twice")
        return self

    @property
    def points(self) -> tuple[str, ...]:
        """The point between spring and dashpot."""
        return (self.point,)

    def entries(self, _sectors: int) -> tuple[Entry, ...]:
        """A spring from `on` to the point, and a dashpot from there to `of`."""
        c = self.k * self.tau
        ends = [(self.on, self.point, 0, self.k, 0.0)]
        if self.of is not None:
            ends.append((self.of, self.point, -self.offset, 0.0, c))
        joined = (
            Entry(on, of, offset, sign * k, sign * c, 0.0, 0.0)
            for a, b, ahead, k, c in ends
            for on, of, offset, sign in ((a, a, 0, 1), (b, b, 0, 1), (a, b, ahead, -1), (b, a, -ahead, -1))
        )
        if self.of is not None:
            return tuple(joined)
        return (*joined, Entry(self.point, self.point, 0, 0.0, c, 0.0, 0.0))


_NEGATIVE = 1e-8  # of the largest eigenvalue: less is rounding of 0 in a file
_RELAXED = 1e-12  # of the largest eigenvalue: less is rounding of a motion that the part does not feel


class ViscoelasticPart(LinearTerm):
    """A part given by its stiffness matrix, which relaxes as the spring of a Maxwell branch does.

    The structure gains k K iωτ / (1 + iωτ). With K = Σ λ_i v_i v_iᵀ that is a branch of the stiffness k λ_i
    along each v_i: as many points without inertia, z_i' = −(z_i − v_iᵀ x)/τ, as K has rank (the internal
    states of G. A. Lesieutre, E. Bianchini, J. Vib. Acoust. 117 (1995) 424, doi:10.1115/1.2874474). Several
    branches of one K beside that of the structure are a Prony series, a rational function of iω with the
    real poles and positive residues of a passive solid.

    Attributes
    ----------
    K : Matrix
        Stiffness of the part [N/m], symmetric, not negative.
    on : tuple
        DOFs of its rows; the rows of the structure's own matrices if left out.
    point : str
        Begins the names of its points: `point`, `point~2`, …
    k : float
        Share of K that relaxes.
    tau : float
        Relaxation time [s].
    """

    KIND = "viscoelastic"
    DOFS = ("point", "on")
    PARAMETERS: ClassVar = {"k": "1", "tau": "s"}
    POSITIVE = True

    kind: Literal["viscoelastic"]
    K: Matrix
    on: tuple[DofName, ...] | None = None
    point: MemberName
    k: Positive = 1.0
    tau: Positive

    @model_validator(mode="after")
    def _relaxes(self) -> Self:
        if self.on is not None and len(set(self.on)) < len(self.on):
            raise ValueError(f"`on` must name different DOFs, got {list(self.on)}")
        if self.on is not None and len(self.on) != self.K.size:
            raise ValueError(f"`K` must have a row for each of the {len(self.on)} DOFs, got {self.K.size}")
        if differs(self.K.array, self.K.array.T):
            raise ValueError("`K` of a viscoelastic part must be symmetric")
        values = np.linalg.eigvalsh(self.K.array)
        if values[-1] <= 0.0 or values[0] < -_NEGATIVE * values[-1]:
            wanted = "must be a stiffness: no eigenvalue below 0, and one above"
            raise ValueError(f"`K` of a viscoelastic part {wanted}, got {values[0]:.4g} to {values[-1]:.4g}")
        return self

    @property
    def points(self) -> tuple[str, ...]:
        """One for each motion that the part feels."""
        rank = len(_motions(self.K, self.on))
        return (self.point, *(f"{self.point}~{i}" for i in range(2, rank + 1)))

    def misfit(self, structure: Structure) -> str | None:
        """Its rows must be those of the matrices of the structure, where it names no DOFs."""
        if self.on is not None:
            return None
        own: Matrix | None = getattr(structure, "M", None)
        if own is None or structure.has_sectors:
            return "needs `on`, the DOFs of its rows: rows alone are those of M and K of a whole structure"
        return None if self.K.size == own.size else f"must have {own.size} rows as M has, got {self.K.size}"

    def entries(self, _sectors: int) -> tuple[Entry, ...]:
        """A spring from each of its motions to a point, and a dashpot from there to the ground."""
        found = []
        for (size, motion), point in zip(_motions(self.K, self.on), self.points, strict=True):
            k = self.k * size
            found += [Entry(point, point, 0, k, k * self.tau, 0.0, 0.0)]
            joined = ((motion, motion, k), (motion, point, -k), (point, motion, -k))
            found += [Entry(a, b, 0, value, 0.0, 0.0, 0.0) for a, b, value in joined]
        return tuple(found)


@lru_cache(maxsize=64)
def _motions(K: Matrix, on: tuple[str, ...] | None) -> tuple[tuple[float, Along], ...]:
    """The stiffnesses above 0 of a part and the motions they are along, the stiffest first."""
    values, vectors = np.linalg.eigh(K.array)
    kept = [i for i in reversed(range(values.size)) if values[i] > _RELAXED * values[-1]]
    return tuple((float(values[i]), Along(vectors[:, i].copy(), on)) for i in kept)


SHIPPED = (Coupling, MaxwellBranch, ViscoelasticPart)
COUPLINGS: Kinds[type[LinearTerm]] = Kinds(
    LinearTerm, "kind", lambda term: (term.KIND,), (__name__,), "SHIPPED"
)
coupling_kinds, register, unregister = COUPLINGS.known, COUPLINGS.register, COUPLINGS.unregister


def kind_of(data: object) -> str:
    """The kind of a coupling: of a table or of one already read."""
    kind = data.get("kind") if isinstance(data, Mapping) else getattr(data, "kind", None)
    return Coupling.KIND if kind is None else str(kind)


class _OfAnyKind:
    """The union of the classes of all kinds there are when the schema of the scene is made."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        members: list[Any] = [Annotated[each, Tag(word)] for word, each in coupling_kinds().items()]
        union = Annotated[reduce(or_, members), Discriminator(kind_of)]  # type: ignore[valid-type]
        return handler.generate_schema(union)


CouplingOfAnyKind = Annotated[LinearTerm, _OfAnyKind]


class Influence(Part):
    """What the motion of a blade does to another: pressure of the gas."""

    offset: Annotated[
        Offset, "The blade that moves is so many ahead of the one that feels it; 0 is the blade itself."
    ] = 0
    stiffness: Annotated[Signed, "Real part of the coefficient [N/m]."] = 0.0
    imaginary: Annotated[
        Signed, "Imaginary part [N/m] at e^{iωt}, ω > 0; of the blade itself, damping where positive."
    ] = 0.0
    damping: Annotated[Signed, "Damping [N s/m]."] = 0.0


class DiameterCoefficient(Part):
    """What the gas does to a wave of one nodal diameter."""

    diameter: Annotated[
        Offset,
        "Nodal diameter of the wave x_{j+1} = x_j e^{2πi·diameter/sectors}; a wave the other way round is "
        "a negative one, or sectors less so many.",
    ]
    stiffness: Annotated[
        Signed,
        "Real and imaginary part of the coefficient [N/m]; damping where the imaginary part is positive.",
    ] = 0.0
    imaginary: Annotated[
        Signed,
        "Real and imaginary part of the coefficient [N/m]; damping where the imaginary part is positive.",
    ] = 0.0
    damping: Annotated[Signed, "Damping [N s/m]."] = 0.0


class Aerodynamics(LinearTerm):
    """Aerodynamic influence on one DOF of every blade, between neighbours or for each nodal diameter.

    The force on a blade is minus the sum of the coefficients times the motions.
    """

    DOFS = ("dof",)
    PARAMETERS: ClassVar = {"factor": "1"}

    dof: Annotated[DofName, "DOF of a sector that the gas acts on and that moves the gas."]
    factor: Annotated[Signed, "Multiplies all coefficients."] = 1.0
    influence: Annotated[
        tuple[Influence, ...], "Coefficients between a blade and those so many ahead; or"
    ] = ()
    nodal_diameters: Annotated[
        tuple[DiameterCoefficient, ...], "coefficients of waves; 0 for those left out."
    ] = ()

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if bool(self.influence) == bool(self.nodal_diameters):
            given = "both" if self.influence else "neither"
            raise ValueError(
                f"`aerodynamics` needs `influence` or `nodal_diameters`, one of them, got {given}"
            )
        return self

    def entries(self, sectors: int) -> tuple[Entry, ...]:
        """What it adds to the matrices of a disk of so many sectors."""
        given = tuple(
            (blade.offset, complex(blade.stiffness, blade.imaginary), complex(blade.damping))
            for blade in self.influence
        )
        return tuple(
            Entry(self.dof, self.dof, offset, self.factor * k, self.factor * c, 0.0, 0.0)
            for offset, k, c in given or _of_diameters(self.nodal_diameters, sectors)
        )


def _of_diameters(
    given: Sequence[DiameterCoefficient], sectors: int
) -> tuple[tuple[int, complex, complex], ...]:
    """Coefficients between blades, X_m = (1/N) Σ X(θ_n) e^{−jmθ_n}, without what is rounding of 0."""
    waves = np.zeros((2, sectors), np.complex128)
    for each in given:
        waves[:, each.diameter % sectors] += complex(each.stiffness, each.imaginary), each.damping
    blades = np.fft.fft(waves, axis=1) / sectors
    least = _ROUNDING * np.abs(waves).max(axis=1, initial=0.0)[:, None]
    real, imaginary = (np.where(np.abs(part) > least, part, 0.0) for part in (blades.real, blades.imag))
    blades = real + 1j * imaginary
    return tuple(
        # The offset the short way round.
        (m - sectors if 2 * m > sectors else m, complex(blades[0, m]), complex(blades[1, m]))
        for m in range(sectors)
        if np.any(blades[:, m])
    )


Coefficients = Annotated[tuple[Signed, ...], Field(min_length=1, max_length=3)]
Table = Annotated[tuple[tuple[NonNegative, Signed], ...], Field(min_length=2, max_length=3)]


class SpeedDependence(Part):
    """A parameter that follows the speed of rotation."""

    path: Annotated[str, "``<contact>.N0`` (or of a group), or ``excitation.amplitude``."]
    polynomial: Annotated[
        Coefficients | None, "c0, c1, c2 of c0 + c1 speed + c2 speed², the speed in 1/min; or"
    ] = None
    table: Annotated[
        Table | None,
        "two or three rows [speed in 1/min, value], through which the polynomial of least degree goes.",
    ] = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.polynomial is None) == (self.table is None):
            given = "neither" if self.table is None else "both"
            raise ValueError(f"`with_speed` needs `polynomial` or `table`, one of them, got {given}")
        if self.table is not None and len({speed for speed, _ in self.table}) < len(self.table):
            raise ValueError(f"`table` must have different speeds, got {[row[0] for row in self.table]}")
        return self

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """c0, c1, c2 by powers of the speed in 1/min."""
        if self.polynomial is not None:
            c0, c1, c2 = (*self.polynomial, 0.0, 0.0)[:3]
            return c0, c1, c2
        speeds, values = np.array(self.table).T
        scale = float(speeds.max())
        found = np.linalg.solve(np.vander(speeds / scale, increasing=True), values)
        c0, c1, c2 = (*(found / scale ** np.arange(found.size)).tolist(), 0.0)[:3]
        return c0, c1, c2

    def at(self, speed: float) -> float:
        """Value at a speed [1/min]."""
        c0, c1, c2 = self.coefficients
        return c0 + speed * (c1 + speed * c2)


def at_speed(scene: Any, speed: float) -> Any:
    """Return a scene (with `speed`, `with_speed` and `with_values`) at a speed [1/min], all that follows set.

    Raises
    ------
    SettingError
        A value that a parameter must not have.
    """
    there = scene.model_copy(update={"speed": float(speed), "speed_order": None, "with_speed": ()})
    values = there.with_values({each.path: each.at(speed) for each in scene.with_speed})
    return values.model_copy(update={"with_speed": scene.with_speed})
