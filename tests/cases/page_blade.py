"""Two blades from finite elements with a wedge under their platforms, as files."""

from __future__ import annotations

import io

import numpy as np
from matrix_cases import beam

ELEMENTS, PLATFORM = 12, 3  # the platform is at a quarter of the blade
_OWN = 2 * ELEMENTS + 2  # rows of a blade: bending, and its platform outward and along the axis
TOML = f"""
name = "own-blade"
speed = 4000.0

[structure]
kind = "matrices"
M = "own-blade.npz"
K = "own-blade.npz"
damping_ratio = 0.001
keep_modes = 4

[structure.dofs]
ax = {2 * PLATFORM - 2}
ay = {2 * ELEMENTS}
az = {2 * ELEMENTS + 1}
tip = {2 * ELEMENTS - 2}
bx = {_OWN + 2 * PLATFORM - 2}
by = {_OWN + 2 * ELEMENTS}
bz = {_OWN + 2 * ELEMENTS + 1}
tip-b = {_OWN + 2 * ELEMENTS - 2}

[[nodes]]
name = "left"
at = [-0.006, 0.0, 0.0]
dofs = {{ x = "ax", y = "ay", z = "az" }}

[[nodes]]
name = "right"
at = [0.006, 0.0, 0.0]
dofs = {{ x = "bx", y = "by", z = "bz" }}

[[dampers]]
name = "wedge"
shape = "wedge"
between = ["left", "right"]
at = [0.0, 0.0, 0.0]
out = [0.0, 1.0, 0.0]
axial = [0.0, 0.0, 1.0]
law = "coulomb-3d"
kt = 2.0e7
kn = 3.0e7
mu = 0.3
N0 = 0.0
points = 2
mass = 0.004
inertia = [2e-7, 2e-7, 1.2e-7]
radius_of_rotation = 0.35
angle = 0.35
width = 0.012
length = 0.004

[[excitation]]
dof = "tip"
amplitude = 2.0

[[excitation]]
dof = "tip-b"
amplitude = 2.0
phase = 3.1

[observe]
dof = "tip"
band = [150.0, 420.0]
"""


def matrices() -> bytes:
    """M and K of both blades as one npz."""
    blades = []
    for whole in beam(ELEMENTS, length=0.2, EI=160.0, mass=0.3):
        one = np.zeros((_OWN, _OWN))
        one[:-2, :-2] = whole
        blades.append(np.kron(np.eye(2), one))
    M, K = blades
    for blade in (0, 1):
        out, axial = (_OWN * blade + 2 * ELEMENTS + i for i in (0, 1))
        M[out, out] = M[axial, axial] = 0.15
        K[out, out], K[axial, axial] = 5e7, 4e6
    buffer = io.BytesIO()
    np.savez(buffer, M=M, K=K)
    return buffer.getvalue()
