"""Frequencies of the disk at every nodal diameter: CalculiX's own, the full sector's, the reduced one's.

Reads what `ccx cyclic`, `ccx matrices` and `stickslip import` wrote into the folder it is run in.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from solver.matrices.load_set import read_set
from solver.matrices.sectors.loading import boundaries

SECTORS, FIRST = 24, 4


def of_calculix() -> dict[int, np.ndarray]:
    """The lowest frequencies [Hz] by nodal diameter; those between 0 and 12 stand twice."""
    number = r"\s+(-?\d\.\d+E[+-]\d+)"
    found: dict[int, list[float]] = {}
    for match in re.finditer(
        rf"^\s+(\d+)\s+\d+{number * 4}\s*$", Path("cyclic.dat").read_text(), re.MULTILINE
    ):
        found.setdefault(int(match[1]), []).append(float(match[4]))
    return {n: np.array(values[::2][:FIRST]) for n, values in found.items()}


def main() -> None:
    """Compare, and print the largest difference."""
    given = read_set({"M": Path("matrices.mas"), "K": Path("matrices.sti")})
    table = {"low": "LOW", "high": "HIGH", "nodes": "sector.inp"}
    gone = boundaries(table, given, SECTORS, Path()).elimination(given.matrices["M"].shape[0], SECTORS)
    M, K = (gone.of(csr_array(given.matrices[key])) for key in "MK")
    apart = reduced_apart = 0.0
    with np.load("disk-reduced.npz") as small:
        for n, theirs in of_calculix().items():
            full = eigh(K.at(n, SECTORS).toarray(), M.at(n, SECTORS).toarray(), eigvals_only=True)[:FIRST]
            ours = np.sqrt(full) / (2.0 * math.pi)
            kept = np.sqrt(eigh(small["K"][n], small["M"][n], eigvals_only=True)[:FIRST]) / (2.0 * math.pi)
            apart = max(apart, float(np.abs(ours / theirs - 1.0).max()))
            reduced_apart = max(reduced_apart, float(np.abs(kept / ours - 1.0).max()))
            print(f"nodal diameter {n:2}: {', '.join(f'{f:.4f}' for f in ours)} Hz")
    print(f"full sector and CalculiX differ by {apart:.1e}, reduced and full sector by {reduced_apart:.1e}")


if __name__ == "__main__":
    main()
