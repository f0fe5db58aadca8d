"""Mass and stiffness of a steel blade whose platform rubs with a whole face, and the deck that has the face.

Bricks with eight nodes, made by scikit-fem. A shank, clamped at its foot, carries a platform and the airfoil;
x is the radius, y the thickness, z the chord. face-M.npz, face-K.npz, face.dof, which names the rows, and
face.inp, which has the nodes and the set FACE, one side of the platform, appear in the folder it is run in.

    python docs/fe/face.py [--fine | --finer]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array, save_npz
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, MeshHex
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0  # steel: N/m², -, kg/m³
SHANK, PLATFORM, TIP = 0.04, 0.045, 0.135  # m, where each ends along the radius
HALF_AIRFOIL, HALF_SHANK, HALF_PLATFORM, CHORD = 0.0015, 0.003, 0.015, 0.03  # m
SIZES = {"": (4, 2, 12, 6), "--fine": (10, 3, 36, 13), "--finer": (10, 4, 36, 19)}
"""Bricks along shank, platform and airfoil and along the chord: 21, 56 and 100 nodes on the face."""


def mesh(shank: int, platform: int, airfoil: int, chord: int) -> MeshHex:
    """A regular grid of bricks, of which those outside the blade are taken away."""
    along = ((0.0, SHANK, shank), (SHANK, PLATFORM, platform), (PLATFORM, TIP, airfoil))
    x = np.unique(np.concatenate([np.linspace(begin, end, bricks + 1) for begin, end, bricks in along]))
    half = np.array([0.0, HALF_AIRFOIL, HALF_SHANK, 0.5 * HALF_PLATFORM, HALF_PLATFORM])
    grid = MeshHex.init_tensor(x, np.unique([half, -half]), np.linspace(0.0, CHORD, chord + 1))
    radius, thickness = np.abs(grid.p[:2, grid.t].mean(axis=1))
    most = np.where(radius < SHANK, HALF_SHANK, np.where(radius < PLATFORM, HALF_PLATFORM, HALF_AIRFOIL))
    return grid.remove_elements(np.flatnonzero(thickness > most))


def write(folder: Path, bricks: tuple[int, int, int, int]) -> tuple[int, int, int]:
    """Write the files; return how many rows, nodes and nodes of the face there are."""
    made = mesh(*bricks)
    basis = Basis(made, ElementVector(ElementHex1()))
    K = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    M = BilinearForm(lambda u, v, _: DENSITY * dot(u, v)).assemble(basis)
    free = np.flatnonzero(basis.doflocs[0] > 1e-9)  # the three displacements of a node stand side by side
    for name, matrix in (("M", M), ("K", K)):
        save_npz(folder / f"face-{name}.npz", csr_array(matrix)[free][:, free])
    (folder / "face.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in free))
    places = made.p.T
    side = np.flatnonzero(np.isclose(places[:, 1], HALF_PLATFORM))
    deck = ["*NODE", *(f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(places, 1))]
    deck += ["*NSET, NSET=FACE", *(f"{i + 1}" for i in side)]
    tip = ((places - [TIP, HALF_AIRFOIL, CHORD]) ** 2).sum(axis=1).argmin() + 1
    deck += ["*NSET, NSET=TIP", f"{tip}", ""]
    (folder / "face.inp").write_text("\n".join(deck))
    print(f"{free.size} rows, {len(places)} nodes, {side.size} of them on the face, tip is node {tip}")
    return free.size, len(places), side.size


if __name__ == "__main__":
    write(Path(), SIZES["".join(sys.argv[1:])])
