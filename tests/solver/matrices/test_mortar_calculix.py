"""Two blocks whose meshes do not match, pressed together: CalculiX's contact of surfaces is the referee.

Its own matrices are joined by the mortar weights here, with stiff springs at every point, so that only the
contact is compared. Loads are small, as CalculiX's contact is geometrically nonlinear.
"""

from __future__ import annotations

import itertools
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from solver.matrices.load_set import read_set
from solver.matrices.mortar import mortar
from solver.matrices.sectors.loading import read_deck

STIFF = 1e8  # N/m³, beside 1e3 N/m² of the blocks
BLOCK = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def block(across: int, low: float, first: int) -> tuple[dict[int, tuple[float, ...]], dict[int, list[int]]]:
    """Nodes and bricks of a block 1 x 1 x 0.5 with its lower face at a height."""
    grid = list(itertools.product(range(3), range(across + 1), range(across + 1)))
    number = {place: first + i for i, place in enumerate(grid)}
    nodes = {number[k, j, i]: (i / across, j / across, low + 0.25 * k) for k, j, i in grid}
    cells = itertools.product(range(2), range(across), range(across))
    bricks = [[number[k + c, j + b, i + a] for a, b, c in BLOCK] for k, j, i in cells]
    return nodes, {first + i: brick for i, brick in enumerate(bricks)}


class Pair:
    """The decks of two blocks, the upper one pressed unevenly on the lower."""

    def __init__(self, below: int, above: int) -> None:
        (self.low, low_bricks), (self.up, up_bricks) = block(below, -0.5, 1), block(above, 0.0, 1001)
        self.nodes, self.bricks = self.low | self.up, low_bricks | up_bricks
        self.faces = [[n for n, at in part.items() if at[2] == 0.0] for part in (self.up, self.low)]
        self.top = [n for n, at in self.up.items() if at[2] == 0.5]
        self.load = {
            n: -0.025 * (1.0 + 0.8 * self.up[n][0] + 0.5 * self.up[n][1]) / len(self.top) for n in self.top
        }

    def deck(self, step: str) -> str:
        """Nodes, elements, sets, material, what is held, and a step."""
        foot = [n for n, at in self.low.items() if at[2] == -0.5]
        rows = ["*NODE", *(f"{n},{x},{y},{z}" for n, (x, y, z) in self.nodes.items())]
        rows += ["*ELEMENT,TYPE=C3D8,ELSET=E"]
        rows += [f"{e},{','.join(map(str, nodes))}" for e, nodes in self.bricks.items()]
        for name, nodes in (("FOOT", foot), ("TOP", self.top)):
            rows += [f"*NSET,NSET={name}", *(f"{n}," for n in nodes)]
        rows += [
            "*MATERIAL,NAME=M",
            "*ELASTIC",
            "1000.,0.3",
            "*DENSITY",
            "1.",
            "*SOLID SECTION,ELSET=E,MATERIAL=M",
        ]
        rows += ["*BOUNDARY", "FOOT,1,3", "TOP,1,2"]
        return "\n".join([*rows, step, "*END STEP", ""])

    def contact(self) -> str:
        """A static step with CalculiX's contact of surfaces."""
        rows = []
        for name, face, nodes in (("FIRST", "S1", self.faces[0]), ("SECOND", "S2", self.faces[1])):
            at = slice(0, 4) if face == "S1" else slice(4, 8)
            touching = [e for e, brick in self.bricks.items() if set(brick[at]) <= set(nodes)]
            rows += [f"*SURFACE,NAME={name},TYPE=ELEMENT", *(f"{e},{face}" for e in touching)]
        rows += ["*SURFACE INTERACTION,NAME=I", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", f"{STIFF}"]
        rows += [
            "*CONTACT PAIR,INTERACTION=I,TYPE=SURFACE TO SURFACE",
            "FIRST,SECOND",
            "*STEP",
            "*STATIC",
            "*CLOAD",
        ]
        rows += [f"{n},3,{force}" for n, force in self.load.items()]
        return "\n".join([*rows, "*NODE PRINT,NSET=TOP", "U"])


def run(name: str, text: str) -> None:
    Path(f"{name}.inp").write_text(text)
    subprocess.run(["ccx", name], capture_output=True, timeout=100, check=False)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")
@pytest.mark.parametrize(("below", "above", "near"), [(4, 4, 2e-6), (3, 4, 6e-3), (6, 8, 6e-4)])
def test_blocks_sink_in_as_in_calculix(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, below: int, above: int, near: float
) -> None:
    """To the digits it prints where meshes match, as far as the meshes go where they do not."""
    monkeypatch.chdir(tmp_path)
    pair = Pair(below, above)
    run("matrices", pair.deck("*STEP\n*FREQUENCY,SOLVER=MATRIXSTORAGE\n2"))
    run("contact", pair.deck(pair.contact()))
    lines = (line.split() for line in Path("contact.dat").read_text().splitlines())
    truth = {int(words[0]): float(words[3]) for words in lines if len(words) == 4 and words[0].isdigit()}
    assert set(truth) == set(pair.top)

    found = read_set({"K": Path("matrices.sti"), "M": Path("matrices.mas")})
    row = {str(label): i for i, label in enumerate(found.labels or ())}
    K, force = found.matrices["K"].toarray(), np.zeros(len(row))
    for node, push in pair.load.items():
        force[row[f"{node}.UZ"]] = push
    joined = mortar(read_deck(Path("matrices.inp"), elements=True), *pair.faces, (0.0, 0.0, -1.0))
    L = np.zeros((len(joined.nodes), len(row)))
    for i, (node, weights) in enumerate(zip(joined.nodes, joined.weights, strict=True)):
        L[i, row[f"{node}.UZ"]] -= 1.0
        for other, weight in weights.items():
            L[i, row[f"{other}.UZ"]] += weight
    moved = np.linalg.solve(K + L.T @ (STIFF * joined.areas[:, None] * L), force)
    assert (L @ moved).min() > 0.0  # pressed everywhere
    largest = max(map(abs, truth.values()))
    assert max(abs(moved[row[f"{node}.UZ"]] - truth[node]) for node in pair.top) < near * largest
