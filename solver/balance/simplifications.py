"""Which effects a run pays for: what may be left out without changing the answer, and the override.

Every saving but one is exact. A scene whose loads are constant and whose forces have odd harmonics only
responds with x(τ + π) = −x(τ) if no stiffness changes with the motion: even harmonics and mean are zero. A
contact that sticks all the time is its spring, and one that never touches is nothing: both are eliminated
from the Newton step. A tuned disk under a travelling wave repeats itself from sector to sector; where the
laws of its contacts allow other motions too that is an assumption, and said. Modes carry the linear part at
the cost of modes instead of matrices.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

from solver.errors import SettingError
from solver.scene.parameter_paths import changed_quantities, changes_loads
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Effects to pay for whether the scene calls for them or not; the rest is decided by the plan.

    Attributes
    ----------
    even_harmonics : bool
        Even harmonics and the mean, even where the response is half-wave symmetric.
    every_contact : bool
        Every contact stays in the Newton step, even one that cannot slip or never touches.
    every_port : bool
        Newton steps are solved for the motions of every contact, even where fewer lead them all.
    every_sector : bool
        The whole annulus, even of a tuned disk under a travelling wave.
    whole_matrices : bool
        The matrices of the linear part at every frequency, even where modes carry it.
    """

    even_harmonics: bool = False
    every_contact: bool = False
    every_port: bool = False
    every_sector: bool = False
    whole_matrices: bool = False

    @classmethod
    def everything(cls) -> Effects:
        """Return the settings that leave nothing out."""
        return cls(**dict.fromkeys((field.name for field in fields(cls)), True))

    @classmethod
    def read(cls, text: str) -> Effects:
        """Read ``auto``, ``all``, or names such as ``even-harmonics,every-sector``.

        Raises
        ------
        SettingError
            A name that is none of these.
        """
        if text == "auto":
            return cls()
        if text == "all":
            return cls.everything()
        known = [field.name.replace("_", "-") for field in fields(cls)]
        chosen = [name.strip() for name in text.split(",")]
        for name in chosen:
            if name not in known:
                raise SettingError("effects", name, f"must be `auto`, `all`, or of {', '.join(known)}")
        return cls(**{name.replace("-", "_"): True for name in chosen})


def even_harmonics_reason(scene: Scene, paths: Iterable[str] = ()) -> str | None:
    """Return why even harmonics and the mean are needed, or None if the response has odd harmonics only.

    Parameters
    ----------
    scene : what vibrates.
    paths : parameters that will be changed or differentiated by; a load amplitude breaks the symmetry.
    """
    for contact in scene.contacts:
        reason = contact.answers_unlike or contact.several_responses
        if reason is not None:
            return reason
    for force in scene.forces:
        if force.harmonic % 2 == 0:
            kind = "static" if force.harmonic == 0 else f"of harmonic {force.harmonic}"
            return f"the force on {force.place} is {kind}"
    for path in paths:
        if changes_loads(scene, path):
            return f"{path} changes a constant force"
        for quantity in changed_quantities(scene, path):
            if quantity.unlike_half_waves:
                return f"{path} {quantity.unlike_half_waves}"
    return None


def breaks_symmetry(scene: Scene, paths: Iterable[str] = ()) -> bool:
    """Return whether a motion and its negative half a period later are not answered alike.

    Without that a half-wave symmetric response is always one of the responses, if perhaps not the only one.
    """
    if any(contact.answers_unlike is not None for contact in scene.contacts):
        return True
    if any(force.harmonic % 2 == 0 for force in scene.forces):
        return True
    return any(quantity.breaks_symmetry for path in paths for quantity in changed_quantities(scene, path))
