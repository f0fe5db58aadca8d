"""From a branch of the solver to a sweep as it is stored."""

from __future__ import annotations

from typing import TYPE_CHECKING

from service.arrays import encode
from service.jobs import ContactValues, SweepRecord
from service.strict_json import digest
from solver.scene import AnyContact, FrictionContact, Scene

if TYPE_CHECKING:
    from solver import Branch

_ARRAYS = ("amplitude", "half_peak_to_peak", "mean", "coefficients", "observed")


def sweep_record(branch: Branch, frequency_hz: float | None = None) -> SweepRecord:
    """The branch with the columns people filter by; the scene's values are those that stayed fixed.

    Parameters
    ----------
    branch : Branch
        With at least one point.
    frequency_hz : float or None
        Excitation frequency [Hz], if another parameter was swept.
    """
    scene, parameter = branch.balance.scene, branch.parameter
    peak = branch.peak
    band = branch.band if parameter == "frequency" else None
    amplitude = "excitation.amplitude"
    return SweepRecord(
        scene_name=scene.name,
        scene_hash=digest(scene.to_dict()),
        parameter=parameter,
        from_value=branch.start,
        to_value=branch.stop,
        frequency_hz=frequency_hz,
        excitation_amplitude=None if parameter == amplitude else scene.value(amplitude),
        harmonics=branch.balance.n_harmonics,
        points=len(branch.values),
        peak=None if peak is None else peak.value,
        peak_at=None if peak is None else peak.at,
        limit=None if band is None else band.limit,
        band_hz=None if band is None else band.width,
        newton_iterations=branch.newton_iterations,
        rejected_steps=branch.rejected_steps,
        seconds=branch.seconds,
        completed=branch.completed,
        status=branch.status.value,
        contacts=contact_values(scene, parameter),
        arrays={"parameter": encode(branch.values)}
        | {name: encode(getattr(branch, name)) for name in _ARRAYS},
    )


def contact_values(scene: Scene, parameter: str) -> tuple[ContactValues, ...]:
    """The values of every contact; None for what changes while `parameter` does."""
    owner, _, key = parameter.rpartition(".")
    return tuple(
        _values(contact, key if owner in (contact.name, contact.group) else "") for contact in scene.contacts
    )


def _values(contact: AnyContact, swept: str) -> ContactValues:
    if not isinstance(contact, FrictionContact):
        return ContactValues(name=contact.name, kt=None, mu=None, N0=None, N1=None, N1_phase=None)
    load_follows = swept in ("N1", "N1_ratio") or (swept == "N0" and contact.N1_ratio is not None)
    return ContactValues(
        name=contact.name,
        kt=None if swept == "kt" else contact.kt,
        mu=None if swept == "mu" else contact.mu,
        N0=None if swept == "N0" else contact.N0,
        N1=None if load_follows else contact.N1_value,
        N1_phase=None if swept == "N1_phase" else contact.N1_phase,
    )
