"""A blade with a friction damper to the ground: the least that damps by friction."""

from __future__ import annotations

from typing import Any, ClassVar

from solver.scene.templates.template import BLADE, Size, Template, Word


class GroundDamper(Template):
    """A blade with one mode and a friction damper to the ground.

    Attributes
    ----------
    normal_load : float or None
        Mean normal load [N]. Left out: friction of the size of the force, which is near the best.
    """

    NAME: ClassVar[str] = "ground-damper"
    TITLE: ClassVar[str] = "Blade with a damper to the ground"

    name: Word = "my-blade"
    normal_load: Size | None = None

    @property
    def stiffening(self) -> float:
        """The whole stiffness of the contact."""
        return self.kt

    def tables(self) -> dict[str, Any]:
        """One mass, one spring, one contact."""
        load = self.normal_load or self.usual_load
        contact = {"name": "damper", "between": [BLADE, "ground"], "kt": self.kt, "mu": self.mu, "N0": load}
        masses = {BLADE: self.modal_mass}
        return {
            "name": self.name,
            "structure": {"kind": "lumped", "masses": masses, "springs": [self.blade_spring()]},
            "contacts": [contact],
            **self.excited(),
        }
