"""A sector of a bladed disk as CalculiX reads it: disk, blade, and a shroud that touches its neighbours.

Bricks of 20 nodes on a grid in cylindrical coordinates, of which those outside the part are taken away; units
are m, kg, N, s. Into the folder it is run in it writes

- sector.inp, the mesh with its sets: LOW and HIGH, the boundaries of the disk to the sectors before and
  behind, and FOOT, its inner radius, which is held;
- matrices.inp, which stores stiffness and mass: `ccx matrices`;
- cyclic.inp, CalculiX's own analysis of the disk, for a comparison: `ccx cyclic`.
"""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import numpy as np

SECTORS = 24
PITCH = 2.0 * math.pi / SECTORS
# Radius [m], angle from the middle of the blade as a share of the pitch, and height [m] of the grid.
RADII = np.array([0.09, 0.13, 0.17, 0.20, 0.225, 0.25, 0.275, 0.30, 0.305])
ANGLES = PITCH * np.array([-0.5, -0.25, -0.04, 0.04, 0.25, 0.5])
HEIGHTS = np.array([0.0, 0.01, 0.02])
RIM, TIP = 0.20, 0.30  # m, where the disk ends and where the shroud begins
# Corners of a brick, then the middles of its edges, in the order of C3D20.
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
MIDDLES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
UPRIGHT = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]

Place = tuple[int, int, int]  # of a node on the grid with its middles


def halved(values: np.ndarray) -> np.ndarray:
    """The values with the middles between them."""
    return np.interp(np.arange(2 * values.size - 1) / 2.0, np.arange(values.size), values)


def bricks() -> list[list[Place]]:
    """The nodes of every brick of the part."""
    found = []
    for i, j, k in product(*(range(values.size - 1) for values in (RADII, ANGLES, HEIGHTS))):
        radius, angle = RADII[i : i + 2].mean(), abs(ANGLES[j : j + 2].mean())
        if RIM < radius < TIP and angle > 0.04 * PITCH:
            continue
        found.append([(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in CORNERS + MIDDLES + UPRIGHT])
    return found


def lines(numbers: list[int], width: int = 12) -> str:
    """Numbers in lines of a deck."""
    rows = [numbers[i : i + width] for i in range(0, len(numbers), width)]
    return ",\n".join(", ".join(map(str, row)) for row in rows) + "\n"


def main() -> None:
    """Mesh, number, write."""
    elements = bricks()
    places = sorted({place for element in elements for place in element})
    number = {place: i for i, place in enumerate(places, start=1)}
    r, angle, z = (halved(values) for values in (RADII, ANGLES, HEIGHTS))

    def nodes(inside: object) -> list[int]:
        return [number[p] for p in places if inside(r[p[0]], angle[p[1]])]  # type: ignore[operator]

    held, rim = r[0] + 1e-9, RIM + 1e-9
    sets = {
        "FOOT": nodes(lambda radius, _: radius < held),
        "LOW": nodes(lambda radius, at: held < radius < rim and at < angle[0] + 1e-9),
        "HIGH": nodes(lambda radius, at: held < radius < rim and at > angle[-1] - 1e-9),
    }
    text = "*NODE, NSET=ALL\n"
    for (i, j, k), node in number.items():
        text += f"{node}, {r[i] * math.cos(angle[j]):.12e}, {r[i] * math.sin(angle[j]):.12e}, {z[k]:.12e}\n"
    text += "*ELEMENT, TYPE=C3D20, ELSET=PART\n"
    for element, corners in enumerate(elements, start=1):
        text += lines([element, *(number[place] for place in corners)], 11)
    for name, members in sets.items():
        text += f"*NSET, NSET={name}\n{lines(members)}"
    text += "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.0\n"
    text += "*SOLID SECTION, ELSET=PART, MATERIAL=STEEL\n*BOUNDARY\nFOOT, 1, 3\n"
    Path("sector.inp").write_text(text)
    Path("matrices.inp").write_text(
        "*INCLUDE, INPUT=sector.inp\n*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*END STEP\n"
    )
    Path("cyclic.inp").write_text(
        "*INCLUDE, INPUT=sector.inp\n"
        "*SURFACE, NAME=FIRST, TYPE=NODE\nLOW\n*SURFACE, NAME=LAST, TYPE=NODE\nHIGH\n"
        "*TIE, NAME=JOIN, CYCLIC SYMMETRY, POSITION TOLERANCE=1e-6\nFIRST, LAST\n"
        f"*CYCLIC SYMMETRY MODEL, N={SECTORS}, NGRAPH=1, TIE=JOIN\n0.0, 0.0, 0.0, 0.0, 0.0, 1.0\n"
        "*STEP\n*FREQUENCY\n8\n"
        f"*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={SECTORS // 2}\n*END STEP\n"
    )
    print(f"{len(elements)} bricks, {len(places)} nodes, {3 * (len(places) - len(sets['FOOT']))} rows")
    tip, end, top = 2 * RADII.size - 2, angle.size - 1, z.size - 1
    named = {"tip": (tip, angle.size // 2, 2)}
    named |= {"ahead": (tip - 2, end, 0), "ahead above": (tip - 2, end, top)}
    named |= {"behind": (tip - 2, 0, 0), "behind above": (tip - 2, 0, top)}
    for name, (i, j, k) in named.items():
        x, y = r[i] * math.cos(angle[j]), r[i] * math.sin(angle[j])
        print(f"{name:12} node {number[i, j, k]} at {x:.5f}, {y:.5f}, {z[k]:.5f} m")


if __name__ == "__main__":
    main()
