"""Scenes drawn up in code."""

from __future__ import annotations

from typing import Any

from solver.first_use import renamed
from solver.scene.scene import Scene
from solver.scene.toml import toml_text

End = str  # a DOF, `ground`, or in a cyclic structure `DOF@next`


class SceneBuilder:
    """Gathers masses, springs, contacts and forces, and makes the scene of them.

    Every method returns the builder, so that calls can be chained; the order does not matter. What is wrong
    is told by `build`, with the place of the part in the scene. Keywords beyond those named are those of
    scene files (docs/physics.md, docs/laws.md): ``name``, ``group``, ``factor``, the parameters of a law.

    Parameters
    ----------
    name : of the scene.
    sectors : of a disk of which the parts are one sector; left out, the structure stands alone.
    structure : further keys of ``[structure]``, for example ``stiffness_proportional_damping=1e-6``.
    """

    def __init__(self, name: str, *, sectors: int | None = None, **structure: object) -> None:
        kind: dict[str, object] = {"kind": "lumped"}
        if sectors is not None:
            kind = {"kind": "cyclic", "sectors": sectors}
        self._structure: dict[str, Any] = {**kind, "masses": {}, "springs": [], "dampers": [], **structure}
        self._rest: dict[str, Any] = {"name": name, "contacts": [], "excitation": []}

    def mass(self, dof: str, m: float, **more: object) -> SceneBuilder:
        """Add a mass m [kg] with a degree of freedom of this name."""
        self._structure["masses"][dof] = {"m": m, **more} if more else m
        return self

    def spring(self, a: End, b: End, k: float, c: float = 0.0, **more: object) -> SceneBuilder:
        """Add a spring k [N/m] between two DOFs, or one and `ground`, with a dashpot c [N s/m]."""
        self._structure["springs"].append({"between": [a, b], "k": k, "c": c, **more})
        return self

    def dashpot(self, a: End, b: End, c: float, **more: object) -> SceneBuilder:
        """Add a dashpot c [N s/m]."""
        self._structure["dampers"].append({"between": [a, b], "c": c, **more})
        return self

    def contact(self, name: str, a: End, b: End, **parameters: object) -> SceneBuilder:
        """Add a contact under any law: ``law`` (elastic Coulomb friction if left out) and its parameters.

        For example ``contact("damper", "m1", "ground", kt=30.0, mu=0.3, N0=100.0)``.
        """
        self._rest["contacts"].append({"name": name, "between": [a, b], **parameters})
        return self

    def force(self, dof: str, amplitude: float, **more: object) -> SceneBuilder:
        """Add a harmonic force [N]; ``phase`` [rad], ``harmonic``, ``engine_order`` and more by name."""
        self._rest["excitation"].append({"dof": dof, "amplitude": amplitude, **more})
        return self

    @renamed(low="start", high="stop")
    def observe(self, dof: str, start: float, stop: float, **more: object) -> SceneBuilder:
        """Say whose amplitude counts, and in which band of frequencies [Hz]."""
        self._rest["observe"] = {"dof": dof, "band": [start, stop], **more}
        return self

    def part(self, key: str, **table: object) -> SceneBuilder:
        """Add a table to any other list of a scene: ``part("bodies", name="wedge", mass=0.01)``."""
        self._rest.setdefault(key, []).append(table)
        return self

    def to_dict(self) -> dict[str, object]:
        """Return the scene as a table, unchecked."""
        structure = {key: value for key, value in self._structure.items() if value != []}
        return {**self._rest, "structure": structure}

    def build(self) -> Scene:
        """Return the scene.

        Raises
        ------
        SceneError
            Lists everything that is wrong, each with a JSON pointer.
        """
        return Scene.from_dict(self.to_dict())

    def toml(self) -> str:
        """Return the scene file of it; raises like `build`."""
        return toml_text(self.build().to_dict())
