"""The units that files of matrices may be in; a schema names them without what reads the files."""

from __future__ import annotations

# Forces over displacements, and moments over angles, in the units of the files: what they are in N/m and
# N m. Masses go with them, as seconds stay seconds: t, mm, N and lbf s²/in, in, lbf are consistent units.
UNITS = {"SI": (1.0, 1.0), "mm": (1e3, 1e-3), "in": (4.4482216152605 / 0.0254, 4.4482216152605 * 0.0254)}
METRES = {"SI": 1.0, "mm": 1e-3, "in": 0.0254}
"""The length of each."""
