"""Coupled polynomial stiffness: quadratic and cubic tensors over several DOFs as polynomial springs.

The restoring force f_i = Σ Q_ijk x_j x_k + Σ C_ijkl x_j x_k x_l of a potential has symmetric tensors, and a
symmetric tensor is a sum of powers of linear forms, T = Σ_j a_j w_j ⊗ … ⊗ w_j (its Waring decomposition;
P. Comon et al., SIAM J. Matrix Anal. Appl. 30 (2008) 1254, doi:10.1137/060661569). So the force is that of
springs a_j u^(d−1) along the motions u = w_j · x: contacts of the law `polynomial`, of which balance,
Jacobian, second derivatives, march and stability are exact. The forms w are the points of the lattice
Σ w_i = d, w_i ≥ 0 whole, on the DOFs that entries join: no polynomial of degree d but 0 vanishes on all of
them, so the powers of these forms span every tensor.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations_with_replacement, permutations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solver.arrays import Real
from solver.errors import SceneError, SettingError

KEYS = {"quadratic": 3, "cubic": 4}
"""The tensors with their numbers of indices."""
_SYMMETRIC = 1e-6  # of the largest entry: less is what a file of seven digits leaves
_ROUNDING = 1e-12  # of the largest entry
_NONE = 1e-8  # of what its DOFs have alone, an entry that says nothing of their sizes
MOST = 2000  # springs


def tensor_springs(
    name: str, dofs: Sequence[str], *, quadratic: ArrayLike | None = None, cubic: ArrayLike | None = None
) -> list[dict[str, Any]]:
    """Return the contacts of a scene that have the force of polynomial tensors.

    Parameters
    ----------
    name : begins their names, ``name-1``, ``name-2``, …
    dofs : the n DOFs, in the order of the indices.
    quadratic : (n, n, n) Q_ijk [N/m²] of f_i = Σ Q_ijk x_j x_k on the left-hand side.
    cubic : (n, n, n, n) C_ijkl [N/m³] likewise.

    Raises
    ------
    SettingError
        A tensor of another shape, not finite, not that of a potential, or with too many entries.
    """
    given = {
        key: _symmetric(key, tensor, len(dofs))
        for key, tensor in (("quadratic", quadratic), ("cubic", cubic))
        if tensor is not None
    }
    given = {key: tensor for key, tensor in given.items() if np.any(tensor)}
    if not given:
        return []
    scale = _scale(given.values(), len(dofs))
    scaled = {key: _scaled(tensor, scale) for key, tensor in given.items()}
    forms = _forms(scaled.values(), max(tensor.ndim for tensor in scaled.values()))
    powers = {f"a{tensor.ndim - 1}": _coefficients(tensor, forms) for tensor in scaled.values()}
    found: list[dict[str, Any]] = []
    for j, form in enumerate(forms):
        motion = {dof: float(w / s) for dof, w, s in zip(dofs, form, scale, strict=True) if w}
        numbers = {key: float(a[j]) for key, a in powers.items() if a[j]}
        if numbers:
            named = {"name": f"{name}-{len(found) + 1}", "law": "polynomial"}
            ends = (*motion, "ground")[:2]
            found.append({**named, "between": list(ends), "motions": [motion], **numbers})
    return found


def _symmetric(key: str, given: ArrayLike, n: int) -> Real:
    """The tensor with all indices alike; those behind the first are free to be written in any order."""
    order = KEYS[key]
    try:
        tensor = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise SettingError(key, given, "must be a list of lists of numbers") from error
    if tensor.size != n**order or not np.all(np.isfinite(tensor)):
        shape = " x ".join(str(each) for each in tensor.shape)
        raise SettingError(key, shape, f"must have {' x '.join([str(n)] * order)} finite numbers")
    tensor = tensor.reshape((n,) * order)
    behind = _mean(tensor, ((0, *rest) for rest in permutations(range(1, order))))
    whole = _mean(behind, permutations(range(order)))
    apart = np.abs(behind - whole)
    if apart.max(initial=0.0) > _SYMMETRIC * np.abs(whole).max(initial=0.0):
        worst = tuple(int(i) for i in np.unravel_index(int(np.argmax(apart)), apart.shape))
        wanted = "must be that of a potential: the derivative of force i by x_j that of force j by x_i, not"
        raise SettingError(key, f"entry {list(worst)}", f"{wanted} {behind[worst]:g} beside {whole[worst]:g}")
    return whole


def _mean(tensor: Real, orders: Iterable[tuple[int, ...]]) -> Real:
    return np.asarray(np.mean([np.transpose(tensor, each) for each in orders], axis=0))


def _scale(tensors: Iterable[Real], n: int) -> Real:
    """A size of each DOF (n,), in units of which the entries of a tensor are as alike as can be.

    The least squares of their logarithms, as A. R. Curtis, J. K. Reid, J. Inst. Math. Appl. 10 (1972) 118
    scale matrices; what they leave open are equal sizes. Rounding of 0 does not count.
    """
    given, rows, wanted = list(tensors), [], []
    for at, tensor in enumerate(given):
        order = tensor.ndim
        alone = np.abs([tensor[(i,) * order] for i in range(n)]) ** (1.0 / order)
        for place in combinations_with_replacement(range(n), order):
            size = abs(float(tensor[place]))
            if size > _NONE * float(np.prod(alone[list(place)])):
                rows.append(np.concatenate([np.bincount(place, minlength=n), -np.eye(len(given))[at]]))
                wanted.append(-math.log(size))
    return np.asarray(np.exp(np.linalg.lstsq(np.array(rows), np.array(wanted))[0][:n]))


def _scaled(tensor: Real, scale: Real) -> Real:
    for axis in range(tensor.ndim):
        tensor = tensor * scale.reshape([-1 if axis == i else 1 for i in range(tensor.ndim)])
    return tensor


def _forms(tensors: Iterable[Real], degree: int) -> Real:
    """The linear forms (m, n): lattices on the DOFs that entries join."""
    n, joined = 0, set[frozenset[int]]()
    for tensor in tensors:
        n = len(tensor)
        least = _ROUNDING * np.abs(tensor).max()
        joined |= {frozenset(map(int, place)) for place in np.argwhere(np.abs(tensor) > least)}
    found: dict[tuple[int, ...], None] = {}
    for support in (each for each in joined if not any(each < other for other in joined)):
        for steps in combinations_with_replacement(sorted(support), degree):
            weights = np.bincount(steps, minlength=n)
            found[tuple((weights // math.gcd(*weights.tolist())).tolist())] = None
            if len(found) > MOST:
                wanted = f"must need at most {MOST} springs: give fewer DOFs, or leave out entries that are 0"
                raise SettingError("tensors", len(found), wanted)
    forms = np.array(sorted(found, reverse=True), dtype=np.float64)
    return np.asarray(forms / np.linalg.norm(forms, axis=1)[:, None])


def _coefficients(tensor: Real, forms: Real) -> Real:
    """Return a (m,) with Σ_j a_j w_j ⊗ … ⊗ w_j = T, the least such numbers."""
    order, n = tensor.ndim, len(tensor)
    places = list(combinations_with_replacement(range(n), order))
    weight = np.sqrt([len(set(permutations(place))) for place in places])
    rows = np.array([np.prod(forms[:, list(place)], axis=1) for place in places])
    wanted = np.array([tensor[place] for place in places])
    found = np.linalg.lstsq(rows * weight[:, None], wanted * weight)[0]
    return np.where(np.abs(found) > _ROUNDING * np.abs(found).max(initial=0.0), found, 0.0)


def with_tensors(raw: Mapping[str, object], folder: Path) -> dict[str, object]:
    """Return the tables of a scene with its ``[[tensors]]`` as contacts.

    Parameters
    ----------
    folder : where relative names of files begin.

    Raises
    ------
    SceneError
        A file that cannot be read, or a tensor that cannot be used; the pointer is that of the table.
    """
    rest = {key: value for key, value in raw.items() if key != "tensors"}
    rows = raw.get("tensors", [])
    contacts = list(rest.get("contacts", []))  # type: ignore[call-overload]
    for i, row in enumerate(rows if isinstance(rows, list) else [rows]):
        place = ("tensors", i) if isinstance(rows, list) else ("tensors",)
        known = {"name", "dofs", "file", *KEYS}
        if not isinstance(row, Mapping) or not {"name", "dofs"} <= set(row) <= known:
            keys = "`name`, `dofs` and `file`, or `quadratic` and `cubic` in its place"
            raise SceneError.of(place, f"must be a table with {keys}, got {row!r}", named=False)
        try:
            tensors = {key: row[key] for key in KEYS if key in row}
            tensors |= _read(folder / str(row["file"])) if "file" in row else {}
            contacts += tensor_springs(str(row["name"]), row["dofs"], **tensors)
        except SettingError as error:
            raise SceneError([error.issue.at(*place)]) from error
    return {**rest, "contacts": contacts} if rows else rest


def _read(path: Path) -> dict[str, Any]:
    """The tensors in a file (.npz, .json or .mat) by their keys."""
    try:
        if path.suffix == ".json":
            found = json.loads(path.read_text(encoding="utf-8"))
        elif path.suffix == ".mat":
            from scipy.io import loadmat

            found = loadmat(path)
        else:
            with np.load(path, allow_pickle=False) as arrays:
                found = {key: arrays[key] for key in arrays.files}
    except (OSError, ValueError, NotImplementedError) as error:
        raise SettingError("file", str(path), f"must be a .npz, .json or .mat file: {error}") from error
    tensors = {key: found[key] for key in KEYS if key in found} if isinstance(found, dict) else {}
    if not tensors:
        raise SettingError("file", str(path), f"must have arrays named {' or '.join(KEYS)}")
    return tensors
