"""What assembly makes of a scene: the structure without its contacts as matrices, and their derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated, Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Complex, Flags, Integer, Real
from solver.matrices.values import frozen
from solver.scene.linear_terms import End

Blocks = tuple[tuple[int, Real], ...]  # offsets between sectors, and a matrix for each

_Kept = TypeVar("_Kept")


@dataclass(frozen=True, slots=True, eq=False)
class Identity(Generic[_Kept]):
    """Something that does not change as a key: equal to itself alone, and kept alive by the key."""

    it: _Kept

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identity) and self.it is other.it

    def __hash__(self) -> int:
        return id(self.it)


def dynamic_stiffness(K: Any, C: Any, M: Any, k: Any, omega: float) -> tuple[Complex, Complex, Complex]:
    """Return Z_k(ω) = K + ikωC − (kω)²M of harmonics k, ∂Z_k/∂ω and ∂²Z_k/∂ω².

    Of arrays whose shapes go together: matrices, diagonals of modes (M = 1), or poles (−s, 1 and 0); and, as
    it is linear in them, of derivatives of these.
    """
    return (
        np.asarray(K + 1j * (k * omega) * C - (k * omega) ** 2 * M, np.complex128),
        np.asarray(1j * k * C - 2.0 * k * (k * omega) * M, np.complex128),
        np.asarray(-2.0 * k**2 * M + 0.0j * C, np.complex128),
    )


def with_inertia(
    K: NDArray[Any], C: NDArray[Any], M: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any] | None]:
    """Give points without inertia, for which C x' + K x = 0, equations of second order.

    They are (d/dt + D) (C x' + K x) = 0, with D the diagonal of K over that of C.

    Returns
    -------
    K, C, M, and the rows (K, C) over displacements and velocities, (m, 2 n), that are 0 in every motion; None
    where there are no such points.
    """
    heavy = np.any(M, axis=1)
    if heavy.all():
        return K, C, M, None
    own, at = C[~heavy], K[~heavy]
    decay = (np.diag(K)[~heavy] / np.diag(C)[~heavy])[:, None]
    K, C, M = K.copy(), C.copy(), M.astype(np.result_type(M, C))
    K[~heavy], C[~heavy], M[~heavy] = decay * at, at + decay * own, own
    return K, C, M, np.hstack([at, own])


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceTerm:
    """One force amplitude * cos(harmonic * omega t + phase) along `vector`."""

    vector: Annotated[
        Real | Complex, "Selects the DOF, (n,); complex where several have phases of their own."
    ]
    amplitude: Annotated[float, "Force [N]."]
    phase: Annotated[float, "Phase [rad]."]
    harmonic: Annotated[int, "Multiple of the excitation frequency; 0 is a static load."]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnTerms:
    """What a structure given by matrices has beside the symmetric ones, by offsets between sectors."""

    skew: Annotated[tuple[Blocks, Blocks], "Antisymmetric parts of K and C."]
    G: Annotated[Blocks, "Damping per speed."]
    K_omega2: Annotated[Blocks, "Stiffness per squared speed."]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coordinates:
    """What extra terms are written in."""

    dofs: Annotated[tuple[str, ...], "Names of the DOFs."]
    shapes: Annotated[Real, "The DOFs in the coordinates of the matrices, (n_dofs, n)."]
    direct: Annotated[bool, "Whether they are these coordinates themselves, as of a lumped structure."] = (
        False
    )
    own: Annotated[
        OwnTerms | None,
        "What the structure's own coordinates, in front of those of bodies, have beside symmetric matrices.",
    ] = None

    def rows(self, selected: NDArray[Any]) -> NDArray[Any]:
        """Return rows over the DOFs as rows over the coordinates; read-only."""
        return selected if self.direct else frozen(selected @ self.shapes)

    def at(self, end: End) -> Real:
        """Return a DOF, or a sum of them or of rows of the matrices, as a row over the coordinates (n,)."""
        if isinstance(end, str):
            return np.asarray(self.shapes[self.dofs.index(end)])
        if end.dofs is None:
            return np.pad(end.factors, (0, self.shapes.shape[1] - end.factors.size))
        return np.asarray(end.factors @ self.shapes[[self.dofs.index(dof) for dof in end.dofs]])

    @property
    def key(self) -> tuple[object, ...]:
        """Tells equal ones apart from others: the objects are the same as long as the structure is."""
        return id(self.shapes), id(self.own), self.dofs

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Coordinates) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


class Source(Protocol):
    """Matrices that are not sums over a few offsets between sectors."""

    def at(self, diameter: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return K, C and M at a nodal diameter, Hermitian."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtraTerms:
    """Terms beside the symmetric matrices, Σ_m X_m e^{jmθ} over m offsets; all arrays read-only.

    They are complex where a term is one of the frequency domain. A hysteretic term (structural damping
    K (1 + iη), an imaginary coefficient) is of a motion e^{iωt} with ω > 0 and has no share in the mean.
    """

    offsets: Annotated[tuple[int, ...], "Sectors ahead; (0,) of a structure without sectors."]
    K: Annotated[Complex, "Complex stiffness [N/m], (m, n, n)."]
    C: Annotated[Complex, "Complex damping [N s/m], (m, n, n)."]
    still: Annotated[Real | None, "Stiffness of the mean alone [N/m], (n, n)."] = None
    loss_factor: Annotated[float, "The symmetric stiffness times i and this belongs to it too."] = 0.0
    lossy: Annotated[
        Terms | None, "Those whose stiffness it is; None: of the terms beside which these stand."
    ] = None

    @property
    def is_real(self) -> bool:
        """Whether all of it is a term of equations in time."""
        return not (self.loss_factor or np.any(self.K.imag) or np.any(self.C.imag))

    @property
    def keeps_energy(self) -> bool:
        """Whether it is gyroscopic alone: no stiffness, and antisymmetric damping, which does no work."""
        if self.loss_factor or np.any(self.K) or np.any(self.C.imag):
            return False
        by = dict(zip(self.offsets, self.C, strict=True))
        return all(
            -offset in by and np.allclose(C, -by[-offset].T, rtol=0.0, atol=1e-12 * np.abs(C).max())
            for offset, C in by.items()
        )

    def at(
        self, turns: Complex, moving: Flags, stiffness: Callable[[], NDArray[Any]]
    ) -> tuple[Complex, Complex]:
        """Return what it adds to K and C, (ns, n, n), at e^{jθ} of structures that move or are at rest.

        `stiffness` gives the symmetric one (ns, n, n), with which structural damping goes.
        """
        powers = turns[:, None] ** np.array(self.offsets)
        K = np.einsum("sm,mij->sij", powers, self.K)
        if not np.all(moving) and np.any(self.K.imag):
            still = np.einsum("sm,mij->sij", powers, self.K.real.astype(np.complex128))
            K = np.where(moving[:, None, None], K, still)
        if self.still is not None:
            K = K + np.where(moving, 0.0, 1.0)[:, None, None] * self.still
        if self.loss_factor:
            K = K + np.where(moving, 1j * self.loss_factor, 0.0)[:, None, None] * stiffness()
        return K, np.einsum("sm,mij->sij", powers, self.C)


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """K, C and M of one sector of a tuned disk, or of the whole structure, or derivatives of them.

    Harmonic k of engine order i sees the nodal diameter n = k i: the neighbour of x in the next sector is
    x e^{j theta} with theta = 2 pi n / sectors. There a matrix is X0 + Xp e^{j theta} + Xp^T e^{-j theta}, or
    what `sector` gives; `at` says it for all of them, with the extra terms. All arrays are read-only.
    """

    sectors: Annotated[int, "Number of sectors, 1 if lumped."]
    M: Annotated[Real, "Mass [kg], (n, n)."]
    C0: Annotated[Real, "Damping [N s/m], (n, n)."]
    Cp: Annotated[Real, "Damping that couples to the next sector [N s/m], (n, n); 0 if lumped."]
    K0: Annotated[Real, "Stiffness [N/m], (n, n)."]
    Kp: Annotated[Real, "Stiffness that couples to the next sector [N/m], (n, n); 0 if lumped."]
    sector: Annotated[Source | None, "What the matrices are at each nodal diameter, in place of these."] = (
        None
    )
    extra: Annotated[
        ExtraTerms | None, "Terms that are not symmetric, not real or not of springs and dashpots; see `at`."
    ] = None

    def turns(self, diameters: Integer) -> Complex:
        """Return e^{j theta} at nodal diameters, (nd,); without rounding where it is real."""
        angles = 2.0 * np.pi * diameters / self.sectors
        real = 2 * diameters % self.sectors == 0
        return np.asarray(np.where(real, np.round(np.cos(angles)), np.exp(1j * angles)))

    def plain(self, diameters: Integer) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return K, C and M without extra terms, Hermitian, (nd, n, n) each, at nodal diameters.

        They are real where all phases are, or all blocks that join sectors are 0.

        Raises
        ------
        SettingError
            A reduced sector was not built for one of them.
        """
        if self.sector is not None:
            found = [self.sector.at(int(n)) for n in diameters]
            K, C, M = (np.array(each) for each in zip(*found, strict=True))
            return K, C, M
        turn = self.turns(diameters)[:, None, None]

        def turned(zero: Real, plus: Real) -> NDArray[Any]:
            if not np.any(plus):
                return np.broadcast_to(zero, (len(turn), *zero.shape))
            ahead = plus * turn
            return np.asarray(zero + (ahead + np.swapaxes(ahead.conj(), 1, 2)))  # Hermitian to the last digit

        M = np.broadcast_to(self.M, (len(turn), *self.M.shape))
        return turned(self.K0, self.Kp), turned(self.C0, self.Cp), M

    def beside(self, diameters: Integer, moving: Flags) -> tuple[Complex, Complex] | None:
        """Return what the extra terms add to K and C, (nd, n, n) each; None: there are none."""
        if self.extra is None:
            return None
        of = self if self.extra.lossy is None else self.extra.lossy
        return self.extra.at(self.turns(diameters), moving, lambda: of.plain(diameters)[0])

    def at(self, diameters: Integer, moving: Flags) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return K, C and M, (nd, n, n) each, at nodal diameters, of motions or (False) of what is at rest.

        K and C are real where both are.

        Raises
        ------
        SettingError
            A reduced sector was not built for one of them.
        """
        K, C, M = self.plain(diameters)
        more = self.beside(diameters, moving)
        if more is not None:
            K, C = K + more[0], C + more[1]
            if not (np.any(K.imag) or np.any(C.imag)):
                K, C = K.real, C.real
        return K, C, M


@dataclass(frozen=True, slots=True, eq=False)
class HeldMatrices:
    """Matrices at each nodal diameter, (ns, n, n) each, real where all phases are."""

    K: NDArray[Any] = field(repr=False)
    C: NDArray[Any] = field(repr=False)
    M: NDArray[Any] = field(repr=False)
    key: Annotated[tuple[object, ...], "Tells equal ones apart from others."]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, HeldMatrices) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@dataclass(frozen=True, slots=True, eq=False)
class _ByParts:
    """A model as a key: equal to another with the same matrices, whatever its contacts and forces are."""

    model: LinearModel = field(repr=False)
    parts: tuple[object, ...]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByParts) and self.parts == other.parts

    def __hash__(self) -> int:
        return hash(self.parts)


@lru_cache(maxsize=32)
def _matrices(of: _ByParts, diameters: tuple[int, ...], moving: tuple[bool, ...]) -> HeldMatrices:
    given = np.array(diameters, dtype=np.int64)
    moves = np.array(moving, np.bool_) if moving else np.ones(given.size, np.bool_)
    return HeldMatrices(*of.model.at(given, moves), (of.parts, diameters, moving))


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModel(Terms):
    """What is linear of a scene: its terms, and what acts on it, joins it and is seen of it."""

    dofs: Annotated[tuple[str, ...], "Names of the DOFs."]
    shapes: Annotated[
        Real,
        "The DOFs in the coordinates of the matrices, (n_dofs, n): the identity, or what a structure given "
        "by matrices or modes names.",
    ]
    contact_here: Annotated[
        Real,
        "L(theta) = contact_here + contact_next e^{j theta}, (n_ports, n); u = L x, x the coordinates.",
    ]
    contact_next: Annotated[Real, "Its part in the next sector, (n_ports, n)."]
    stiffnesses: Annotated[
        Real, "What holds each motion when the contact is closed and stuck [N/m], (n_ports,)."
    ]
    forces: Annotated[tuple[ForceTerm, ...], "The excitation."]
    observe: Annotated[Real, "Selects the observed DOF, (n,)."]
    engine_order: Annotated[int, "Engine order of the excitation, 0 if lumped."]
    every_diameter: Annotated[bool, "Whether the matrices of all nodal diameters are known."] = True
    prescribed: Annotated[
        int, "So many coordinates, the last, are motions of a base; see `solver.linear.moving_base`."
    ] = 0
    points: Annotated[int, "So many coordinates, the last before those, are points without inertia."] = 0
    line: Annotated[
        ExtraTerms | None,
        "What K gains per squared speed and C per speed where the speed follows the frequency, Ω = ω / "
        "order.",
    ] = None
    line_order: Annotated[float, "That order."] = 1.0

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates of the matrices."""
        return int(self.shapes.shape[1])

    @property
    def interblade_phase(self) -> float:
        """Phase of harmonic 1 from one sector to the next [rad]."""
        return 2.0 * math.pi * self.engine_order / self.sectors

    @property
    def port_stiffnesses(self) -> Real:
        """A finite stiffness > 0 of every port [N/m]: its own, or one of the size of the structure's."""
        own, K = self.stiffnesses, self.K0 if self.sector is None else self.sector.at(self.engine_order)[0]
        return np.where((own > 0.0) & np.isfinite(own), own, float(np.abs(K).max(initial=0.0)) or 1.0)

    @property
    def free(self) -> Flags:
        """The coordinates that move freely, (n,): not the base nor what it drives, which have no inertia."""
        if not self.prescribed:
            return np.ones(self.n_coordinates, np.bool_)
        moves: Flags = np.any(self.M, axis=1)
        moves[-self.prescribed - self.points :] = True
        moves[-self.prescribed :] = False
        return moves

    @property
    def is_symmetric(self) -> bool:
        """Whether energy is kept but for dashpots: nothing beside springs, dashpots and gyroscopic terms."""
        return not self.prescribed and (self.extra is None or self.extra.keeps_energy)

    def diameters(self, ks: Integer) -> Integer:
        """Return the nodal diameters that harmonics see, from 0 to sectors - 1."""
        return (ks * self.engine_order) % self.sectors

    def matrices(self, diameters: Integer, moving: Flags) -> HeldMatrices:
        """Return what `at` does, kept as long as the structure is the same.

        The matrices of a scene are the same arrays as long as its structure is, so the identity of these
        read-only arrays is the key: changing contacts, forces or the observed DOF makes none anew.

        Raises
        ------
        SettingError
            A reduced sector was not built for one of them.
        """
        arrays = (self.K0, self.Kp, self.C0, self.Cp, self.M)
        parts: tuple[object, ...] = (self.sector,) if self.sector else tuple(map(Identity, arrays))
        # Without extra terms what is at rest has the matrices of what moves.
        still = () if self.extra is None else tuple(moving.tolist())
        return _matrices(_ByParts(self, (*parts, self.sectors, self.extra)), tuple(diameters.tolist()), still)

    def inertia(self, diameters: Integer, ks: Integer) -> NDArray[Any]:
        """Return M of harmonics ks at their nodal diameters, (ns, n, n), with what follows the speed.

        Along a line K + (ω/e)² K₂ + ikω (C + (ω/e) G) − k²ω² M has the shape of a fixed speed, with the
        inertia M − K₂/(ke)² − i G/(ke). The mean is written with k = 1 and has −K₂/e² alone.
        """
        K, _, whole = self.plain(diameters)
        if self.line is None:
            return whole
        K2, G = self.line.at(self.turns(diameters), np.ones(len(ks), np.bool_), lambda: K)
        moving, k = (ks > 0)[:, None, None], np.maximum(ks, 1)[:, None, None]
        per = 1.0 / (k * self.line_order)
        return np.asarray(np.where(moving, whole - 1j * per * G, 0.0) - per**2 * K2)

    def ports_at(self, diameters: Integer) -> Complex:
        """Return the relative motions L of the contacts, (nd, n_ports, n), at nodal diameters."""
        return np.asarray(self.contact_here + self.contact_next * self.turns(diameters)[:, None, None])


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModelDerivative(Terms):
    """Derivatives of a `LinearModel` by one parameter: its terms in units per unit of the parameter."""

    affine: Annotated[
        bool, "The matrices are affine in this parameter, so these derivatives are constant."
    ] = True
    contact_here: Annotated[
        Real | None, "Derivative of that matrix, (n_ports, n); None where it does not depend on it."
    ] = None
    contact_next: Annotated[Real | None, "Likewise, (n_ports, n)."] = None
    forces: Annotated[tuple[ForceTerm, ...], "First derivatives of the forces [N per unit]."] = ()
    second_forces: Annotated[tuple[ForceTerm, ...], "Second ones [N per unit squared]."] = ()
    second_extra: Annotated[ExtraTerms | None, "Second derivatives of the extra terms."] = None
