"""Two masses on a joint of Iwan's law, which comes from outside the package."""

from __future__ import annotations

from typing import Any

JOINED: dict[str, Any] = {
    "name": "joined",
    "structure": {
        "kind": "lumped",
        "masses": {"a": 1.0, "b": 0.6},
        "springs": [
            {"between": ["a", "ground"], "k": 1.0, "c": 0.02},
            {"between": ["a", "b"], "k": 0.8, "c": 0.02},
        ],
    },
    "contacts": [{"name": "joint", "law": "sliders", "between": ["b", "ground"], "k": 0.7, "limit": 0.8}],
    "excitation": {"dof": "a", "amplitude": 1.0},
    "observe": {"dof": "b", "band": [0.1, 0.3]},
}
