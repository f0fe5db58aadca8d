"""`stickslip import --sectors`: the matrices of one sector of a disk, its boundaries, its nodal diameters."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from service.cli.failures import refused
from service.cli.options.inputs import relative
from service.errors import InputError
from solver.results.files import whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from service.cli.importing.import_reduction import ImportOptions
    from solver.matrices.load_set import MatrixSet
    from solver.matrices.sectors.sector_reduction import ReducedSector


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskOptions:
    """What the options say of the disk."""

    sectors: int
    engine_order: int
    deck: Path | None
    axis: list[float]
    cyclic: Annotated[dict[str, object], "What the table [structure.cyclic] says beside axis and deck."]

    def joined(self, target: Path) -> dict[str, object]:
        """The table [structure.cyclic] of a scene at `target`."""
        nodes = {} if self.deck is None else {"nodes": relative(self.deck, target)}
        return {"axis": self.axis, **self.cyclic, **nodes}


def _nodes(text: str) -> str | list[int]:
    parts = [part.strip() for part in text.split(",")]
    return [int(part) for part in parts] if all(part.isdecimal() for part in parts) else text


def disk(asked: ImportOptions, deck: Path | None) -> DiskOptions | None:
    """What the options say of a disk; None without --sectors.

    Raises
    ------
    InputError
        Options of a disk without --sectors, or values that are none.
    """
    if asked.sectors is None:
        others: dict[str, object] = {
            "--low": asked.low, "--high": asked.high, "--axis": asked.axis,
            "--engine-order": asked.engine_order,
        }  # fmt: skip
        if not asked.patches:  # which take it too
            others["--tolerance"] = asked.tolerance
        given = next((name for name, value in others.items() if value is not None), None)
        if given is not None:
            raise InputError(f"`{given}` is of a sector of a disk: give --sectors N too")
        return None
    if asked.sectors < 1:
        raise InputError(f"`--sectors` must be >= 1, got {asked.sectors}")
    if (asked.low is None) != (asked.high is None):
        raise InputError("`--low` and `--high` go together, or are both left out (then found by position)")
    cyclic: dict[str, object] = {}
    if asked.low is not None and asked.high is not None:
        cyclic |= {"low": _nodes(asked.low), "high": _nodes(asked.high)}
    if asked.pair_by != "position":
        cyclic["pair_by"] = asked.pair_by
    if asked.tolerance is not None:
        cyclic["tolerance"] = asked.tolerance
    order = 1 if asked.engine_order is None else asked.engine_order
    return DiskOptions(
        sectors=asked.sectors, engine_order=order, deck=deck, axis=_axis(asked.axis), cyclic=cyclic
    )  # fmt: skip


def _axis(text: str | None) -> list[float]:
    named = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}
    if text is None or text.lower() in named:
        return named[(text or "z").lower()]
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3 or not any(found):
        raise InputError(f"`--axis` must be x, y, z or a direction such as 0,0,1, got {text!r}")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenSector:
    """A reduced sector in its file."""

    path: Path
    reduced: ReducedSector
    full: int
    pairs_of_rows: int
    axis: list[float]
    sectors: int
    seconds: float

    @property
    def rows(self) -> dict[str, int]:
        """Row of each DOF in use."""
        return self.reduced.rows

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which those of every nodal diameter are exact to 0.1 % [Hz]."""
        return self.reduced.good_to_hz

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target`."""
        name = relative(self.path, target)
        return {"kind": "matrices", "sectors": self.sectors, "diameters": name, "cyclic": {"axis": self.axis}}

    def facts(self) -> dict[str, object]:
        """What the reduction kept, for programs."""
        found = self.reduced
        return {
            "file": str(self.path), "dofs": self.full, "modes": found.modes, "highest_hz": found.highest_hz,
            "good_to_hz": found.good_to_hz, "seconds": self.seconds,
            "diameters": [
                {
                    "diameter": n, "frequencies_hz": quality.system_hz[:10].tolist(),
                    "good_to_hz": quality.good_to_hz, "static_residual": quality.static_residual,
                    "relative_errors": [
                        error if math.isfinite(error) else None
                        for error in quality.system_error[:10].tolist()
                    ],
                    "seconds": seconds,
                }
                for n, quality, seconds in zip(
                    found.matrices.diameters, found.quality, found.seconds, strict=True
                )
            ],
        }  # fmt: skip

    def pairs(self) -> list[tuple[str, str]]:
        """What the reduction kept, for people."""
        found = self.reduced
        told = [
            ("reduced", f"{self.full} rows to {len(self.rows)} DOFs and {found.modes} modes at each of "
                        f"{len(found.quality)} nodal diameters in {self.seconds:.1f} s, in {self.path}"),
            ("boundary", f"{self.pairs_of_rows} rows of the high boundary follow the low one"),
            ("good to", f"{found.good_to_hz:.5g} Hz: frequencies up to there are estimated 0.1 % exact at "
                        "every nodal diameter; harmonics that matter should lie below"),
        ]  # fmt: skip
        for n, quality, seconds in zip(found.matrices.diameters, found.quality, found.seconds, strict=True):
            first = ", ".join(f"{f:.6g}" for f in quality.system_hz[:4])
            high = f"too high by {max(quality.system_error[:4].tolist(), default=0.0):.1e} of it at most"
            told.append((f"diameter {n}", f"{first} Hz, …, {high}; {seconds:.1f} s"))
        return told


def reduce_disk(
    given: MatrixSet, rows: Mapping[str, int], modes: int | None, of: DiskOptions, path: Path,
    mistune: Sequence[str] = (), metres: float = 1.0,
) -> WrittenSector:  # fmt: skip
    """Reduce a sector at every nodal diameter its engine order meets, and write it to `path`.

    Parameters
    ----------
    mistune : names of what mistuning may scale; then all nodal diameters are built.
    metres : the unit of the deck.
    """
    from scipy.sparse import csr_array

    from solver.errors import SceneError
    from solver.matrices.diagnostics import refuse
    from solver.matrices.sectors.loading import check_part_sizes, parts_to_reduce
    from solver.matrices.sectors.sector_reduction import diameters_met, reduce_sector, write_diameters

    if modes is None or modes < 0:
        raise InputError("`--reduce` of a sector takes --modes N: as many at each nodal diameter")
    begun = time.perf_counter()
    matrices: dict[str, Any] = {key: csr_array(matrix) for key, matrix in given.matrices.items()}
    try:
        refuse(given, reduced=True)
        ends = checked_boundaries(given, of, metres)
        gone = ends.elimination(matrices["M"].shape[0], of.sectors)
        check_part_sizes(given)
        parts = parts_to_reduce({"of": mistune}, given)
        met = range(of.sectors // 2 + 1) if parts else diameters_met([of.engine_order], of.sectors)
        reduced = reduce_sector(matrices, gone, rows, modes, met, of.sectors, parts, ends.drawn)
    except SceneError as error:
        raise refused([error.issues[0].at("mistune")], {"mistune": "--mistune"}) from error
    except ValueError as error:
        raise InputError(f"`--reduce`: {error}") from error
    with whole(path) as temporary:
        write_diameters(temporary, reduced, ends.outline)
    return WrittenSector(
        path=path, reduced=reduced, full=int(matrices["M"].shape[0]), axis=of.axis, sectors=of.sectors,
        pairs_of_rows=int(gone.here.shape[0] - gone.kept.size), seconds=time.perf_counter() - begun,
    )  # fmt: skip


def checked_boundaries(given: MatrixSet, of: DiskOptions, metres: float = 1.0) -> Any:
    """The boundaries of the sector as rows.

    Raises
    ------
    InputError
        Sets or nodes that are not there, or do not match.
    """
    from solver.errors import SceneError
    from solver.matrices.sectors.loading import boundaries

    # Relative to the current folder: the scene's own may be another one.
    table = of.joined(Path.cwd() / "scene.toml")
    try:
        return boundaries(table, given, of.sectors, Path.cwd(), metres)
    except SceneError as error:
        issue = error.issues[0]
        raise InputError(issue.said(f"--{issue.name.replace('_', '-')}")) from error


def found_by_position(of: DiskOptions | None) -> list[str]:
    """What to know of boundaries that were not named."""
    if of is None:
        return []
    if of.deck is None:
        return [
            "there is no deck: the rows are taken to be along the global axes; if nodes have frames of their "
            "own (GRID field 7, NBLOCK angles, *TRANSFORM), give it with --nodes"
        ]
    if "low" in of.cyclic:
        return []
    return [
        "the boundaries were found by position: faces that only touch the next sector, as of shrouds, lie "
        "there too and are joined with it; where there are any, name the sets with --low and --high"
    ]
