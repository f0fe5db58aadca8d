"""A chain whose motion is lopsided, with a stress and a material; the same stress as a sum in metres."""

from typing import Any

from solver.scene.scene import Scene

TERMS = {"a": 900.0, "b": -700.0}  # MPa/m
STEEL = {
    "name": "steel", "fatigue_strength": 300e6, "ultimate_strength": 900e6, "yield_strength": 700e6,
}  # fmt: skip


def stressed(*, static: float = 60.0, line: str = "goodman", second: float = 0.3, **observe: Any) -> Scene:
    """Without a `second` harmonic of the force the mean stress is the static one alone."""
    forces: list[dict[str, Any]] = [{"dof": "a", "amplitude": 1.0}]
    if second:
        forces.append({"dof": "b", "amplitude": second, "harmonic": 2, "phase": 0.7})
    return Scene.from_dict({
        "name": "stressed",
        "structure": {"kind": "lumped", "masses": {"a": 1.0, "b": 0.5}, "springs": [
            {"between": ["a", "ground"], "k": 40.0, "c": 0.5}, {"between": ["a", "b"], "k": 20.0, "c": 0.2,
             "name": "neck"},
        ]},
        "contacts": [{"name": "slides", "between": ["a", "b"], "kt": 30.0, "mu": 0.3, "N0": 1.5}],
        "excitation": forces,
        "recovery": [
            {"name": "fillet", "unit": "MPa", "terms": TERMS, "static": static, "material": "steel"},
            {"name": "root", "unit": "kPa", "terms": {"a": 200e3}, "material": "steel"},
            {"name": "metres", "unit": "m", "terms": {dof: 1e-3 * each for dof, each in TERMS.items()}},
        ],
        "materials": [{**STEEL, "line": line}],
        "observe": {"dof": "b", "band": [0.5, 2.2], **observe},
    })  # fmt: skip
