"""A mistuned disk in a linear limit: the amplitude of each blade with its exact derivatives by all factors.

With δ_j the deviation of the factor of blade j the dynamic stiffness is Z(ω, δ) = Z₀(ω) + Σ_j δ_j Δ_j(ω), and
the amplitude of an observed DOF is X = gᵀ Z⁻¹ f. One inverse gives it with its derivative −λᵀ (∂Z) x,
λ = Z⁻ᵀ g, by every factor and by ω.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated, Any

import numpy as np
from scipy.linalg import eigh

from solver.arrays import Complex, Integer, Real
from solver.balance.rounding import LOST_BITS
from solver.errors import SettingError
from solver.linear.assembly import linear_model, row_of
from solver.linear.model import LinearModel, dynamic_stiffness
from solver.scene.scene import MatricesStructure, Scene
from solver.studies.blades import mistuned

TWO_PI = 2.0 * math.pi
MOST_NUMBERS = 20_000_000  # of rows of blades by coordinates, 320 MB
_GRID = 48  # frequencies over a band, besides the natural ones, at which a peak is looked for
_POLISH = 6  # maxima that are looked at closely
_CLOSE = 1e-13  # relative rise of an amplitude at which a peak is found
_INTERPOLATED = 0.01  # deviation over which a damping ratio's C is interpolated: all else is linear
_MOST_STEPS, _MOST_HALVINGS = 30, 12


class Contacts(Enum):
    """How the contacts of a disk count; the value is what a user says."""

    SOLVED = "solved"
    STUCK = "stuck"
    OPEN = "open"
    RESIDUAL = "residual"  # solved, with any forces that those which stick may hold


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskPeak:
    """The highest amplitude of a disk over a band."""

    value: Annotated[float, "[m]."]
    blade: Annotated[int, "The sector that has it."]
    omega: Annotated[float, "Where [rad/s]."]


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearDisk:
    """A tuned disk as K, C, M, what the factor of each blade adds, the force and the observed DOFs.

    Coordinates are those of the whole annulus, or of some of its tuned modes (`reduced`).
    """

    sectors: Annotated[int, "N."]
    harmonic: Annotated[int, "k, of the force; all matrices are at kω."]
    band: Annotated[tuple[float, float], "Of ω [rad/s]."]
    K: Annotated[Complex, "(m, m)."] = field(repr=False)
    C: Annotated[Complex, "(m, m)."] = field(repr=False)
    M: Annotated[Complex, "(m, m)."] = field(repr=False)
    own: Annotated[
        tuple[Complex, Complex, Complex], "What a factor adds to K, C and M of its rows, (s, s) each."
    ]
    modal_damping: Annotated[
        bool, "Damping is a ratio of modes, so that C is linear in the factors nearly, see `with_factors`."
    ] = False
    rows: Annotated[Complex, "Coordinates to the rows of each blade, (N, s, m)."] = field(repr=False)
    force: Annotated[Complex, "(m,)."] = field(repr=False)
    observed: Annotated[Complex, "The DOF of each sector, (N, m)."] = field(repr=False)

    def stiffness(self, delta: Real, omega: float) -> tuple[Complex, Complex, Complex, Complex]:
        """Return Z and ∂Z/∂ω, (m, m), what a factor adds to its rows of Z, (s, s), and ∂²Z/∂ω², (m, m)."""
        Z, Z_omega, Z_twice = dynamic_stiffness(self.K, self.C, self.M, self.harmonic, omega)
        D, D_omega, D_twice = dynamic_stiffness(*self.own, self.harmonic, omega)
        if np.any(delta):
            Z = Z + self._spread(delta, D)
            if np.any(D_omega):
                Z_omega, Z_twice = (
                    Z_omega + self._spread(delta, D_omega),
                    Z_twice + self._spread(delta, D_twice),
                )
        return Z, Z_omega, D, Z_twice

    def _spread(self, delta: Real, block: Complex) -> Complex:
        """Return Σ_j δ_j Pᴴ_j block P_j."""
        n, s, m = self.rows.shape
        scaled = (delta[:, None, None] * (block @ self.rows)).reshape(n * s, m)
        return np.asarray(self.rows.reshape(n * s, m).conj().T @ scaled)

    def amplitudes(self, delta: Real, omega: float) -> Complex:
        """Return the complex amplitudes of all blades [m], (N,)."""
        return np.asarray(self.observed @ np.linalg.solve(self.stiffness(delta, omega)[0], self.force))

    def slopes(self, delta: Real, omega: float, blade: int) -> tuple[complex, Complex, complex, complex]:
        """Return the amplitude X of a blade [m], ∂X/∂δ, (N,), ∂X/∂ω and ∂²X/∂ω²."""
        Z, Z_omega, D, Z_twice = self.stiffness(delta, omega)
        x, y = np.linalg.solve(Z, self.force), np.linalg.solve(Z.T, self.observed[blade])
        seen, pulled = self.rows @ x, self.rows.conj() @ y
        by_delta = -np.einsum("js,st,jt->j", pulled, D, seen)
        pushed = Z_omega @ x
        bent = 2.0 * (y @ Z_omega @ np.linalg.solve(Z, pushed)) - y @ Z_twice @ x
        return complex(self.observed[blade] @ x), by_delta, complex(-(y @ pushed)), complex(bent)

    def summit(self, delta: Real, blade: int, omega: float) -> tuple[float, float, Real]:
        """Return the maximum of a blade's amplitude over ω next to `omega`.

        Newton's method on log|X|; where that curves upward Gauss and Newton's on |1/X|, which near a
        resonance is nearly linear in ω.

        Returns
        -------
        Its ω, log|X| there, and derivatives of that by δ, (N,), in which ω moves along (envelope theorem).
        """
        low, high = self.band
        X, by_delta, by_omega, twice = self.slopes(delta, omega, blade)
        for _ in range(_MOST_STEPS):
            rate = by_omega / X
            slope, bend = rate.real, (twice / X - rate**2).real
            step = -slope / bend if bend < 0.0 else slope / max(abs(rate) ** 2, 1e-300)
            target = min(max(omega + step, low), high)
            if abs(slope * (target - omega)) <= _CLOSE:
                break
            for _ in range(_MOST_HALVINGS):
                found = self.slopes(delta, target, blade)
                if abs(found[0]) >= abs(X):
                    break
                target = omega + 0.25 * (target - omega)
            else:
                break
            omega, (X, by_delta, by_omega, twice) = target, found
        return omega, math.log(abs(X)), np.asarray((by_delta / X).real)

    def peak(self, delta: Real) -> DiskPeak:
        """Return the highest amplitude of any blade over the band."""
        places = self.places(delta)
        sizes = np.abs([self.amplitudes(delta, omega) for omega in places])
        best = sizes.max(axis=1)
        order = np.argsort(-best)[:_POLISH]
        found = []
        for i in order[best[order] >= 0.5 * best[order[0]]]:
            blade = int(sizes[i].argmax())
            omega, value, _ = self.summit(delta, blade, float(places[i]))
            found.append(DiskPeak(value=math.exp(value), blade=blade, omega=omega))
        return max(found, key=lambda one: one.value)

    def places(self, delta: Real) -> Real:
        """Return where a peak is looked for [rad/s]: natural frequencies in the band, and a grid."""
        low, high = self.band
        scaled = [
            base + self._spread(delta, own) for base, own in zip((self.K, self.M), self.own[::2], strict=True)
        ]
        K, M = (0.5 * (each + each.conj().T) for each in scaled)
        natural = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / self.harmonic
        inside = natural[(natural >= low) & (natural <= high)]
        return np.sort(np.concatenate([inside, np.geomspace(low, high, _GRID)]))

    @property
    def undamped(self) -> bool:
        """Whether a mode of the tuned disk in the band has no damping but rounding."""
        K, M = (0.5 * (each + each.conj().T) for each in (self.K, self.M))
        omega2, modes = eigh(K, M)
        natural = np.sqrt(np.maximum(omega2, 0.0)) / self.harmonic
        for omega, mode in zip(natural, modes.T, strict=True):
            if self.band[0] <= omega <= self.band[1]:
                rows = np.abs(K).max(axis=1) + (self.harmonic * omega) ** 2 * np.abs(M).max(axis=1)
                taken = float((mode.conj() @ self.loss(omega) @ mode).real)
                if abs(taken) <= LOST_BITS * float(rows @ np.abs(mode) ** 2):
                    return True
        return False

    def damped(self, times: float) -> LinearDisk:
        """Return the disk with so many times the damping."""
        K, C = ((0.5 * (each + each.conj().T), 0.5 * (each - each.conj().T)) for each in (self.K, self.C))
        return replace(self, K=K[0] + times * K[1], C=times * C[0] + C[1])

    def loss(self, omega: float) -> Complex:
        """Return (Z − Zᴴ)/2i of the tuned disk, which takes the power, (m, m)."""
        Z = self.stiffness(np.zeros(self.sectors), omega)[0]
        return np.asarray((Z - Z.conj().T) / 2j)


def linear_disk(
    scene: Scene, of: Sequence[str], contacts: Contacts, band: tuple[float, float], dof: str
) -> LinearDisk:
    """Return a disk with all contacts stuck, or all open, in the coordinates of the annulus.

    Parameters
    ----------
    scene : cyclic; its own mistuning does not count.
    of : what the factors multiply, as in `solver.mistuned`.
    contacts : STUCK or OPEN.
    band : of the frequency [Hz].
    dof : the observed DOF of a sector.

    Raises
    ------
    SettingError, SceneError
        The scene is not cyclic, a base that moves, forces of several harmonics, a part it does not have.
    """
    ones = np.ones(scene.structure.sector_count)
    whole = mistuned(scene, of=of, values=ones.tolist())
    model, k = linear_model(whole), check_linear(scene, contacts)
    ratio = isinstance(whole.structure, MatricesStructure) and bool(whole.structure.damping_ratio)
    step, other = (_INTERPOLATED if ratio else 1.0), ones.copy()
    other[0] += step
    scaled = linear_model(mistuned(scene, of=of, values=other.tolist()))
    order = _sector_by_sector(whole, model.n_coordinates)
    K, C, M = _matrices(model, k, _stuck(whole, model) if contacts is Contacts.STUCK else 0.0, order)
    both = (_matrices(one, k, 0.0, order) for one in (model, scaled))
    added = [(b - a) / step for a, b in zip(*both, strict=True)]
    n, m = len(ones), model.n_coordinates
    touched = np.flatnonzero(np.any([np.any(np.abs(each) > 0.0, axis=1) for each in added], axis=0))
    if n * len(touched) * m > MOST_NUMBERS:
        wanted = f"must have a smaller annulus than {m} coordinates for a linear limit: keep fewer modes"
        raise SettingError("scene", scene.name, wanted)
    own, eye = [each[np.ix_(touched, touched)] for each in added], np.eye(m, dtype=np.complex128)
    places = (touched[None, :] + np.arange(n)[:, None] * (m // n)) % m
    names = [f"{dof}@{j}" for j in range(n)]
    return LinearDisk(
        sectors=n, harmonic=k, band=(TWO_PI * band[0], TWO_PI * band[1]), K=K, C=C, M=M,
        own=(own[0], own[1], own[2]), modal_damping=ratio, rows=eye[places],
        force=_force(model, k)[order],
        observed=np.array([(row_of(whole, name) @ model.shapes)[order] for name in names], np.complex128),
    )  # fmt: skip


def with_factors(
    disk: LinearDisk, scene: Scene, of: Sequence[str], contacts: Contacts, delta: Real
) -> LinearDisk:
    """Return a disk in all coordinates whose blades have factors 1 + δ, its damping that of its own modes."""
    whole = mistuned(scene, of=of, values=(1.0 + delta).tolist())
    model = linear_model(whole)
    more = _stuck(whole, model) if contacts is Contacts.STUCK else 0.0
    order = _sector_by_sector(whole, model.n_coordinates)
    K, C, M = _matrices(model, disk.harmonic, more, order)
    return replace(disk, K=K, C=C, M=M)


def _sector_by_sector(whole: Scene, m: int) -> Integer:
    """Return the order in which the coordinates of an annulus stand sector after sector."""
    if isinstance(whole.structure, MatricesStructure):
        return np.arange(m)
    sectors = [int(name.rpartition("@")[2]) for name in whole.dofs]
    return np.argsort(sectors, kind="stable")


def check_linear(scene: Scene, contacts: Contacts) -> int:
    """Return the one harmonic of forces; SettingError of several, a moving base, rigid ones to stick."""
    if any(force.base is not None for force in scene.excitation):
        raise SettingError(
            "scene", scene.name, "must be shaken by forces, not by its base, for a linear limit"
        )
    stiffnesses = [k for contact in scene.contacts for k in contact.stiffnesses]
    if contacts is Contacts.STUCK and not np.all(np.isfinite(stiffnesses)):
        raise SettingError("contacts", contacts.value, "must not be of rigid contacts (kt or kn = inf)")
    moving = [force for force in scene.excitation if force.harmonic > 0]
    found = sorted({force.harmonic for force in moving if force.amplitude} or {f.harmonic for f in moving})
    if len(found) != 1:
        raise SettingError("scene", found, "must have forces of one harmonic for a linear limit")
    return found[0]


def _force(model: LinearModel, k: int) -> Complex:
    found = np.zeros(model.n_coordinates, np.complex128)
    for term in model.forces:
        if term.harmonic == k:
            found += term.vector * term.amplitude * np.exp(1j * term.phase)
    return found


def _stuck(scene: Scene, model: LinearModel) -> Complex:
    """Return the stiffness of all contacts, stuck."""
    (L,) = model.ports_at(np.zeros(1, np.int64))
    own = np.array([k for contact in scene.contacts for k in contact.stiffnesses])
    return np.asarray(L.conj().T @ (own[:, None] * L))


def _matrices(model: LinearModel, k: int, more: Any, order: Integer) -> tuple[Complex, Complex, Complex]:
    """Return K, C and M of all sectors at a harmonic, sector after sector."""
    ks, diameters, places = np.array([k]), np.zeros(1, np.int64), np.ix_(order, order)
    (K,), (C,), _ = model.at(diameters, np.ones(1, np.bool_))
    (M,) = model.inertia(diameters, ks)
    whole = [np.asarray(each, np.complex128)[places] for each in (K + more, C, M)]
    return whole[0], whole[1], whole[2]
