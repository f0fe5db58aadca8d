"""`stickslip import --reduce`: a large pair of matrices becomes a small one in a file of its own."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.importing.files import relative
from service.cli.options.inputs import new_file
from service.errors import InputError
from solver.results.files import whole

if TYPE_CHECKING:
    from service.cli.importing.options import ImportOptions
    from solver.matrices.load_set import MatrixSet
    from solver.matrices.reduction.craig_bampton import Reduced


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedModel:
    """A reduced model in its file."""

    path: Path
    reduced: Reduced
    rows: dict[str, int]
    full: int
    seconds: float

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which every frequency is exact to 0.1 % [Hz]."""
        return self.reduced.quality.good_to_hz

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target`."""
        name = relative(self.path, target)
        return {"kind": "matrices", **dict.fromkeys(self.reduced.matrices, name)}

    def facts(self) -> dict[str, object]:
        """What the reduction kept, for programs."""
        quality = self.reduced.quality
        return {
            "file": str(self.path), "dofs": self.full, "modes": self.reduced.modes,
            "highest_hz": self.reduced.highest_hz, "good_to_hz": quality.good_to_hz,
            "held_hz": quality.held_hz.tolist(), "static_residual": quality.static_residual,
            "mass_carried": dict(zip(self.rows, quality.mass_carried.tolist(), strict=True)),
            "effective_mass": quality.effective_mass.tolist(),
            "rigid_body_modes": quality.rigid_body_modes, "shift_hz": quality.shift_hz,
            "seconds": self.seconds,
        }  # fmt: skip

    def pairs(self) -> list[tuple[str, str]]:
        """What the reduction kept, for people."""
        quality, reduced = self.reduced.quality, self.reduced
        held = ", ".join(f"{f:.5g}" for f in quality.held_hz[:6]) + (", …" if reduced.modes > 6 else "")
        least = min(zip(quality.mass_carried, self.rows, strict=True), default=(0.0, ""))
        pairs = [
            ("reduced", f"{self.full} rows to {len(self.rows)} DOFs and {reduced.modes} modes in "
                        f"{self.seconds:.1f} s, written to {self.path}"),
            ("modes kept", f"{held} Hz, the highest {reduced.highest_hz:.5g} Hz, with the DOFs held"
                           if held else "none"),
            ("good to", f"{quality.good_to_hz:.5g} Hz: frequencies up to there are estimated 0.1 % exact; "
                        "harmonics that matter should lie below"),
            ("errors", "first frequencies too high by "
                       + (", ".join(f"{e:.1e}" for e in quality.system_error[:6]) or "nothing")),
            ("mass carried", f"{100 * least[0]:.1f} % of the inertia or more (least for {least[1]})"),
            ("static check", f"residual {quality.static_residual:.1e}"),
        ]  # fmt: skip
        if quality.shift_hz:
            pairs.append(("free rest", f"not held by these DOFs; shifted by {quality.shift_hz:.3g} Hz"))
        return pairs


def reduced_file(asked: ImportOptions, target: Path) -> Path:
    """Where the reduced model, or the reduced sector, goes, which must not exist."""
    from solver.matrices.reduction.craig_bampton import WRITTEN

    name = asked.reduced or str(target.with_name(f"{target.stem}-reduced.npz"))
    return new_file("--reduced", name, WRITTEN if asked.sectors is None else (".npz",))


def reduce(
    given: MatrixSet, rows: Mapping[str, int], modes: int | None, up_to: float | None, path: Path
) -> ReducedModel:
    """Reduce matrices onto the DOFs in `rows` and write them to `path`."""
    from solver.matrices.diagnostics import refuse
    from solver.matrices.reduction.craig_bampton import craig_bampton, write_reduced
    from solver.matrices.validation import DofTable

    if (modes is None) == (up_to is None):
        raise InputError(
            "`--reduce` takes one of --modes N and --up-to HZ: how many modes of the rest to keep"
        )
    if modes is not None and modes < 0:
        raise InputError(f"`--modes` must be >= 0, got {modes}")
    if up_to is not None and not 0.0 < up_to < 1e9:
        raise InputError(f"`--up-to` must be a frequency above 0, got {up_to:g}")
    start = time.perf_counter()
    matrices = given.matrices
    try:
        refuse(given, reduced=True)
        dofs = DofTable.read(dict(rows))
        found = craig_bampton(matrices["M"], matrices["K"], matrices.get("C"), dofs, modes, up_to_hz=up_to)
    except ValueError as error:
        raise InputError(f"`--reduce`: {error}") from error
    seconds = time.perf_counter() - start
    with whole(path) as temporary:
        write_reduced(temporary, found, list(dofs))
    return ReducedModel(
        path=path, reduced=found, rows={name: i for i, name in enumerate(dofs)},
        full=int(matrices["M"].shape[0]), seconds=seconds,
    )  # fmt: skip
