"""Nonlinear modes, what follows from them and responses at a held amplitude as named arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solver.results.dataset import Dataset, Variable
from solver.views.columns import AMPLITUDE, attributes, column, harmonics

if TYPE_CHECKING:
    from solver.modes.driven.results import HeldAmplitude, PhaseResonance
    from solver.modes.peaks.performance import PerformanceCurve
    from solver.modes.results import ModalCurve, NonlinearMode


def mode_dataset(found: NonlinearMode) -> Dataset:
    """A point a row: amplitude, frequency, damping ratio, the states of the contacts and the mode shape."""
    variables = {
        "amplitude": column("point", found.amplitude, "√kg m", "a² = Σ Q_kᴴ M Q_k"),
        "frequency": column("point", found.frequency_hz, "Hz"),
        "damping_ratio": column("point", found.damping_ratio),
        "frequency_error": column("point", found.frequency_error, "Hz", "estimate by more harmonics"),
        "damping_error": column("point", found.damping_error, "", "estimate by more harmonics"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
        "forcing": column("point", found.forcing, "N/√kg", "|Qᴴ f| of the excitation, mode normalised"),
        **_states(found),
        "dof": column("dof", np.array(found.scene.dofs, dtype=np.str_)),
        **harmonics(found.dof_motions, ("point", "dof", "harmonic"), "motion", "m"),
    }
    notes = attributes(
        found.status.value, found.scene, mode_number=found.mode, harmonics=found.n_harmonics,
        nodal_diameter=found.nodal_diameter,
    )  # fmt: skip
    return Dataset(kind="modes", rows=("point",), variables=variables, attributes=notes)


def _states(found: ModalCurve) -> dict[str, Variable]:
    words = np.array(found.state_words, np.str_).reshape(found.states.shape)
    names = column("contact", np.array(found.contact_names, dtype=np.str_))
    return {"contact": names, "state": Variable(dims=("point", "contact"), values=words)}


def performance_dataset(curve: PerformanceCurve) -> Dataset:
    """A point of the mode a row: factor on the excitation or on the loads, and the peak with it."""
    variables = {
        "excitation": column("point", curve.excitation, "", "factor on every force"),
        "peak": column("point", curve.peak, "m", AMPLITUDE),
        "frequency": column("point", curve.frequency_hz, "Hz", "of the peak"),
        "load": column("point", curve.load, "", "factor on every load, the excitation as it is"),
        "peak_at_load": column("point", curve.peak_at_load, "m", "the peak then"),
    }
    notes = attributes(curve.mode.status.value, curve.mode.scene, mode_number=curve.mode.mode)
    return Dataset(kind="performance", rows=("point",), variables=variables, attributes=notes)


def held_dataset(found: HeldAmplitude) -> Dataset:
    """A frequency a row: the force that holds the amplitude, and the response to it."""
    stable = ["" if one is None else "yes" if one else "no" for one in found.stable]
    variables = {
        "frequency": column("point", found.frequency_hz, "Hz"),
        "excitation": column("point", found.excitation, "", "factor on every force"),
        "excitation_error": column("point", found.excitation_error, "", "estimate by more harmonics"),
        "phase": column("point", found.phase_deg, "deg", "of harmonic 1, ahead of the excitation"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
        "stable": column("point", np.array(stable, dtype=np.str_), "", "while the force is held"),
        **_states(found),
        **harmonics(found.observed, ("point", "harmonic"), "observed", "m"),
    }
    notes = attributes(found.status.value, found.scene, amplitude=found.held, harmonics=found.n_harmonics)
    return Dataset(kind="controlled", rows=("point",), variables=variables, attributes=notes)


def resonance_dataset(found: PhaseResonance) -> Dataset:
    """An amplitude a row: frequency and force of phase resonance."""
    variables = {
        "amplitude": column("point", found.amplitude, "√kg m", "a² = Σ Q_kᴴ M Q_k"),
        "frequency": column("point", found.frequency_hz, "Hz"),
        "excitation": column("point", found.excitation, "", "factor on every force"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
    }
    notes = attributes(found.status.value, found.scene, mode_number=found.mode)
    return Dataset(kind="phase-resonance", rows=("point",), variables=variables, attributes=notes)
