"""A case written out and as matrices with rows of contacts. Nothing of stickslip is used."""

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
ENDS = ("between", "between_second", "normal_between")


class NotOfferedError(NotImplementedError):
    """A code, or a way to an answer, has no such question; why is shown."""


@cache
def names() -> tuple[str, ...]:
    """Return the names of all cases, ladder by ladder."""
    found = [json.loads(path.read_text()) for path in (HERE / "cases").glob("*.json")]
    return tuple(one["name"] for one in sorted(found, key=lambda one: one["number"]))


def load(name: str) -> Case:
    """Return a case; a matrix that stands beside it as MatrixMarket is read."""
    case: Case = json.loads((HERE / "cases" / f"{name}.json").read_text())
    structure = case["structure"]
    for key in ("M", "C", "K"):
        if isinstance(structure[key], str):
            from scipy.io import mmread

            read = mmread(HERE / "cases" / structure[key])
            structure[key] = (read if isinstance(read, np.ndarray) else read.toarray()).tolist()
    return case


def written_out(case: Case) -> Case:
    """Return a case without sectors: as much of the annulus as a wave of its order repeats after."""
    structure, order = case["structure"], case.get("engine_order", 0)
    if "sectors" not in structure:
        return case
    part = gcd(structure["sectors"], order)
    count, order = structure["sectors"] // part, order // part
    beside = np.roll(np.eye(count), 1, axis=1)
    matrices = {key: np.kron(np.eye(count), structure[key]) for key in "MCK"}
    for key in "CK":
        to_next = np.kron(beside, structure[f"{key}_next"])
        matrices[key] += to_next + to_next.T
    contacts, loads = [], []

    def at(dof: str, sector: int) -> str:
        if dof == "ground":
            return dof
        return f"{dof.removesuffix('@next')}_{(sector + dof.endswith('@next')) % count}"

    for j in range(count):
        angle = 2.0 * pi * j / count * order
        for one in case["contacts"]:
            ends = {key: [at(dof, j) for dof in one[key]] for key in ENDS if key in one}
            moves = {"N1_phase": one.get("N1_phase", 0.0) + angle} if "N1" in one else {}
            contacts.append({**one, **ends, **moves, "name": f"{one['name']}_{j}"})
        for one in case["loads"]:
            phase = one.get("phase", 0.0) + one.get("harmonic", 1) * angle
            loads.append({**one, "dof": at(one["dof"], j), "phase": phase})
    dofs = [f"{dof}_{j}" for j in range(count) for dof in structure["dofs"]]
    return {
        **{key: value for key, value in case.items() if key != "engine_order"},
        "structure": {"dofs": dofs, **{key: matrix.tolist() for key, matrix in matrices.items()}},
        "contacts": contacts, "loads": loads, "asked": {**case["asked"], "dof": f"{case['asked']['dof']}_0"},
    }  # fmt: skip


def piecewise_linear(case: Case) -> Case:
    """Return a case written out, a box as two faces of half the load and stiffness and twice the μ.

    Raises
    ------
    NotOfferedError
        A limit is a circle.
    """
    case, contacts = written_out(case), []
    for one in case["contacts"]:
        if one.get("limit") == "circle":
            raise NotOfferedError("a circular limit is not piecewise linear")
        if one.get("limit") != "box":
            contacts.append(one)
            continue
        half = {
            "law": "elastic-normal",
            "normal_between": one["normal_between"],
            "kt": one["kt"],
            "mu": 2 * one["mu"],
        }
        half |= {"kn": one["kn"] / 2, "N0": one["N0"] / 2}
        contacts += [
            {**half, "name": f"{one['name']}-{key}", "between": one[key]}
            for key in ("between", "between_second")
        ]
    return {**case, "contacts": contacts}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One direction of a contact: its motion is u = b x; what its load varies with is in the case."""

    law: str
    b: np.ndarray
    kt: float
    mu: float = 0.0
    N0: float = 0.0
    N1: float = 0.0
    kn: float = 0.0
    gap: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Matrices, rows, loads (dof, amplitude, phase, harmonic), and the coordinate that is seen."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    rows: tuple[Row, ...]
    loads: tuple[tuple[int, float, float, int], ...]
    seen: int


def model(case: Case) -> Model:
    """Return the matrices of a case written out.

    Raises
    ------
    NotOfferedError
        A limit in the form of a circle, which is no row by itself.
    """
    case = written_out(case)
    dofs, rows = case["structure"]["dofs"], []
    for contact in case["contacts"]:
        if contact.get("limit") == "circle":
            raise NotOfferedError(f"{contact['name']}: the adapter knows no circular limit")
        for key in ("between", "between_second"):
            b = np.zeros(len(dofs))
            for dof, sign in zip(contact.get(key, ()), (1.0, -1.0), strict=False):
                if dof != "ground":
                    b[dofs.index(dof)] += sign
            if contact["law"] == "gap":
                made = Row(law="gap", b=b, kt=contact["k"], gap=contact["gap"])
            else:
                more = {name: contact.get(name, 0.0) for name in ("N1", "kn")}
                more |= {name: float(contact[name]) for name in ("kt", "mu", "N0")}
                made = Row(law="friction", b=b, **more)
            rows += [made] if key in contact else []
    M, C, K = (np.array(case["structure"][key], float) for key in "MCK")
    loads = tuple(
        (dofs.index(one["dof"]), one["amplitude"], one.get("phase", 0.0), one.get("harmonic", 1))
        for one in case["loads"]
    )
    return Model(M=M, C=C, K=K, rows=tuple(rows), loads=loads, seen=dofs.index(case["asked"]["dof"]))
