"""Beams and files of matrices for the tests."""

from pathlib import Path
from typing import Any

import numpy as np

from solver.scene.scene import Scene

Array = np.ndarray


def beam(elements: int, length: float = 1.0, EI: float = 10.0, mass: float = 1.0) -> tuple[Array, Array]:
    """M and K of an Euler-Bernoulli cantilever: displacement and slope of each node but the clamped one."""
    h = length / elements
    k = EI / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    m = mass * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    M, K = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        M[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += m
        K[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += k
    return M[2:, 2:], K[2:, 2:]


def inline(M: Array, K: Array, dofs: dict[str, int]) -> dict[str, Any]:
    """A scene with matrices inline, a contact at the first DOF named and the force at the second."""
    first, second = list(dofs)[:2]
    return {
        "name": "inline",
        "structure": {"kind": "matrices", "M": M.tolist(), "K": K.tolist(), "dofs": dofs},
        "contacts": [{"name": "c", "between": [first, "ground"], "kt": 20.0, "mu": 0.3, "N0": 2.0}],
        "excitation": {"dof": second, "amplitude": 3.0},
        "observe": {"dof": first, "band": [0.5, 10.0]},
    }


def beam_scene(elements: int, **structure: Any) -> Scene:
    """A cantilever rubbing at its tip, driven at the middle, with some damping."""
    raw = inline(*beam(elements), {"tip": 2 * elements - 2, "mid": elements - 2})
    raw["structure"] |= {"stiffness_proportional_damping": 1e-3, **structure}
    return Scene.from_dict(raw)


def write_scene(folder: Path) -> Path:
    """A scene of a beam with files beside it."""
    M, K = beam(4)
    np.savez(folder / "M.npz", M=M)
    np.savez(folder / "K.npz", K=K)
    path = folder / "scene.toml"
    path.write_text(
        'name = "files"\n[structure]\nkind = "matrices"\nM = "M.npz"\nK = "K.npz"\n'
        "stiffness_proportional_damping = 1e-3\ndofs = { tip = 6, mid = 2 }\n"
        '[[contacts]]\nname = "c"\nbetween = ["tip", "ground"]\nkt = 20.0\nmu = 0.3\nN0 = 2.0\n'
        '[excitation]\ndof = "mid"\namplitude = 3.0\n[observe]\ndof = "tip"\nband = [0.5, 10.0]\n'
    )
    return path


def chain_raw() -> dict[str, Any]:
    """Three masses in a row with two contacts, one of which opens."""
    return {
        "name": "chain",
        "structure": {
            "kind": "lumped",
            "stiffness_proportional_damping": 2e-3,
            "masses": {"a": 1.0, "b": 0.7, "c": 0.4},
            "springs": [
                {"between": ["a", "ground"], "k": 180.0},
                {"between": ["a", "b"], "k": 120.0},
                {"between": ["b", "c"], "k": 100.0},
            ],
        },
        "contacts": [
            {"name": "one", "between": ["c", "ground"], "kt": 50.0, "mu": 0.3, "N0": 5.0, "N1": 6.0},
            {"name": "two", "between": ["a", "c"], "kt": 30.0, "mu": 0.3, "N0": 5.0},
        ],
        "excitation": {"dof": "b", "amplitude": 8.0},
        "observe": {"dof": "c", "band": [0.5, 4.0]},
    }


def hb_text(A: Array, kind: str, *, rutherford: bool = False, right_hand_side: bool = False) -> str:
    """A matrix in the Harwell-Boeing (or Rutherford-Boeing) format."""
    n = A.shape[0]
    pointers, rows, values = [1], [], []
    for column in range(n):
        start = column if kind[1] == "S" else 0
        for row in range(start, n):
            if A[row, column] != 0.0:
                rows.append(row + 1)
                values.append(A[row, column])
        pointers.append(len(rows) + 1)

    def section(items: list[str], count: int) -> list[str]:
        return ["".join(items[at : at + count]) for at in range(0, len(items), count)]

    parts = [
        section([f"{p:8d}" for p in pointers], 10),
        section([f"{r:8d}" for r in rows], 10),
        section([f"{v:26.17E}" for v in values], 3),
    ]
    counts = [len(part) for part in parts]
    lines = ["made for a test".ljust(72) + "TEST".ljust(8)]
    cards = [sum(counts) + right_hand_side, *counts, *([] if rutherford else [int(right_hand_side)])]
    lines.append("".join(f"{card:14d}" for card in cards))
    lines.append(kind.ljust(14) + "".join(f"{x:14d}" for x in (n, n, len(rows), 0)))
    lines.append(
        "(10I8)".ljust(16) + "(10I8)".ljust(16) + "(1P,3E26.17)".ljust(20) + "(1P,3E26.17)".ljust(20)
    )
    if right_hand_side:
        lines.append("F".ljust(14) + f"{1:14d}{0:14d}")
    lines += [line for part in parts for line in part]
    if right_hand_side:
        lines.append("".join(f"{1.0:26.17E}" for _ in range(n)))
    return "\n".join(lines) + "\n"
