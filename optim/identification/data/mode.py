"""The kind `mode`: frequency and damping ratio of a nonlinear mode over its amplitude.

Such curves come of tests in phase resonance or of decaying vibrations. Their model is the nonlinear mode of
the scene (`solver.modes`), whose frequency and damping ratio have exact derivatives by an adjoint at each
amplitude.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from optim.errors import DataError
from optim.identification.data.measured import Column, DataKind, MeasuredRows, Predicted, RunModel
from optim.identification.data.table import Dimension, Table, check_monotone, check_sign
from optim.problem.variables import Real
from solver.errors import SettingError
from solver.modes.at_amplitudes import ModePoints, mode_at_amplitudes
from solver.modes.corrector import ModeState
from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode
from solver.results.told import json_numbers
from solver.scene.scene import Scene

SHARPER = 0.02  # noise of a frequency relative to it, where that of a damping ratio is 1
_FLOOR = 0.01  # of the largest damping ratio of a run, below which its noise falls no further
_MOST_DAMPING = 1.0
_WORDS = {
    "mode": "Number of the mode, 1 the slowest, contacts as they are at rest; 1.",
    "nodal_diameter": "Of a disk, negative for a backward wave; that of the engine order.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeRun(MeasuredRows):
    """Frequency and damping ratio over the amplitude."""

    amplitude: Annotated[Real, "Modal amplitudes [√kg m], (m,)."]
    frequency_hz: Annotated[Real | None, "Frequencies measured [Hz], (m,)."]
    damping_ratio: Annotated[Real | None, "Damping ratios measured, (m,)."]
    sd: Annotated[Real | None, "Standard deviation of each observation, (n,)."]
    mode: Annotated[int, "Its number."]
    nodal_diameter: Annotated[int | None, "Of a cyclic structure."]

    @property
    def observations(self) -> Real:
        """The frequencies, then the damping ratios, (n,)."""
        return np.concatenate([one for one in (self.frequency_hz, self.damping_ratio) if one is not None])

    @property
    def given_noise(self) -> Real | None:
        """As the base says."""
        return self.sd

    def curves(self, values: Real) -> Sequence[Real]:
        """As the base says: frequencies and damping ratios over the amplitude."""
        return tuple(values.reshape(-1, self.amplitude.size))

    @property
    def unit_words(self) -> str:
        """As the base says."""
        return "frequencies [Hz] and damping ratios"

    def noise_shape(self, values: Real) -> Real:
        """The damping ratio; of a frequency `SHARPER` of it, because frequencies are measured much better."""
        m = 0 if self.frequency_hz is None else self.frequency_hz.size
        damping = np.abs(values[m:])
        floor = _FLOOR * float(np.nanmax(damping)) if damping.size else 0.0
        return np.concatenate([SHARPER * np.abs(values[:m]), np.maximum(damping, floor)])

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _ModeModel(self, scene, tuple(paths), harmonics)

    def thinned(self, most: int) -> ModeRun:
        """Points evenly taken."""
        m = self.amplitude.size
        if m <= most:
            return self
        return self._rows(np.unique(np.linspace(0, m - 1, most).round().astype(int)))

    def under(self, conditions: Mapping[str, float], most: int) -> ModeRun:
        """The same amplitudes under other conditions."""
        run = self.thinned(most)
        nothing = np.full(run.amplitude.size, np.nan)
        return replace(
            run, conditions={**self.conditions, **conditions}, sd=None,
            frequency_hz=None if run.frequency_hz is None else nothing,
            damping_ratio=None if run.damping_ratio is None else nothing,
        )  # fmt: skip

    def _rows(self, kept: np.ndarray) -> ModeRun:
        both = (self.frequency_hz, self.damping_ratio)
        frequency, damping = (None if one is None else one[kept] for one in both)
        m = self.amplitude.size
        parts = sum(one is not None for one in both)
        sd = None if self.sd is None else self.sd.reshape(parts, m)[:, kept].ravel()
        return replace(
            self, amplitude=self.amplitude[kept], frequency_hz=frequency, damping_ratio=damping, sd=sd
        )

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """The damping ratio over the amplitude, or the frequency where that alone was measured."""
        m = self.amplitude.size
        of = "damping ratio" if self.damping_ratio is not None else "frequency [Hz]"
        last = slice(-m, None)
        return {
            "kind": KIND.name, "source": self.source, "conditions": dict(self.conditions), "mode": self.mode,
            "quantity": of, "x": self.amplitude.tolist(), "data": self.observations[last].tolist(),
            "fit": json_numbers(fitted[last]), "fit_sd": json_numbers(sd[last]),
            **({"frequency": self.frequency_hz.tolist(), "fit_frequency": json_numbers(fitted[:m])}
               if self.frequency_hz is not None else {}),
        }  # fmt: skip


class _ModeModel(RunModel):
    """The nonlinear mode of the scene at the amplitudes measured."""

    def __init__(self, run: ModeRun, scene: Scene, paths: tuple[str, ...], harmonics: int) -> None:
        self._run, self._scene, self._paths, self._harmonics = run, scene, paths, max(harmonics, 1)
        self._points: list[ModeState | None] = []

    def forget(self) -> None:
        """As the base says."""
        self._points = []

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        run = self._run
        here = self._scene.with_values({**values, **run.conditions})
        found = mode_at_amplitudes(
            here, run.amplitude, self._paths, mode=run.mode, nodal_diameter=run.nodal_diameter,
            harmonics=self._harmonics, guesses=self._points,
        )  # fmt: skip
        self._points = found.points
        return self._predicted(found, [contact.name for contact in here.contacts])

    def _predicted(self, found: ModePoints, names: Sequence[str]) -> Predicted:
        asked = []
        if self._run.frequency_hz is not None:
            asked.append((found.frequency_hz, found.by_frequency))
        if self._run.damping_ratio is not None:
            asked.append((found.damping_ratio, found.by_damping))
        values = np.concatenate([one for one, _ in asked])
        slopes = np.vstack([by for _, by in asked])
        return Predicted(
            values=values, slopes=slopes, reached=np.isfinite(values) & np.isfinite(slopes).all(axis=1),
            states={name: found.states[:, c] for c, name in enumerate(names)},
        )  # fmt: skip


def read_mode(scene: Scene, table: Table) -> MeasuredRows:
    """Read the table of one run.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    table.need(2, "points")
    check_sign(table, "modal_amplitude", positive=True)
    check_monotone(table, "modal_amplitude")
    columns = table.columns
    frequency, damping = columns.get("frequency"), columns.get("damping_ratio")
    if frequency is not None:
        check_sign(table, "frequency", positive=True)
    if damping is not None:
        check_sign(table, "damping_ratio", positive=True)
        large = np.flatnonzero(damping >= _MOST_DAMPING)
        if large.size:
            raise table.error(int(large[0]), "damping_ratio", "must be a ratio below 1, 0.02 for 2 %")
    mode, diameter = _whole(table, "mode", 1), _whole(table, "nodal_diameter", None)
    try:
        check_mode(at_nodal_diameter(scene, diameter), 1 if mode is None else mode)
    except SettingError as error:
        raise table.refusal(table.words.get(error.name, mode), str(error)) from error
    return ModeRun(
        source=table.source, conditions=dict(table.conditions), amplitude=columns["modal_amplitude"],
        frequency_hz=frequency, damping_ratio=damping, sd=_deviations(table), mode=mode or 1,
        nodal_diameter=diameter,
    )  # fmt: skip


def _deviations(table: Table) -> Real | None:
    """Return the standard deviations that the data give, of all that was measured or of none."""
    measured = [name for name in ("frequency", "damping_ratio") if name in table.columns]
    names = [f"{'frequency' if name == 'frequency' else 'damping'}_sd" for name in measured]
    given = [name for name in names if name in table.columns]
    if not given:
        return None
    if given != names:
        missing = next(name for name in names if name not in given)
        raise table.refusal(", ".join(given), f"must come with {missing}: deviations of all or of none")
    for name in names:
        check_sign(table, name, positive=True)
    return np.concatenate([table.columns[name] for name in names])


def _whole(table: Table, word: str, default: int | None) -> int | None:
    """Return a whole number of the head.

    Raises
    ------
    DataError
        It is none.
    """
    text = table.words.get(word)
    if text is None:
        return default
    try:
        return int(text)
    except ValueError:
        raise DataError(
            table.source, text, f"`{word}` must be a whole number", place=table.place
        ) from None  # fmt: skip


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
    words=_WORDS,
    read=read_mode,
)  # fmt: skip
