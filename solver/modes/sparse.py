"""Matrices of structures most of whose entries are 0: their factors, and Newton steps without a full matrix.

A Newton step of the condensed equations, J δ = r over the motions w of the contacts, is that of the motions x
of all coordinates: with δw = r_w + L δx and δq = r_q + (M b)ᴴ δx_1

  (Z + Lᴴ G L) δx − p_ω δω − p_ζ δζ = ρ M b r_q − Lᴴ G r_w,   Re cᴴ δx = r

for the two functionals c of the last residuals: neither the inverse of Z nor the full J is formed. What
carries a mode cancels: the matrix is of Z itself, which may be singular alone. Of nodes that follow one
another the factors of SuperLU (Li, ACM Trans. Math. Softw. 31 (2005) 302, doi:10.1145/1089014.1089017) grow
in proportion to their number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_array, coo_array, csc_array, csr_array, eye_array, kron
from scipy.sparse.linalg import SuperLU, splu

from solver.jit.fourier import Complex, Integer, Real, cosine_position
from solver.scene.scene_harmonics import Amplitudes

SPARSE_FROM = 128  # coordinates: a step of a chain with 97 costs as much either way, one with 181 less
SPARSE = 0.05  # share of the entries that are not 0, up to which they are kept alone


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pattern:
    """Where matrices have entries, (L,) rows and columns; `size` is N."""

    rows: Integer
    columns: Integer
    size: int

    @classmethod
    def of(cls, *matrices: Complex) -> Pattern | None:
        """Return the pattern of matrices (nk, N, N); None where it is small or has too many entries."""
        size = matrices[0].shape[-1]
        if size < SPARSE_FROM:
            return None
        rows, columns = np.nonzero(np.any([np.any(each != 0.0, axis=0) for each in matrices], axis=0))
        few = rows.size <= SPARSE * size**2
        return cls(rows=rows, columns=columns, size=size) if few else None

    def entries(self, matrices: Complex) -> Complex:
        """Return the entries (nk, L) of matrices (nk, N, N)."""
        return np.ascontiguousarray(matrices[:, self.rows, self.columns])

    def matrix(self, entries: Complex) -> coo_array:
        """Return a matrix of entries (L,)."""
        return coo_array((entries, (self.rows, self.columns)), shape=(self.size, self.size))

    def times(self, entries: Complex, x: Complex) -> Complex:
        """Return the product of each harmonic's matrix, (nk, L), with x (…, nk, N)."""
        found = np.empty(x.shape, np.complex128)
        starts = np.searchsorted(self.rows, np.arange(self.size + 1))  # entries come row by row
        for i, own in enumerate(entries):
            matrix = csr_array((own, self.columns, starts), shape=(self.size, self.size))
            found[..., i, :] = (matrix @ x[..., i, :].reshape(-1, self.size).T).T.reshape(
                found[..., i, :].shape
            )
        return found


class Factors:
    """Factors of Z + ρ (M b)(M b)ᴴ, the second in harmonic `first`, of entries Z (nk, L); or LinAlgError."""

    def __init__(self, pattern: Pattern, Z: Complex, first: int, rho: complex, b: Complex) -> None:
        self.Z, self._size = Z, pattern.size
        matrices = [pattern.matrix(own).tocsc() for own in Z]
        # With q = (M b)ᴴ x as one more unknown the product of the two vectors, a full matrix, is not formed.
        column, row = csc_array(rho * b[:, None]), csc_array(-b.conj()[None, :])
        matrices[first] = block_array([[matrices[first], column], [row, eye_array(1)]], format="csc")
        self._matrices, self._factors = matrices, [factorised(each) for each in matrices]

    def solve(self, phi: Complex, how: str = "N") -> Complex:
        """Return the solutions (…, nk, N) of φ; `how` H: of the adjoint matrices."""
        found = np.empty(phi.shape, np.complex128)
        for i, (factors, matrix) in enumerate(zip(self._factors, self._matrices, strict=True)):
            given = np.zeros((factors.shape[0], phi[..., i, 0].size), np.complex128)
            given[: self._size] = phi[..., i, :].reshape(-1, self._size).T
            there = factors.solve(given, trans=how)
            # Once more for what is left: a damping ratio of 1e-3 beside stiff springs keeps 12 digits, not 9.
            left = given - (matrix if how == "N" else matrix.conj().T) @ there
            there = (there + factors.solve(left, trans=how))[: self._size]
            found[..., i, :] = there.T.reshape(found[..., i, :].shape)
        return found


def factorised(matrix: Any) -> SuperLU:
    """Return the factors of a matrix; raises LinAlgError if it is singular."""
    try:
        return splu(matrix)
    except RuntimeError as error:
        raise np.linalg.LinAlgError(str(error)) from error


def real_form(ks: Integer, rows: Integer, columns: Integer, entries: Complex, shape: tuple[int, int]) -> Any:
    """Return complex matrices of amplitudes, (nk, L) entries, as one that acts on real coefficients.

    Those of a row or column stand together, v̂ = v_c − i v_s.
    """
    n, parts = int(2 * ks.size - (ks[0] == 0)), []
    for i, own in enumerate(entries):
        here = int(cosine_position(ks, i))
        r, c = rows * n + here, columns * n + here
        parts.append((r, c, own.real))
        if ks[i] > 0:
            parts += [(r, c + 1, own.imag), (r + 1, c, -own.imag), (r + 1, c + 1, own.real)]
    r, c, values = (np.concatenate(each) for each in zip(*parts, strict=True))
    return coo_array((values, (r, c)), shape=(shape[0] * n, shape[1] * n)).tocsc()


class Layout:
    """What of the real matrices of Newton steps does not change from point to point.

    Parameters
    ----------
    contact : (nk, r, N) motions of the leading ports.
    places : (nb, 3) row port, column port and number of every block of slopes.
    span : (nc, r) motions of all ports by the leading ones; None where every port leads itself.
    """

    def __init__(
        self, pattern: Pattern, hat: Amplitudes, contact: Complex, places: Integer, span: Real | None, n: int
    ) -> None:
        self.pattern, self.hat = pattern, hat
        rows, columns = np.nonzero(np.any(contact != 0.0, axis=0))
        self.L = real_form(hat.ks, rows, columns, contact[:, rows, columns], contact.shape[1:])
        self._places, self._span = places, None if span is None else kron(csc_array(span), eye_array(n))
        self._ports, self._n = contact.shape[1] if span is None else span.shape[0], n

    def slopes(self, G: Real) -> Any:
        """Return dF/dw less the shift, (r n, r n), of blocks (·, n, n)."""
        each = np.arange(self._n)
        blocks = G[self._places[:, 2]]
        rows = self._places[:, 0, None, None] * self._n + each[:, None]
        columns = self._places[:, 1, None, None] * self._n + each
        where = [np.broadcast_to(one, blocks.shape).reshape(-1) for one in (rows, columns)]
        size = self._ports * self._n
        found = coo_array((blocks.reshape(-1), (where[0], where[1])), shape=(size, size)).tocsc()
        return found if self._span is None else self._span.T @ found @ self._span

    def reach(self, factors: Factors) -> Real:
        """Return how far forces of size 1 with signs by chance move the ports of each harmonic, (r n,)."""
        signs = np.where(np.random.default_rng(0).random(self.L.shape[0]) < 0.5, -1.0, 1.0)
        pushed = self.hat.of((self.L.T @ signs).reshape(self.pattern.size, -1)).T
        moved = np.abs(self.L @ self.coefficients(factors.solve(pushed))).reshape(-1, self._n)
        return np.broadcast_to(moved.max(axis=0, initial=0.0), moved.shape).reshape(-1)

    def coefficients(self, x: Complex) -> Real:
        """Return the coefficients of coordinates x (…, nk, N), (…, N n)."""
        found = self.hat.coefficients(np.swapaxes(x, -1, -2))
        return found.reshape(*found.shape[:-2], -1)


class SparseJacobian:
    """The Jacobian of a nonlinear mode at a point, never formed.

    Parameters
    ----------
    factors : of Z at the point.
    G : (·, n, n) blocks of the slopes of the contact forces.
    pushes, rows : (3, nk, N) as in `solver.modes.mode_equations`.
    """

    def __init__(self, layout: Layout, factors: Factors, G: Real, pushes: Complex, rows: Complex) -> None:
        self._layout, self._factors = layout, factors
        self._slopes = layout.slopes(G)
        self._pushes, self._rows = pushes.copy(), rows.copy()

    def step(self, rhs: Real, pulls: Real, border: Real | None = None) -> Real | None:
        """Solve J δ = rhs; None if J is singular.

        Parameters
        ----------
        rhs : (m,), or (m + 1,) with a border.
        pulls : (g, m) p, each of a missing slope p pᵀ.
        border : (m + 1,) a further row over the unknowns and ln a, by which the last residual falls.
        """
        layout, own = self._layout, self._factors
        L, n_motions = layout.L, layout.L.shape[0]
        pattern, r_w, r_q = layout.pattern, rhs[:n_motions], rhs[n_motions : n_motions + 2]
        size = (pattern.size, pattern.size)
        push, by_omega, by_last = layout.coefficients(self._pushes)
        turned = layout.coefficients(1j * self._pushes[0])
        q_rows = layout.coefficients(np.stack([self._rows[0], 1j * self._rows[0]]))
        functionals = layout.coefficients(self._rows[1:])
        right = push * r_q[0] + turned * r_q[1] - L.T @ (self._slopes @ r_w)
        loose = pulls[:, :n_motions]
        columns, rows = [-by_omega, -by_last, *(loose @ L)], [*functionals, *(loose @ L)]
        rest = [*rhs[n_motions + 2 : n_motions + 4], *-(loose @ r_w)]
        corner = np.diag([0.0, 0.0, *-np.ones(len(loose))])
        if border is not None:
            rows.append(border[:n_motions] @ L + border[-5:-3] @ q_rows)
            columns.append(np.zeros(right.size))
            rest.append(rhs[-1] - border[:n_motions] @ r_w - border[-5:-3] @ r_q)
            corner = np.pad(corner, (0, 1))
            corner[1, -1], corner[-1, :2], corner[-1, -1] = -1.0, border[-3:-1], border[-1]
        Z = real_form(layout.hat.ks, pattern.rows, pattern.columns, own.Z, size) + L.T @ self._slopes @ L
        whole = block_array(
            [[Z, csc_array(np.stack(columns, 1))], [csc_array(np.stack(rows)), csc_array(corner)]],
            format="csc",
        )
        try:
            found = factorised(whole).solve(np.concatenate([right, rest]))
        except np.linalg.LinAlgError:
            return None
        x, others = found[: right.size], found[right.size :]
        ends = others[:2] if border is None else others[[0, 1, -1]]
        move = np.concatenate([r_w + L @ x, r_q + q_rows @ x, ends])
        return move if np.all(np.isfinite(move)) else None

    def whole(self) -> Real:
        """Return J, (m, m)."""
        layout, hat = self._layout, self._layout.hat
        L, n_motions = layout.L, layout.L.shape[0]
        others = np.stack([self._pushes[0], 1j * self._pushes[0], *self._pushes[1:]])
        pushed = np.column_stack([-(L.T @ self._slopes).toarray(), layout.coefficients(others).T])
        amplitudes = hat.of(pushed.T.reshape(n_motions + 4, layout.pattern.size, -1))
        x = layout.coefficients(self._factors.solve(np.swapaxes(amplitudes, 1, 2))).T
        seen = layout.coefficients(np.stack([self._rows[0], 1j * self._rows[0], *-self._rows[1:]]))
        J: Real = -np.vstack([L @ x, seen @ x])
        J[np.diag_indices(n_motions + 2)] += 1.0
        return J
