"""The plan: which effects a scene calls for, which are left out, and why, in words and numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.balance import build
from solver.kernels.system import DENSE, MODES, POLES
from solver.scene import Scene
from solver.scene_parts import CyclicStructure

# Fitted to responses of the shipped scenes at 11 harmonics on one core of a server: seconds of a Newton
# iteration, of one contact with n coefficients (times n²), and of a solve with n unknowns (times n³).
_SECONDS_AN_ITERATION = 5e-6
_SECONDS_A_CONTACT = 2e-8
_SECONDS_A_SOLVE = 1.5e-10
_ITERATIONS_A_POINT = 4.0

_FORMS = {
    MODES: "undamped modes: the damping is diagonal in them, so a frequency costs modes x contacts^2",
    POLES: "poles and residues: the damping couples the modes, the complex eigenvectors span the state space",
    DENSE: "the matrices themselves: the eigenvectors do not span the state space",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One effect, whether it is paid for, and why.

    Attributes
    ----------
    name : str
        For example ``separation``.
    used : bool
        Whether it is computed.
    reason : str
        In words and numbers.
    """

    name: str
    used: bool
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What solving a scene will take.

    Attributes
    ----------
    effects : tuple of Effect
        Those in use and those left out.
    unknowns : int
        Real unknowns of the condensed balance.
    linear_dofs, contacts, harmonics : int
        Sizes behind it.
    seconds_a_point : float
        Estimated cost of a point of a branch [s].
    """

    scene: str
    effects: tuple[Effect, ...]
    unknowns: int
    linear_dofs: int
    contacts: int
    harmonics: int
    seconds_a_point: float

    def to_json(self) -> dict[str, object]:
        """Return the plan as one JSON object."""
        return {
            "scene": self.scene,
            "effects": [
                {"name": effect.name, "used": effect.used, "reason": effect.reason} for effect in self.effects
            ],
            "unknowns": self.unknowns,
            "linear_dofs": self.linear_dofs,
            "contacts": self.contacts,
            "n_harmonics": self.harmonics,
            "estimated_seconds_a_point": self.seconds_a_point,
        }


def plan(scene: Scene, *, harmonics: int = 11) -> Plan:
    """Return what solving a scene takes: the effects in use and left out, sizes and estimated cost.

    Raises
    ------
    SettingError
        A bad number of harmonics.
    """
    balance = build(scene, harmonics=harmonics)
    n, contacts = balance.n_unknowns, len(scene.contacts)
    iteration = (
        _SECONDS_AN_ITERATION
        + _SECONDS_A_CONTACT * contacts * balance.n_coefficients**2
        + _SECONDS_A_SOLVE * n**3
    )
    return Plan(
        scene=scene.name,
        effects=(
            _condensation(scene, n, balance.n_coefficients),
            _one_sector(scene),
            *(_separation(scene, i) for i in range(contacts)),
            Effect(
                name="even harmonics and mean",
                used=True,
                reason=f"harmonics 0 to {harmonics}: {balance.n_coefficients} coefficients a contact",
            ),
            Effect(name="linear part", used=True, reason=_FORMS[balance.system.form]),
            _stiffness_shift(balance.system.shift),
        ),
        unknowns=n,
        linear_dofs=len(scene.structure.dofs),
        contacts=contacts,
        harmonics=harmonics,
        seconds_a_point=_ITERATIONS_A_POINT * iteration,
    )


def _condensation(scene: Scene, unknowns: int, coefficients: int) -> Effect:
    dofs = len(scene.structure.dofs)
    return Effect(
        name="condensation",
        used=True,
        reason=(
            f"the {dofs} linear DOFs are eliminated exactly: {unknowns} unknowns (contacts x coefficients) "
            f"instead of {dofs * coefficients}"
        ),
    )


def _one_sector(scene: Scene) -> Effect:
    structure = scene.structure
    if isinstance(structure, CyclicStructure):
        reason = (
            f"the disk is tuned and the excitation a travelling wave of engine order {scene.engine_order}: "
            f"one sector stands for all {structure.sectors}"
        )
        return Effect(name="one sector for the annulus", used=True, reason=reason)
    return Effect(
        name="one sector for the annulus", used=False, reason="the structure is lumped, it has no sectors"
    )


def _separation(scene: Scene, i: int) -> Effect:
    contact = scene.contacts[i]
    least = contact.N0 - abs(contact.N1_value)
    loses = least < 0.0
    reason = f"the normal load of {contact.name} falls to {least:g} N" if loses else (
        f"the normal load of {contact.name} stays at {least:g} N or more"
    )  # fmt: skip
    return Effect(name=f"separation of {contact.name}", used=loses, reason=reason)


def _stiffness_shift(shift: np.ndarray) -> Effect:
    used = bool(np.any(shift > 0.0))
    reason = (
        "a part is held in place by contacts alone, so their stiffness is moved into the structure and taken "
        "out of the force again (exact)"
        if used
        else "the structure alone holds every part in place"
    )
    return Effect(name="contact stiffness in the structure", used=used, reason=reason)
