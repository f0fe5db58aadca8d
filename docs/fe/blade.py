"""Mass and stiffness of a small steel blade with a platform, made by scikit-fem.

Solid elements with 27 nodes. A shank, clamped at its foot, carries a platform and the airfoil, a thin plate;
x is the radius, y the thickness, z the chord. blade-M.npz, blade-K.npz and blade.dof, which names the rows,
appear in the folder it is run in.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import csr_array, save_npz
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, MeshHex
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0  # steel: N/m², -, kg/m³
SHANK, PLATFORM, TIP = 0.04, 0.045, 0.135  # m, where each ends along the radius
HALF_AIRFOIL, HALF_SHANK, HALF_PLATFORM, CHORD = 0.0015, 0.003, 0.015, 0.03  # m


def mesh() -> MeshHex:
    """A regular grid of bricks, of which those outside the blade are taken away."""
    x = np.concatenate([np.linspace(0.0, SHANK, 4), np.linspace(PLATFORM, TIP, 10)])
    y = np.array([-HALF_PLATFORM, -HALF_SHANK, -HALF_AIRFOIL, HALF_AIRFOIL, HALF_SHANK, HALF_PLATFORM])
    grid = MeshHex.init_tensor(x, y, np.linspace(0.0, CHORD, 3))
    radius, thickness = np.abs(grid.p[:2, grid.t].mean(axis=1))
    half = np.where(radius < SHANK, HALF_SHANK, np.where(radius < PLATFORM, HALF_PLATFORM, HALF_AIRFOIL))
    return grid.remove_elements(np.flatnonzero(thickness > half))


def main() -> None:
    """Assemble, number the nodes, take away what is clamped, write."""
    basis = Basis(mesh(), ElementVector(ElementHex2()), intorder=5)  # exact for bricks
    K = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    M = BilinearForm(lambda u, v, _: DENSITY * dot(u, v)).assemble(basis)

    # scikit-fem keeps the three displacements of a node side by side. Nodes are numbered from 1 by x, y, z.
    places, node = np.unique(basis.doflocs.T.round(9), axis=0, return_inverse=True)
    direction = np.empty(node.size, dtype=int)
    order = np.argsort(node, kind="stable")
    direction[order] = np.tile([1, 2, 3], len(places))
    free = order[basis.doflocs[0, order] > 1e-9]

    for name, matrix in (("M", M), ("K", K)):
        save_npz(f"blade-{name}.npz", csr_array(matrix)[free][:, free])
    Path("blade.dof").write_text("".join(f"{node[i] + 1}.{direction[i]}\n" for i in free))

    def nearest(x: float, y: float, z: float) -> int:
        return int(np.argmin(((places - [x, y, z]) ** 2).sum(axis=1))) + 1

    print(f"{free.size} rows, {len(places)} nodes, {csr_array(M).sum() / 3.0:.4f} kg")
    print(f"tip       node {nearest(TIP, 0.0, CHORD / 2)}")
    print(f"foot      node {nearest(SHANK / 3, HALF_SHANK, CHORD / 2)}")
    print(f"platform  node {nearest(PLATFORM, HALF_PLATFORM, CHORD / 2)}")


if __name__ == "__main__":
    main()
