"""A full sector reduced onto its DOFs in use, one nodal diameter after the other; and the file of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from solver.matrices.craig_bampton import Quality, Reduced, craig_bampton
from solver.matrices.readers.reader_registry import MatrixFileError
from solver.matrices.sectors.elimination import Elimination, phase_factor
from solver.matrices.sectors.outline import OutlineMotion, SectorOutline
from solver.matrices.sectors.sector_parts import DiameterMatrices, PartsAcross
from solver.matrices.values import DofTable

SUFFIX = ".npz"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedSector:
    """The matrices of each nodal diameter, and what each is good for."""

    matrices: Annotated[DiameterMatrices, "The DOFs in use first, then the modes of the rest."]
    rows: Annotated[dict[str, int], "Row of each DOF in use."]
    full: Annotated[int, "Rows of the full sector."]
    modes: Annotated[int, "Modes kept at each nodal diameter."]
    highest_hz: Annotated[float, "Least frequency over the nodal diameters of the highest mode kept [Hz]."]
    quality: Annotated[tuple[Quality, ...], "Of each nodal diameter."]
    seconds: Annotated[tuple[float, ...], "That each took [s]."]

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which those of every nodal diameter are exact to 0.1 % [Hz]."""
        return min(quality.good_to_hz for quality in self.quality)


def diameters_met(orders: Sequence[int], sectors: int) -> tuple[int, ...]:
    """Nodal diameters from 0 to half the sectors that harmonics of these engine orders meet: multiples."""
    met = {order * k % sectors for order in orders for k in range(sectors)}
    return tuple(sorted({min(n, sectors - n) for n in met}))


def reduce_sector(
    matrices: Mapping[str, Any],
    eliminated: Elimination,
    dofs: Mapping[str, int],
    keep_modes: int,
    diameters: Sequence[int],
    sectors: int,
    parts: Mapping[str, Any] | None = None,
    drawn: Any | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> ReducedSector:
    """Reduce a sector (Craig, Bampton 1968) at each nodal diameter.

    Parameters
    ----------
    matrices : M, K and maybe C, sparse, of the full sector.
    eliminated : how its high boundary follows.
    dofs : rows of the DOFs in use in the full sector.
    keep_modes : of the rest with these held, at each nodal diameter.
    diameters : ascending.
    parts : matrices of what mistuning may scale, sparse, of the full sector; then all nodal diameters.
    drawn : sparse (3 n_points, rows) of the full sector: the motion of the outline's points by its rows.
    on_progress : called with each nodal diameter that is done.

    Raises
    ------
    ValueError
        A DOF on the high boundary, or a model that cannot be reduced so.
    """
    own = _kept_rows(dofs, eliminated)
    circulants = {key: eliminated.of(matrix) for key, matrix in matrices.items()}
    found, seconds, moved = [], [], []
    for n in diameters:
        begun = time.perf_counter()
        at = {key: circulant.at(n, sectors) for key, circulant in circulants.items()}
        basis = bool(parts) or drawn is not None
        one = craig_bampton(at["M"], at["K"], at.get("C"), own, keep_modes, weigh=False, keep_basis=basis)
        if drawn is not None:
            moved.append(drawn @ _of_sector(one, eliminated, n, sectors))
        found.append(one if parts else replace(one, basis=None))
        seconds.append(time.perf_counter() - begun)
        if on_progress is not None:
            on_progress(n)
    if len({each.modes for each in found}) > 1:
        most = max(each.modes for each in found)
        raise ValueError(
            f"`keep_modes` = {keep_modes} is too few: a nodal diameter has {most} with its rigid-body modes; "
            "ask for that many"
        )
    stacks = {key: np.array([each.matrices[key] for each in found]) for key in circulants}
    across = _across(parts, found, eliminated, diameters, sectors) if parts else None
    motion = OutlineMotion.of(moved) if moved else None
    return ReducedSector(
        matrices=DiameterMatrices(diameters=tuple(diameters), parts=across, motion=motion, **stacks),
        rows={name: row for row, name in enumerate(own)},
        full=int(eliminated.here.shape[0]),
        modes=found[0].modes,
        highest_hz=min(each.highest_hz for each in found),
        quality=tuple(each.quality for each in found),
        seconds=tuple(seconds),
    )


def _across(
    parts: Mapping[str, Any], found: Sequence[Reduced], eliminated: Elimination, diameters: Sequence[int],
    sectors: int,
) -> PartsAcross:  # fmt: skip
    """Parts of the sector between the bases of its nodal diameters."""
    bases = [_of_sector(each, eliminated, n, sectors) for n, each in zip(diameters, found, strict=True)]
    shape = (len(parts), len(bases), len(bases), bases[0].shape[1], bases[0].shape[1])
    ahead, back = np.empty(shape, np.complex128), np.empty(shape, np.complex128)
    for i, P in enumerate(parts.values()):
        for b, right in enumerate(bases):
            moved = P @ right
            for a, left in enumerate(bases):
                ahead[i, a, b] = left.conj().T @ moved
                back[i, a, b] = left.conj().T @ moved.conj()
    return PartsAcross(tuple(parts), ahead, back)


def _of_sector(reduced: Reduced, eliminated: Elimination, n: int, sectors: int) -> Any:
    """The motions of all rows of a sector, its high boundary too, that the coordinates stand for."""
    turn = phase_factor(n, sectors)
    return (eliminated.here @ reduced.basis) + turn * (eliminated.beyond @ reduced.basis)


def _kept_rows(dofs: Mapping[str, int], eliminated: Elimination) -> DofTable:
    size = eliminated.here.shape[0]
    table = {}
    for name, row in dofs.items():
        if not 0 <= row < size:
            raise ValueError(f"`dofs`: {name!r} must have a row from 0 to {size - 1}, got {row}")
        place = eliminated.row(row)
        if place >= eliminated.kept.size or eliminated.kept[place] != row:
            raise ValueError(
                f"`dofs`: {name!r} is on the high boundary: name the DOF of the low boundary that it is "
                "paired with; in contacts it is NAME@next"
            )
        table[name] = place
    return DofTable.read(table)


def write_diameters(path: Path, reduced: ReducedSector, outline: SectorOutline | None = None) -> None:
    """Write a reduced sector: arrays `diameters`, `M`, `K`, maybe `C`, `names` and `good_to_hz` (.npz).

    With an outline also `outline_points`, `outline_edges`, `outline_low` and `outline_high`, with its motion
    `outline_patterns` and `outline_shares` (`OutlineMotion`). With parts `parts` has their names,
    `parts_ahead` and `parts_back` the matrices (`PartsAcross`).

    Raises
    ------
    OSError
        The file cannot be written.
    """
    found = reduced.matrices
    names = [*reduced.rows, *(f"mode{i}" for i in range(1, reduced.modes + 1))]
    arrays = {"M": found.M, "K": found.K} | ({} if found.C is None else {"C": found.C})
    if found.parts is not None:
        arrays |= {"parts_ahead": found.parts.ahead, "parts_back": found.parts.back}
        arrays["parts"] = np.array(found.parts.names)
    np.savez_compressed(
        path,
        allow_pickle=False,
        **arrays,
        **({} if outline is None else outline.arrays()),
        **({} if found.motion is None else found.motion.arrays()),
        diameters=np.array(found.diameters, np.int64),
        names=np.array(names),
        full=np.array(reduced.full),
        good_to_hz=np.array([quality.good_to_hz for quality in reduced.quality]),
        held_hz=np.array([quality.held_hz for quality in reduced.quality]),
    )


def read_sector(path: Path) -> tuple[DiameterMatrices, dict[str, Any], SectorOutline | None]:
    """Read a reduced sector, what it was (`dofs` of the full one, `modes` kept, `highest_hz`), its outline.

    Raises
    ------
    MatrixFileError
        No such file, or one of something else.
    """
    if path.suffix.lower() != SUFFIX:
        raise MatrixFileError(f"{str(path)!r} must end in {SUFFIX}: a sector that `stickslip import` reduced")
    try:
        # Opened here: NumPy leaves a damaged archive open.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as found:
            arrays = {key: found[key] for key in found.files}
        held = arrays.get("held_hz", np.zeros((1, 0)))
        kept = {key: arrays[key] for key in ("M", "K", "C") if key in arrays}
        if arrays["diameters"].dtype.kind not in "iu":
            raise ValueError(f"`diameters` must be whole numbers, got {arrays['diameters'].dtype}")
        diameters = tuple(int(n) for n in arrays["diameters"])
        parts = None
        if "parts" in arrays:
            names = tuple(map(str, arrays["parts"]))
            parts = PartsAcross(names, arrays["parts_ahead"], arrays["parts_back"])
        motion = OutlineMotion.from_arrays(arrays)
        matrices = DiameterMatrices(diameters=diameters, parts=parts, motion=motion, **kept)
        highest = float(held[:, -1].min()) if held.size else 0.0
        if not 0.0 <= highest < math.inf:
            raise ValueError(f"`held_hz` must hold finite frequencies >= 0, got {highest}")
        full = int(arrays.get("full", matrices.size))
        was = {"dofs": full, "modes": int(held.shape[1]), "highest_hz": highest}
        return matrices, was, SectorOutline.from_arrays(arrays)
    except OSError as error:
        raise MatrixFileError(f"{str(path)!r} cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise MatrixFileError(f"{str(path)!r} holds more than fits into memory") from error
    except Exception as error:  # a damaged archive raises many kinds
        reason = f"has no array {error}" if isinstance(error, KeyError) else f"is no reduced sector: {error}"
        raise MatrixFileError(
            f"{str(path)!r} {reason}; `stickslip import --sectors … --reduce` writes one"
        ) from error
