"""Two masses on a joint of Iwan's law, which comes from outside the package."""

from typing import Any

from lumped_structure import lumped

JOINED: dict[str, Any] = {
    "name": "joined",
    "structure": lumped({"a": 1.0, "b": 0.6}, ("a", "ground", 1.0, 0.02), ("a", "b", 0.8, 0.02)),
    "contacts": [{"name": "joint", "law": "sliders", "between": ["b", "ground"], "k": 0.7, "limit": 0.8}],
    "excitation": {"dof": "a", "amplitude": 1.0},
    "observe": {"dof": "b", "band": [0.1, 0.3]},
}
