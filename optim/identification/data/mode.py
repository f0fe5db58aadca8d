"""The kind `mode`: frequency and damping ratio of a nonlinear mode over its amplitude.

Such curves come of tests in phase resonance or of decaying vibrations. Their model is the nonlinear mode of
the scene (`solver.modes`), whose frequency and damping ratio have exact derivatives by an adjoint at each
amplitude.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from optim.identification.data.measured import (
    Column,
    CurveRun,
    DataKind,
    MeasuredRows,
    Predicted,
    RunModel,
    columns_of,
    whole_word,
)
from optim.identification.data.measured_table import Dimension, Table, check_monotone, check_sign
from optim.problem.variables import Real
from solver.errors import SettingError
from solver.modes.at_amplitudes import ModePoints, mode_at_amplitudes
from solver.modes.mode_curve import ModeState
from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode
from solver.scene.scene import Scene

SHARPER = 0.02  # noise of a frequency relative to it, where that of a damping ratio is 1
_MOST_DAMPING = 1.0
WORDS = {
    "mode": "Number of the mode, 1 the slowest, contacts as they are at rest; 1.",
    "nodal_diameter": "Of a disk, negative for a backward wave; that of the engine order.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeRun(CurveRun):
    """Frequency and damping ratio over the amplitude."""

    mode: Annotated[int, "Its number."]
    nodal_diameter: Annotated[int | None, "Of a cyclic structure."]

    KIND_NAME: ClassVar = "mode"
    UNIT_WORDS: ClassVar = "frequencies [Hz] and damping ratios"
    TOLD: ClassVar = {
        "modal_amplitude": "modal amplitude a [√kg m]",
        "frequency": "frequency [Hz]",
        "damping_ratio": "damping ratio",
    }
    SHARES: ClassVar = {"frequency": SHARPER}  # frequencies are measured much better

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _ModeModel(self, scene, paths, harmonics)

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """As the base says, with the number of the mode."""
        return {**CurveRun.to_json(self, fitted, sd), "mode": self.mode}


class FollowedMode(RunModel):
    """A nonlinear mode, followed from one set of values to the next.

    Parameters
    ----------
    scene, mode, nodal_diameter : whose, and which one.
    paths, harmonics : of the derivatives, and kept.
    """

    def __init__(
        self, scene: Scene, mode: int, nodal_diameter: int | None, paths: Sequence[str], harmonics: int
    ) -> None:
        self._scene, self._mode, self._nodal_diameter = scene, mode, nodal_diameter
        self._paths, self._harmonics = tuple(paths), max(harmonics, 1)
        self._points: list[ModeState | None] = []

    def forget(self) -> None:
        """As the base says."""
        self._points = []

    def looked_at(self, values: Mapping[str, float], amplitudes: Real) -> tuple[list[str], ModePoints]:
        """Return the names of the contacts, and the mode at amplitudes."""
        here = self._scene.with_values(values)
        found = mode_at_amplitudes(
            here, amplitudes, self._paths, mode=self._mode, nodal_diameter=self._nodal_diameter,
            harmonics=self._harmonics, guesses=self._points,
        )  # fmt: skip
        self._points = found.points
        return [contact.name for contact in here.contacts], found


class _ModeModel(FollowedMode):
    """The nonlinear mode of the scene at the amplitudes measured."""

    def __init__(self, run: ModeRun, scene: Scene, paths: Sequence[str], harmonics: int) -> None:
        super().__init__(scene, run.mode, run.nodal_diameter, paths, harmonics)
        self._run = run

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        names, found = self.looked_at({**values, **self._run.conditions}, self._run.x)
        both = {
            "frequency": (found.frequency_hz, found.by_frequency),
            "damping_ratio": (found.damping_ratio, found.by_damping),
        }
        states = {name: found.states[:, c] for c, name in enumerate(names)}
        return Predicted.of([both[name] for name in self._run.data], states)


def read_mode(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(2, "points")
    check_sign(table, "modal_amplitude", positive=True)
    check_monotone(table, "modal_amplitude")
    at, data, sd = columns_of(table, _AT, _MEASURED)
    large = np.flatnonzero(data.get("damping_ratio", np.zeros(0)) >= _MOST_DAMPING)
    if large.size:
        raise table.error(int(large[0]), "damping_ratio", "must be a ratio below 1, 0.02 for 2 %")
    mode, diameter = checked_mode(scene, table)
    return ModeRun(
        source=table.source, conditions=dict(table.conditions), at=at, data=data, sd=sd, mode=mode,
        nodal_diameter=diameter,
    )  # fmt: skip


def checked_mode(scene: Scene, table: Table) -> tuple[int, int | None]:
    """Return number and nodal diameter of the mode that the head says.

    Raises
    ------
    DataError
        There is none.
    """
    said, diameter = whole_word(table, "mode"), whole_word(table, "nodal_diameter")
    mode = 1 if said is None else said
    try:
        check_mode(at_nodal_diameter(scene, diameter), mode)
    except SettingError as error:
        raise table.refusal(table.words.get(error.name, mode), str(error)) from error
    return mode, diameter


_AT, _MEASURED = ("modal_amplitude",), {"frequency": "frequency_sd", "damping_ratio": "damping_sd"}

KIND = DataKind(
    name="mode",
    help="Frequency and damping ratio of a nonlinear mode over its amplitude: phase resonance, decay.",
    columns=(
        Column(
            "modal_amplitude", Dimension.NUMBER,
            "a [√kg m], of a displacement divided by the mass-normalised mode shape there.",
        ),
        Column("frequency", Dimension.FREQUENCY, "Of the excitation; of the mode beside `modal_amplitude`."),
        Column("damping_ratio", Dimension.NUMBER, "ζ of the mode."),
        Column("frequency_sd", Dimension.FREQUENCY, "Standard deviation of each frequency, if it is known."),
        Column("damping_sd", Dimension.NUMBER, "Standard deviation of each damping ratio, if it is known."),
    ),
    marks=(("modal_amplitude", "frequency"), ("modal_amplitude", "damping_ratio")),
    words=WORDS,
    read=read_mode,
)  # fmt: skip
