"""One period of a solution or a march in numbers: time history, loops of the contacts, what they do when."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from solver.contacts.laws.contact_parts import ContactMotion
from solver.scene.scene import AnyContact

if TYPE_CHECKING:
    from solver.marching.march_result import MarchResult
    from solver.response.contact_response import ContactResponse
    from solver.response.solution import Solution

FloatArray = NDArray[np.float64]


class Shares(BaseModel):
    """Shares of the period."""

    stick: float
    slip: float
    separation: float


class ContactPeriod(BaseModel):
    """A contact over one period; the first instant is repeated at the end of `slip`, `force` and `load`."""

    name: str
    state: str
    slip: list[float] = Field(description="Slip motion [m].")
    force: list[float] = Field(description="Force [N].")
    load: list[float] = Field(description="Normal load [N], 0 while open.")
    motion: list[int] | None = Field(description="0 stick, 1 slip, 2 separation; null for other laws.")
    shares: Shares | None


class Period(BaseModel):
    """One period."""

    time: list[float] = Field(description="Instants [s].")
    displacement: list[float] = Field(description="Of the observed DOF [m].")
    contacts: list[ContactPeriod]


def period_of(solution: Solution, samples: int) -> dict[str, Any]:
    """One period of a converged balance.

    Parameters
    ----------
    samples : of the period; the first is repeated at its end.

    Returns
    -------
    The JSON of a `Period`.
    """
    from solver.jit import fourier

    tau = np.linspace(0.0, 2.0 * math.pi, samples + 1)
    displacement = fourier.basis(tau, solution.highest_harmonic) @ solution.observed
    omega = 2.0 * math.pi * solution.frequency_hz
    given = [contact.at_frequency(omega) for contact in solution.scene.contacts]
    pairs = zip(given, solution.contacts, strict=True)
    return {
        "time": (tau / (2.0 * math.pi * solution.frequency_hz)).tolist(),
        "displacement": displacement.tolist(),
        "contacts": [_contact(given, found, tau) for given, found in pairs],
    }


def history_of(march: MarchResult, samples: int) -> dict[str, Any]:
    """The last period of a march, thinned out to about `samples`; of an annulus its first sector."""
    step = max(1, len(march.time) // samples)
    first = [i for i, name in enumerate(march.contacts) if name.partition("@")[2] in ("", "0")]
    return {
        "time": [*march.time[::step].tolist(), 1.0 / march.frequency_hz],
        "displacement": _closed(march.displacement[::step]),
        "contacts": [
            {
                "name": march.contacts[i].partition("@")[0],
                "slip": _closed(march.slip[i, ::step]),
                "force": _closed(march.contact_force[i, ::step]),
                "load": _closed(march.normal_load[i, ::step]),
            }
            for i in first
        ],
    }


def _contact(given: AnyContact, found: ContactResponse, tau: FloatArray) -> dict[str, Any]:
    from solver.jit import fourier

    slip = fourier.basis(tau, (found.slip.size - 1) // 2) @ found.slip
    load = fourier.basis(tau, (found.load.size - 1) // 2) @ found.load
    motions = np.array(found.motions)
    force = found.force_over(given, tau[:-1])
    motion = None if given.is_rigid else given.motion_at(motions, found.load, force, tau[:-1])
    shares = None
    if motion is not None:
        shares = {each.name.lower(): motion.count(each) / len(motion) for each in ContactMotion}
    return {
        "name": found.name, "state": found.state.value, "slip": slip.tolist(), "force": _closed(force),
        "load": np.maximum(load, 0.0).tolist(),
        "motion": None if motion is None else [each.value for each in motion], "shares": shares,
    }  # fmt: skip


def _closed(samples: FloatArray) -> list[float]:
    """Samples of a period with the first repeated at its end."""
    closed: list[float] = np.append(samples, samples[:1]).tolist()
    return closed
