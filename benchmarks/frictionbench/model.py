"""A case as matrices and rows of contacts: what a way to its answer needs. Nothing of stickslip is used."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from math import gcd, pi
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
Case = dict[str, Any]


@cache
def names() -> tuple[str, ...]:
    """Return the names of all cases, ladder by ladder."""
    found = [json.loads(path.read_text()) for path in (HERE / "cases").glob("*.json")]
    return tuple(one["name"] for one in sorted(found, key=lambda one: one["number"]))


def load(name: str) -> Case:
    """Return a case; a matrix that stands beside it as MatrixMarket is read."""
    case: Case = json.loads((HERE / "cases" / f"{name}.json").read_text())
    structure = case["structure"]
    for key in ("M", "C", "K", "K_next", "C_next"):
        if isinstance(structure.get(key), str):
            from scipy.io import mmread

            read = mmread(HERE / "cases" / structure[key])
            structure[key] = (read if isinstance(read, np.ndarray) else read.toarray()).tolist()
    return case


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One direction of a contact: motion u = b x, load N = N0 + N1 cos(τ + phase) + kn v, v = n x."""

    name: str
    law: str
    b: np.ndarray
    kt: float
    mu: float = 0.0
    N0: float = 0.0
    N1: float = 0.0
    phase: float = 0.0
    kn: float = 0.0
    n: np.ndarray | None = None
    reacts: bool = True
    gap: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Matrices, rows and loads (dof, amplitude, phase, harmonic); of a disk the whole annulus.

    `turn` is the permutation of the coordinates and `row_turn` of the rows under which a travelling wave
    repeats after `share` of the period; identity and 1 without sectors.
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    rows: tuple[Row, ...]
    loads: tuple[tuple[int, float, float, int], ...]
    seen: int
    turn: np.ndarray
    row_turn: np.ndarray
    share: float
    copies: tuple[int, ...]


def model(case: Case) -> Model:
    """Write a case out; of sectors in a travelling wave the whole annulus."""
    structure = case["structure"]
    dofs, sectors = structure["dofs"], structure.get("sectors", 1)
    n, order = len(dofs), case.get("engine_order", 0)
    one = {key: np.array(structure[key], float) for key in "MCK"}
    whole = {key: np.kron(np.eye(sectors), one[key]) for key in "MCK"}
    for key in ("K_next", "C_next"):
        if key in structure:
            beside = np.kron(np.roll(np.eye(sectors), 1, axis=1), np.array(structure[key], float))
            whole[key[0]] += beside + beside.T

    def motion(pair: list[str], sector: int) -> np.ndarray:
        b = np.zeros(n * sectors)
        for name, sign in zip(pair, (1.0, -1.0), strict=True):
            if name != "ground":
                at = (sector + 1) % sectors if name.endswith("@next") else sector
                b[at * n + dofs.index(name.removesuffix("@next"))] += sign
        return b

    rows, loads = [], []
    for j in range(sectors):
        angle = 2.0 * pi * j / sectors * order
        for contact in case["contacts"]:
            rows += _rows(contact, angle, lambda pair, at=j: motion(pair, at))
        for load_ in case["loads"]:
            k = load_.get("harmonic", 1)
            phase = load_.get("phase", 0.0) + k * angle
            loads.append((j * n + dofs.index(load_["dof"]), load_["amplitude"], phase, k))
    common = gcd(sectors, order) if order else sectors
    # x of sector j + r at τ is that of sector j at τ + 2π common / sectors.
    r = next((r for r in range(sectors) if (r * order - common) % sectors == 0), 0) if sectors > 1 else 0
    each = len(rows) // sectors
    shift = (np.arange(sectors) + r) % sectors
    seen = dofs.index(case["asked"]["dof"])
    return Model(
        M=whole["M"], C=whole["C"], K=whole["K"], rows=tuple(rows), loads=tuple(loads), seen=seen,
        turn=(shift[:, None] * n + np.arange(n)).ravel(),
        row_turn=(shift[:, None] * each + np.arange(each)).ravel(),
        share=common / sectors if order else 1.0,
        copies=tuple(sorted({(seen + n * r * i) % (n * sectors) for i in range(sectors)})),
    )  # fmt: skip


def _rows(contact: dict[str, Any], angle: float, motion: Any) -> list[Row]:
    """Return the rows of a contact in one sector; the second direction of a box shares its load."""
    law = contact.get("law", "coulomb")
    if law == "gap":
        b = motion(contact["between"])
        return [Row(name=contact["name"], law=law, b=b, kt=contact["k"], gap=contact["gap"])]
    if contact.get("limit") == "circle":
        raise NotImplementedError(f"{contact['name']}: a circular limit is not piecewise linear")
    pairs = [contact[key] for key in ("between", "between_second") if key in contact]
    normal = motion(contact["normal_between"]) if "normal_between" in contact else None
    return [
        Row(
            name=contact["name"], law="friction", b=motion(pair), mu=contact["mu"], N0=contact["N0"],
            kt=np.inf if contact["kt"] == "inf" else contact["kt"], N1=contact.get("N1", 0.0),
            phase=contact.get("N1_phase", 0.0) + angle, kn=contact.get("kn", 0.0), n=normal, reacts=not i,
        )
        for i, pair in enumerate(pairs)
    ]  # fmt: skip
