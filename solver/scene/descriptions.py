"""What editors show of a scene's keys beside the docstrings of its models; examples of parameter paths."""

from __future__ import annotations

from typing import Any

WORDS: dict[str, dict[str, str]] = {
    "*": {
        "between": "The two ends: names of DOFs (with `normal`: of bodies and nodes), or \"ground\"; "
        "\"tip@next\" is the tip of the next sector of a cyclic structure.",
        "k": "Stiffness [N/m].",
        "c": "Damping [N s/m].",
        "m": "Mass [kg].",
        "kind": "lumped: point masses; cyclic: one sector of a disk; matrices: from files.",
        "shape": "wedge, cylinder, asymmetric, split-ring or shroud.",
        "masses": "DOF to its mass [kg], or to a table with m, name, group and factor.",
        "springs": "Springs, each with `between` and `k` [N/m], and `c` [N s/m] of a dashpot beside it.",
        "dampers": "Dashpots, each with `between` and `c` [N s/m].",
        "sectors": "Number of sectors of the disk.",
        "loss_factor": "Structural damping: the stiffness is K (1 + i loss_factor).",
        "mistuning": "Factors that make the blades differ.",
        "stiffness_proportional_damping": "C gains this many times K [s].",
    },
    "Scene": {"dampers": "Dampers by their shape, which make their bodies and contacts themselves."},
    "MatricesStructure": {
        "M": "Mass matrix [kg]: a file (.npz, .mat, .mtx, Harwell-Boeing, …) or its rows.",
        "K": "Stiffness matrix [N/m]: a file or its rows.",
        "C": "Damping matrix [N s/m]: a file or its rows; may be left out.",
        "symmetric": "false: K and C may differ from their transposes.",
        "G": "Gyroscopic matrix, antisymmetric [N s/m per rad/s]: C gains it times the speed of rotation.",
        "K_omega2": "Stiffness per squared speed of rotation [N/m per (rad/s)²].",
        "modes": "Mass-normalised modes in place of the matrices: a file or a table.",
        "dofs": "Name of a DOF to its row (zero-based) or to a label such as 1203.UX; or all names.",
        "keep_modes": "Reduce a large model onto the DOFs named, with so many modes beside them.",
        "units": "Units of the files.",
        "mapping": "File that says which row is which node and component.",
        "damping_ratio": "Damping ratio of every mode, or a list of those of each, added to the rest.",
        "mass_proportional_damping": "C gains this many times M [1/s].",
        "reduction": "What a model was before it was reduced; set when it is.",
        "diameters": "A reduced sector, in place of M, K and C: the file that `stickslip import` wrote.",
        "outline": "What is drawn of the mesh of a sector; set where a deck or a reduced sector tells it.",
        "cyclic": "How the matrices of a sector are joined to the next one.",
    },
    "CyclicBoundary": {
        "low": "Nodes of the boundary to the sector before: a set of the deck, or a list.",
        "high": "Nodes of the boundary to the next sector, where the low one comes when turned.",
        "nodes": "The input deck with the positions of nodes and their sets.",
        "pair_by": "Nodes of both boundaries are paired by position, or in their order.",
        "tolerance": "Distance within which two nodes are one place, in the units of the deck.",
        "keep_modes": "Reduce the sector at each nodal diameter, with so many modes beside its DOFs.",
    },
}  # fmt: skip

EXAMPLES: dict[str, list[Any]] = {
    "name": ["bladed-disk"],
    "between": [["tip", "tip@next"], ["damper", "ground"]],
    "masses": [{"tip": 0.02, "disk": 0.12}],
    "k": [5e5],
    "c": [2.0],
    "m": [0.1],
    "gap": [1e-4],
    "kn": [4e6],
    "mass": [0.005],
    "force": [5.0],
    "at": [[0.0, 0.0, 0.0]],
    "radius_of_rotation": [0.3],
    "angle": [0.5],
    "width": [0.01],
    "radius": [0.005],
    "kt": [5.53e6],
    "mu": [0.3],
    "N0": [200.0],
    "N1_ratio": [0.3],
    "load": [[120.0, {"order": 1, "amplitude": 30.0, "phase": 0.2}, {"order": 3, "amplitude": 5.0}]],
    "order": [3],
    "band": [[500.0, 900.0]],
    "normal": [[0.0, 1.0, 0.0]],
    "inertia": [[2e-8, 2e-8, 3e-8]],
    "amplitude": [50.0],
    "engine_order": [1],
    "sectors": [8],
    "M": ["model-M.mtx"],
    "K": ["model-K.mtx"],
    "dofs": [{"tip": 98, "root": "1203.UX"}],
}


# Examples in help, schemas and errors.
DISK_LOAD = "shroud.N0"
"""Normal load of a contact of the shipped scene `bladed-disk`."""
DAMPER_LOAD = "damper.N0"
"""That of `two-dof`."""
DISK_LOADS = "shroud.N0,root.N0"
"""Both loads of `bladed-disk`, which share a value."""
