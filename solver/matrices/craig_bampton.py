"""Large models reduced onto the DOFs in use: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313.

The DOFs in use stay as they are; the rest follows them statically and vibrates in its lowest modes with the
DOFs in use held (doi:10.2514/3.4741). All is sparse: the stiffness of the rest is factorised once, for the
static solutions, the modes (shift-invert) and the estimate of what was lost. Where the DOFs in use do not
hold the rest, K − σ M with a small negative σ takes the place of K, and the rigid-body modes of the rest are
among the modes kept: the same space of motions but for a share σ / ω² of the modes left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from solver.arrays import Real
from solver.errors import FieldError
from solver.matrices.diagnostics import rigid_body_modes
from solver.matrices.normal_modes import SMALL_PIVOT, least_stiffness, undamped_modes
from solver.matrices.values import ASYMMETRY, MOST_DOFS, MOST_MODES, DofTable, one_triangle

Array = NDArray[Any]  # real, or complex where the matrices are Hermitian

DENSE = 600  # rows below which all modes are found at once
FREE = (
    "with the DOFs named in `dofs` held, the rest of the structure can still move freely {how}: name DOFs "
    "that hold it"
)
_SHIFT = 1e-13  # shift relative to the largest K_jj / M_jj, where K alone is singular
_RIGID = 0.1  # modes below this share of the shift are rigid-body modes: they are zero but for rounding
_FAR = 1e8  # a static solution larger than this, for a unit displacement, means that nothing holds the rest
_MASSLESS = 1e-14  # 1/ω² relative to the lowest mode's: less is rounding, of rows that move without any mass
_FIRST = 16  # modes looked for first when only their highest frequency is given
_BODY = 6
_NEIGHBOURS = 5  # of the rows that the mass couples to a DOF in use, within which its inverse is solved for
_LITTLE = 1e-10  # of the mass of a row, so that its inverse exists


@dataclass(frozen=True, slots=True, kw_only=True)
class Interior:
    """K − σ M of the rest, factorised."""

    K: Annotated[Any, "Stiffness, sparse, (n, n)."]
    M: Annotated[Any, "Mass, sparse, (n, n)."]
    couplings: Annotated[dict[str, Array], "K and M between the rest and the DOFs in use, (n, n_kept)."]
    shift: Annotated[float, "σ <= 0 [rad²/s²], 0 if the DOFs in use hold the rest."]
    solve: Annotated[Any, "The inverse of K − σ M."]
    follow: Annotated[Array, "How the rest follows a unit displacement of each DOF in use, (n, n_kept)."]
    residual: Annotated[float, "Of that solution, relative to the forces it balances."]


def interior(K: Any, M: Any, rest: NDArray[np.int64], kept: NDArray[np.int64]) -> Interior:
    """Factorise the rest of a model.

    Raises
    ------
    ValueError
        Rows without stiffness, or nothing that can be factorised.
    """
    inner, mass = _block(K, rest, rest), _block(M, rest, rest)
    couplings = {"K": _block(K, rest, kept).toarray(), "M": _block(M, rest, kept).toarray()}
    stiffness, inertia = inner.diagonal().real, mass.diagonal().real
    empty = np.flatnonzero((stiffness == 0.0) & (np.diff(inner.indptr) == 0))
    if empty.size:
        how = f"in {empty.size} rows without any stiffness, the first of them row {rest[empty[0]]}"
        raise ValueError(FREE.format(how=how))
    moving = inertia > 0.0
    scale = float(np.abs(stiffness[moving] / inertia[moving]).max(initial=0.0))
    found = _factorised(inner, mass, couplings, 0.0)
    if found is None or abs(_lowest_estimate(found)) < _SHIFT * _RIGID * scale:
        found = _factorised(inner, mass, couplings, -_SHIFT * scale)
    if found is None:
        raise ValueError(FREE.format(how="(K and M are singular there)"))
    return found


def _block(matrix: Any, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Any:
    return csc_array(matrix[rows][:, columns])


def _factorised(K: Any, M: Any, couplings: dict[str, Array], shift: float) -> Interior | None:
    """K − σ M factorised; None if it is singular to working accuracy."""
    matrix = csc_array(K - shift * M) if shift else K
    try:
        solve = factor(matrix)
    except RuntimeError:
        return None
    force = couplings["K"] - shift * couplings["M"]
    follow = -solve(force)
    size = np.abs(force).max(initial=0.0)
    residual = float(np.abs(matrix @ follow + force).max(initial=0.0) / size) if size else 0.0
    if not np.isfinite(follow).all() or np.abs(follow).max(initial=0.0) > _FAR:
        return None
    return Interior(K=K, M=M, couplings=couplings, shift=shift, solve=solve, follow=follow, residual=residual)


def factor(matrix: Any) -> Callable[[Array], Array]:
    """The inverse of a symmetric or Hermitian matrix: pivots from the diagonal, ordered for little fill.

    Raises
    ------
    RuntimeError
        The matrix is singular.
    """
    symmetric = {"diag_pivot_thresh": 1e-3, "options": {"SymmetricMode": True}}
    direct: Callable[[Array], Array] = splu(matrix, permc_spec="MMD_AT_PLUS_A", **symmetric).solve
    return direct


def _lowest_estimate(rest: Interior) -> float:
    """About the lowest ω² of the rest, by two steps of inverse iteration."""
    shape = np.linspace(1.0, 2.0, rest.K.shape[0]).astype(rest.K.dtype)
    for _ in range(2):
        shape = rest.solve(rest.M @ shape)
        shape /= np.abs(shape).max(initial=1e-300)
    inertia = float(np.vdot(shape, rest.M @ shape).real)
    return float(np.vdot(shape, rest.K @ shape).real) / inertia if inertia > 0.0 else np.inf


def held_modes(rest: Interior, count: int | None, up_to_hz: float | None) -> tuple[Real, Array]:
    """The lowest modes of the rest with the DOFs in use held.

    Parameters
    ----------
    count : how many; where the rest moves freely, its rigid-body modes are kept at least.
    up_to_hz : or all up to this frequency.

    Returns
    -------
    omega2 : (m,) array
        Ascending [rad²/s²].
    modes : (n, m) array
        Mass-normalised.

    Raises
    ------
    ValueError
        Modes that ARPACK did not find, more than `values.MOST_MODES`, or a rest in several loose parts.
    """
    n = rest.K.shape[0]
    least = 0 if not rest.shift else min(n, _BODY + 1)
    limit = None if up_to_hz is None else (2.0 * math.pi * up_to_hz) ** 2
    wanted = min(n, max(count if count is not None else _FIRST, least))
    while True:
        values, modes = _lowest(rest, wanted)
        if limit is None or wanted == n or values[-1] > limit:
            break
        if wanted >= MOST_MODES:
            raise ValueError(f"there are more than {wanted} modes up to {up_to_hz:g} Hz: ask for fewer")
        wanted = min(n, 2 * wanted, MOST_MODES)
    free = int(np.count_nonzero(np.abs(values) < _RIGID * abs(rest.shift)))
    if free > _BODY:
        raise ValueError(FREE.format(how=f"in {free} or more ways, where one body has {_BODY} at most"))
    kept = count if limit is None else int(np.searchsorted(values, limit, side="right"))
    kept = min(n, max(kept or 0, free))
    return values[:kept], modes[:, :kept]


def _lowest(rest: Interior, count: int) -> tuple[Real, Array]:
    n = rest.K.shape[0]
    if not count:
        return np.zeros(0), np.zeros((n, 0))
    if n <= DENSE or count > n // 2:
        K, M = rest.K.toarray(), rest.M.toarray()
        if least_stiffness(M) > SMALL_PIVOT:
            return linalg.eigh(K, M, subset_by_index=(0, count - 1))  # type: ignore[no-any-return]
        found = undamped_modes(K, M)  # rows of elements alone move without any mass
        moving = found.flexibility[:count] > _MASSLESS * found.flexibility[0]
        return found.omega2[:count][moving], found.phi[:, :count][:, moving]
    inverse = LinearOperator((n, n), matvec=rest.solve, dtype=rest.K.dtype)
    start = np.linspace(1.0, 2.0, n).astype(rest.K.dtype)  # fixed, so that the same files give the same scene
    try:
        values, modes = eigsh(rest.K, k=count, M=rest.M, sigma=rest.shift, OPinv=inverse, v0=start)
    except (ArpackError, RuntimeError) as error:
        raise ValueError(f"{count} modes were not found ({error}): ask for fewer") from error
    order = np.argsort(values)
    return values[order], modes[:, order]


GOOD = 1e-3  # relative error of a frequency that is still called good


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """What was kept and what it is worth."""

    held_hz: Annotated[Real, "Frequencies of the modes kept, the DOFs in use held [Hz], (m,)."]
    effective_mass: Annotated[
        Real,
        "Share of the inertia of the rest, when one DOF in use is moved, that each mode carries, (m, "
        "n_kept); (m, 0) where it was not asked for.",
    ]
    system_hz: Annotated[Real, "Frequencies of the reduced model without contacts [Hz], (n,)."]
    system_error: Annotated[Real, "Estimated relative error of each, (n,); infinite above the modes kept."]
    good_to_hz: Annotated[float, "Frequency up to which every error is below `GOOD` [Hz]."]
    static_residual: Annotated[
        float, "Forces left over by the static solutions, relative: how exact the static stiffness is."
    ]
    rigid_body_modes: Annotated[int, "Of the reduced model."]
    shift_hz: Annotated[float, "sqrt(−σ) / 2π of the shift that a free rest needed, else 0 [Hz]."]

    @property
    def mass_carried(self) -> Real:
        """Share of the inertia of the rest that all modes carry, for each DOF in use."""
        return np.asarray(self.effective_mass.sum(axis=0))


def measured(
    held: Interior, values: Real, modes: Array, matrices: dict[str, Array], *, weigh: bool = True
) -> Quality:
    """Measure a reduction.

    A mode (λ, y) of the reduced model, ψ = T y in the full one, leaves the forces r = K ψ − λ M ψ on the
    rest, which the modes left out would balance: its λ is too high by rᴴ (K − λ M)⁻¹ r, and (K − λ M)⁻¹ is
    at most K⁻¹ / (1 − λ / ω_m²) for what is orthogonal to the modes kept, ω_m the highest of them.
    """
    lambdas, shapes = _modes(matrices)
    rigid = rigid_body_modes(lambdas)
    errors = _errors(held, values, modes, lambdas, shapes)
    errors[:rigid] = 0.0
    hertz = np.sqrt(np.maximum(lambdas, 0.0)) / (2.0 * math.pi)
    bad = np.flatnonzero(errors > GOOD)
    last = int(bad[0]) - 1 if bad.size else errors.size - 1
    return Quality(
        held_hz=np.sqrt(np.maximum(values, 0.0)) / (2.0 * math.pi),
        effective_mass=_effective_mass(held, modes) if weigh else np.zeros((modes.shape[1], 0)),
        system_hz=hertz,
        system_error=errors,
        good_to_hz=float(hertz[last]) if last >= 0 else 0.0,
        static_residual=held.residual,
        rigid_body_modes=rigid,
        shift_hz=math.sqrt(-held.shift) / (2.0 * math.pi),
    )


def _modes(matrices: dict[str, Array]) -> tuple[Real, Array]:
    """λ, ascending, and mass-normalised shapes of the reduced model."""
    try:
        lambdas, shapes = linalg.eigh(matrices["K"], matrices["M"])
    except np.linalg.LinAlgError as error:
        least = float(linalg.eigvalsh(matrices["M"])[0])
        raise ValueError(
            f"`M` must be positive definite on the motions kept, got {least:g}: a DOF named has no mass"
        ) from error
    return np.asarray(lambdas), np.asarray(shapes)


def _errors(held: Interior, values: Real, modes: Array, lambdas: Real, shapes: Array) -> Real:
    kept = held.follow.shape[1]
    errors = np.full(lambdas.size, math.inf)
    if not held.K.shape[0] or values.size == held.K.shape[0]:
        return np.zeros(lambdas.size)
    if not values.size:
        return errors
    low = np.flatnonzero((lambdas > 0.0) & (lambdas < values[-1]))
    top = shapes[:kept, low]
    inside = held.follow @ top + modes @ shapes[kept:, low]
    forces = held.K @ inside + held.couplings["K"] @ top
    forces -= lambdas[low] * (held.M @ inside + held.couplings["M"] @ top)
    # Rounding leaves a share of the modes kept, which the inverse would enlarge where one is near zero.
    forces -= held.M @ (modes @ (modes.conj().T @ forces))
    raised = np.einsum("ij,ij->j", forces.conj(), held.solve(forces)).real / (1.0 - lambdas[low] / values[-1])
    errors[low] = np.abs(raised) / (2.0 * lambdas[low])
    errors[lambdas <= 0.0] = 0.0
    return errors


def _effective_mass(held: Interior, modes: Array) -> Real:
    """Shares of fᴴ M⁻¹ f, f = M ψ + m, which is ψᴴ M ψ + 2 Re ψᴴ m + mᴴ M⁻¹ m, of which the last is local.

    m has few rows, and the inverse of a mass fades fast away from them: it is solved for on those and some
    neighbours. Rows that an element has for itself may move without any mass: each is given very little.
    """
    follow, coupled = held.follow, held.couplings["M"]
    moved = held.M @ follow
    carried = np.abs(modes.conj().T @ (moved + coupled)) ** 2
    totals = np.einsum("ij,ij->j", follow.conj(), moved + 2.0 * coupled).real
    near, joined = np.any(coupled, axis=1), (held.M != 0).astype(np.float64)
    for _ in range(_NEIGHBOURS):
        near |= joined @ near > 0.0
    rows = np.flatnonzero(near)
    if rows.size:
        local, force = held.M[rows][:, rows], coupled[rows]
        size = np.abs(local.diagonal())
        solve = factor(csc_array(local + diags_array(_LITTLE * np.where(size > 0.0, size, size.max()))))
        totals += np.einsum("ij,ij->j", force.conj(), solve(force)).real
    return np.asarray(carried / np.where(totals > 0.0, totals, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reduced:
    """Matrices of the DOFs in use, in their order, followed by one coordinate for each mode kept."""

    matrices: Annotated[dict[str, Array], "M, K and, if there was one, C, each (n, n), Hermitian."]
    modes: Annotated[int, "Modes kept."]
    highest_hz: Annotated[float, "Frequency of the highest of them; 0 if there is none."]
    quality: Annotated[Quality, "What the reduction is good for."]
    basis: Annotated[
        Array | None, "The motions of the full model that the coordinates stand for, if asked for, (rows, n)."
    ] = None

    def facts(self, dofs: Sequence[str]) -> dict[str, Any]:
        """What was kept and what it is good for, for programs, with the names of the DOFs in use."""
        quality = self.quality
        return {
            "modes": self.modes, "highest_hz": self.highest_hz, "good_to_hz": quality.good_to_hz,
            "held_hz": quality.held_hz.tolist(), "static_residual": quality.static_residual,
            "mass_carried": dict(zip(dofs, quality.mass_carried.tolist(), strict=True)),
        }  # fmt: skip


def craig_bampton(
    M: Any,
    K: Any,
    C: Any | None,
    dofs: DofTable,
    keep_modes: int | None,
    *,
    up_to_hz: float | None = None,
    others: Mapping[str, coo_array] | None = None,
    weigh: bool = True,
    keep_basis: bool = False,
) -> Reduced:
    """Reduce a model onto the DOFs named and `keep_modes` modes of the rest, or all up to `up_to_hz` [Hz].

    Parameters
    ----------
    M, K, C : sparse (n, n), symmetric or Hermitian.
    others : matrices projected beside them, symmetric or not.
    weigh : whether to find the effective masses too, which takes solutions with M.
    keep_basis : whether the motions of the coordinates are asked for.

    Raises
    ------
    ValueError
        A row out of range, matrices that are not symmetric, too many DOFs to keep, or a rest that is not
        held in place by the DOFs named; the message says which and what to do.
    """
    n = M.shape[0]
    given = {"M": M, "K": K} | ({} if C is None else {"C": C})
    _check(given, dofs, n, keep_modes or 0)
    kept = np.array(dofs.rows)
    rest = np.setdiff1d(np.arange(n), kept)
    sparse = {key: csc_array(matrix) for key, matrix in given.items()}
    held = interior(sparse["K"], sparse["M"], rest, kept)
    values, modes = held_modes(held, keep_modes, up_to_hz)
    if kept.size + values.size > MOST_DOFS:
        raise ValueError(
            f"{values.size} modes up to {up_to_hz:g} Hz are more than {MOST_DOFS}: ask for fewer"
        )
    basis = np.zeros((n, kept.size + values.size), np.result_type(held.follow, modes))
    basis[kept, np.arange(kept.size)] = 1.0
    basis[rest, : kept.size] = held.follow
    basis[rest, kept.size :] = modes
    reduced = {key: basis.conj().T @ (matrix @ basis) for key, matrix in sparse.items()}
    matrices = {key: 0.5 * (value + value.conj().T) for key, value in reduced.items()}
    matrices |= {key: basis.conj().T @ (csc_array(matrix) @ basis) for key, matrix in (others or {}).items()}
    highest = math.sqrt(max(float(values[-1]), 0.0)) / (2.0 * math.pi) if values.size else 0.0
    return Reduced(
        matrices=matrices,
        modes=values.size,
        highest_hz=highest,
        quality=measured(held, values, modes, matrices, weigh=weigh),
        basis=basis if keep_basis else None,
    )


def _check(given: dict[str, Any], dofs: DofTable, n: int, keep_modes: int) -> None:
    for name, row in dofs.write().items():
        if row >= n:
            raise FieldError(("dofs",), f"`dofs`: {name!r} must have a row from 0 to {n - 1}, got {row}")
    if len(dofs) + keep_modes > MOST_DOFS:
        raise FieldError(
            ("dofs",),
            f"names {len(dofs)} DOFs, which with {keep_modes} modes is more than {MOST_DOFS}: "
            "name those that contacts, forces and the observed amplitude need",
        )
    for key, matrix in given.items():
        difference = abs(csc_array(matrix) - csc_array(matrix).conj().T)
        worst, largest = float(difference.max()), float(abs(matrix).max())
        if worst > ASYMMETRY * largest:
            triangle = one_triangle(coo_array(matrix))
            if triangle is not None:
                raise ValueError(f"`{key}` must be symmetric: {triangle}")
            raise ValueError(
                f"`{key}` must be symmetric to {ASYMMETRY:g} of its largest entry {largest:g}, got a "
                f"difference of {worst:g} from its transpose"
            )


WRITTEN = (".npz", ".mat")


def write_reduced(path: Path, reduced: Reduced, dofs: Sequence[str]) -> None:
    """Write M, K and maybe C, with the names of the rows and the frequencies of the modes kept.

    The arrays are ``M`` [kg], ``K`` [N/m], ``C`` [N s/m], ``names`` (DOFs in use, then ``mode1`` …),
    ``held_hz``, ``system_hz`` [Hz] and ``good_to_hz``.

    Raises
    ------
    ValueError
        A suffix that is not one of `WRITTEN`.
    OSError
        The file cannot be written.
    """
    names = [*dofs, *(f"mode{i}" for i in range(1, reduced.modes + 1))]
    quality = reduced.quality
    arrays = {
        **reduced.matrices,
        "held_hz": quality.held_hz,
        "system_hz": quality.system_hz,
        "good_to_hz": np.array(quality.good_to_hz),
    }
    suffix = path.suffix.lower()
    if suffix == ".npz":
        np.savez_compressed(path, allow_pickle=False, **arrays, names=np.array(names))
    elif suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {**arrays, "names": np.array(names, dtype=object)}, do_compression=True)
    else:
        raise ValueError(f"a reduced model is written to {' or '.join(WRITTEN)}, got {path.suffix!r}")
