"""What `solver.studies.plan` returns: the effects of a scene, its sizes, what it costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from solver.arrays import FloatOrNaN
from solver.results.base import Shown
from solver.results.told import Piece
from solver.results.views import Views


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Effect(Piece):
    """An effect that a scene calls for or does not, and why."""

    name: Annotated[str, "For example ``separation``."]
    used: Annotated[bool, "Whether it is computed."]
    reason: Annotated[str, "In words and numbers."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Plan(Shown):
    """What solving a scene will take."""

    VIEWS: ClassVar = Views("solver.views", "of_plan", "plan_dataset")
    JSON: ClassVar = (
        "scene effects unknowns linear_dofs contacts n_harmonics=harmonics"
        " estimated_seconds_a_point=seconds_a_point estimated_seconds_of_stability=seconds_of_stability"
        " estimated_dense_bytes=dense_bytes performance_curve"
    )

    scene: Annotated[str, "Name of the scene."]
    effects: Annotated[tuple[Effect, ...], "Those in use and those left out."]
    unknowns: Annotated[int, "Real unknowns of the condensed balance."]
    linear_dofs: Annotated[int, "Linear DOFs behind it."]
    contacts: Annotated[int, "Contacts."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    seconds_a_point: Annotated[float, "Estimated cost of a point of a branch [s]."]
    dense_bytes: Annotated[int, "Estimated memory of the dense matrices of a response [bytes]."]
    performance_curve: Annotated[
        str,
        "Whether the performance curve of one mode may stand in for responses in a design, and when it does.",
    ] = ""
    seconds_of_stability: Annotated[
        FloatOrNaN,
        "Estimated cost of the Floquet multipliers of a response [s], infinite (null in JSON) where it is "
        "not known; answers have them by themselves below a second.",
    ] = 0.0
