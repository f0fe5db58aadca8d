"""A cylinder on a flat of the same steel, whose meshes do not match, made by scikit-fem.

Plane strain, 1 m thick. Both parts are blocks of quadrangles, fine where they touch; the lower face of the
upper one is curved with the radius RADIUS. The flat stands on its foot; the top of the cylinder moves as one,
held by springs, pressed down and then rubbed to and fro. Nodes near the contact are kept, the rest follows
(Craig, Bampton), and each node of the cylinder touches the flat by its mortar weights. Run, it prints what
Hertz, Cattaneo and Mindlin say beside what comes out, and draws cylinder.png in the folder it is run in.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, diags_array
from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip
from solver.matrices.craig_bampton import craig_bampton
from solver.matrices.decks.deck import Deck
from solver.matrices.mortar import mortar
from solver.matrices.values import DofTable

YOUNG, POISSON, DENSITY, RADIUS, MU = 2.1e11, 0.3, 7850.0, 0.1, 0.4  # N/m², -, kg/m³, m, -
REDUCED = YOUNG / (2.0 * (1.0 - POISSON**2))  # E* of two equal bodies [N/m²]
HALF_WIDTH = 1e-3  # m, about that of the contact: the measure of the meshes
LAYER = 200.0  # stiffness of the contact, in E*/HALF_WIDTH for an area
REACH, SIZE = 1.4, 14.0  # of it: how far nodes are kept, half width and height of the blocks


def graded(step: float, *, both: bool) -> np.ndarray:
    """Coordinates [m] with even steps up to REACH, longer and longer ones up to SIZE."""
    fine = np.arange(0.0, REACH + step, step)
    far = fine[-1] + np.cumsum(step * 1.25 ** np.arange(1.0, 60.0))
    side = np.concatenate([fine, far[far < 0.9 * SIZE], [SIZE]]) * HALF_WIDTH
    return np.concatenate([-side[:0:-1], side]) if both else side


def block(step: float, shift: float, up: float) -> tuple[Any, Any, np.ndarray]:
    """K, M and nodes (n, 2) of a block whose face is at y = 0, above it (up = 1) or below (-1)."""
    x, y = graded(step, both=True) + shift * step * HALF_WIDTH, up * graded(step, both=False)
    grid = MeshQuad.init_tensor(x, np.sort(y))
    places = grid.p.copy()
    if up > 0.0:  # the curved face, flattened towards the top
        places[1] += places[0] ** 2 / (2.0 * RADIUS) * (1.0 - places[1] / places[1].max())
    basis = Basis(MeshQuad(places, grid.t), ElementVector(ElementQuad1()))
    K = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    M = BilinearForm(lambda u, v, _: DENSITY * dot(u, v)).assemble(basis)
    order = basis.nodal_dofs.T.ravel()  # x and y of node after node
    return csr_array(K)[order][:, order], csr_array(M)[order][:, order], places.T


def cylinder_on_flat(steps: int = 12, *, force: float, rub: float, layer: float = LAYER) -> dict[str, Any]:
    """The scene: `steps` elements to HALF_WIDTH, forces on the top [N]."""
    upper, lower = block(1.0 / steps, 0.0, 1.0), block(0.87 / steps, 0.3, -1.0)
    count, places = len(upper[2]), np.vstack([upper[2], lower[2]])
    K, M = (csr_array(block_diag([upper[i], lower[i]])) for i in (0, 1))
    top = np.flatnonzero(places[:count, 1] > (SIZE - 1e-6) * HALF_WIDTH)
    foot = np.flatnonzero(places[:, 1] < (1e-6 - SIZE) * HALF_WIDTH)
    near = np.abs(places[:, 0]) < REACH * HALF_WIDTH
    face = np.arange(len(places)) < count
    curve = places[:, 0] ** 2 / (2.0 * RADIUS)
    first = np.flatnonzero(face & near & (np.abs(places[:, 1] - curve) < 1e-9 * RADIUS))
    wide = np.abs(places[:, 0]) < (REACH + 2.0 / steps) * HALF_WIDTH
    second = np.flatnonzero(~face & wide & (np.abs(places[:, 1]) < 1e-9 * RADIUS))

    # One column for each motion kept: nodes that are free, then the top as one in x and in y.
    free = np.setdiff1d(np.arange(len(places)), np.concatenate([top, foot]))
    rows = np.concatenate([2 * free, 2 * free + 1, 2 * top, 2 * top + 1])
    ends = np.repeat([2 * free.size, 2 * free.size + 1], top.size)
    columns = np.concatenate([np.arange(2 * free.size), ends])
    T = csr_array(
        coo_array((np.ones(rows.size), (rows, columns)), shape=(2 * len(places), 2 * free.size + 2))
    )
    held = np.zeros(T.shape[1])
    held[-2:] = 0.1 * REDUCED
    at = {int(node): i for i, node in enumerate(free)}
    dofs = {f"n{node}x": at[int(node)] for node in (*first, *second)}
    dofs |= {f"n{node}y": at[int(node)] + free.size for node in (*first, *second)}
    dofs |= {"top_x": 2 * free.size, "top_y": 2 * free.size + 1}
    small = craig_bampton(
        coo_array(T.T @ M @ T), coo_array(T.T @ K @ T + diags_array(held)), None, DofTable(dofs), 2,
        weigh=False,
    ).matrices  # fmt: skip

    space = {i: (float(x), float(y), 0.0) for i, (x, y) in enumerate(places)}
    pair = mortar(Deck(space), first.tolist(), second.tolist(), (0.0, -1.0, 0.0))
    k = layer * REDUCED / HALF_WIDTH
    contacts = []
    points = zip(pair.nodes, pair.weights, pair.places, pair.areas, pair.gaps, strict=True)
    for node, weights, place, area, gap in points:
        heaviest = max(weights, key=lambda other: weights[other])
        contacts.append(
            {
                "name": f"c{node}", "law": "elastic-normal", "between": [f"n{node}", f"n{heaviest}"],
                "at": place.tolist(), "normal": [0.0, -1.0, 0.0],
                "spread": {f"n{other}": weight for other, weight in weights.items()},
                "kt": k * float(area), "kn": k * float(area), "mu": MU, "N0": -k * float(area * gap),
            }
        )  # fmt: skip
    nodes = [
        {"name": f"n{i}", "at": list(space[int(i)]), "dofs": {"x": f"n{i}x", "y": f"n{i}y"}}
        for i in (*first, *second)
    ]
    return {
        "name": "cylinder",
        "structure": {
            "kind": "matrices", "M": small["M"].tolist(), "K": small["K"].tolist(),
            "dofs": [*dofs, "mode1", "mode2"], "damping_ratio": 0.01,
        },
        "nodes": nodes, "contacts": contacts,
        "excitation": [
            {"dof": "top_x", "amplitude": rub}, {"dof": "top_y", "amplitude": -force, "harmonic": 0},
        ],
        "observe": {"dof": "top_x", "band": [1.0, 100.0]},
    }  # fmt: skip


class Tractions(NamedTuple):
    """What the contact carries where the rubbing force is largest."""

    x: np.ndarray  # m
    pressure: np.ndarray  # N/m²
    shear: np.ndarray  # N/m²
    P: float  # N
    Q: float  # N


def tractions(raw: dict[str, Any], harmonics: int = 3) -> Tractions:
    """Solve the scene far below its resonances and read off pressure and shear at t = 0."""
    scene = stickslip.Scene.from_dict(raw)
    found = stickslip.solve(scene, frequency_hz=1.0, harmonics=harmonics)
    if not found.converged:
        raise SystemExit(f"not solved: {found.status}")
    tau, omega = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False), 2.0 * math.pi
    area = np.array([contact["kn"] for contact in raw["contacts"]]) * HALF_WIDTH / (LAYER * REDUCED)
    normal, along = np.zeros((2, area.size))
    for i, (given, answer) in enumerate(zip(scene.contacts, found.contacts, strict=True)):
        load = given.normal_load(answer.motions)  # mean, then cosine and sine of each harmonic
        normal[i] = max(load[0] + load[1::2].sum(), 0.0)
        along[i] = answer.force_over(given.at_frequency(omega), tau)[0]
    x = np.array([contact["at"][0] for contact in raw["contacts"]])
    return Tractions(x, normal / area, along / area, float(normal.sum()), float(along.sum()))


class ClosedForm(NamedTuple):
    """Hertz's line contact, with the tangential load of Cattaneo (1938) and Mindlin (1949)."""

    half_width: float  # m
    peak: float  # N/m²
    stick: float  # share of the half width that sticks

    @classmethod
    def of(cls, P: float, Q: float) -> ClosedForm:
        """Of a normal force and a tangential one, below μP (K. L. Johnson, Contact Mechanics, 1985)."""
        a = math.sqrt(4.0 * P * RADIUS / (math.pi * REDUCED))
        return cls(a, 2.0 * P / (math.pi * a), math.sqrt(1.0 - Q / (MU * P)))

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and shear."""
        s, c = x / self.half_width, self.stick
        whole, inner = (np.sqrt(np.maximum(1.0 - each**2, 0.0)) for each in (s, s / c))
        return self.peak * whole, MU * self.peak * (whole - c * inner)


class Measured(NamedTuple):
    """The same, measured."""

    half_width: float  # m, of the ellipse through the pressures
    peak: float  # N/m², of that ellipse
    sticks_to: float  # m, the outermost node that sticks
    slips_from: float  # m, the innermost one that slips

    @classmethod
    def of(cls, found: Tractions) -> Measured:
        """Fit p² = p0² (1 − x²/a²) where p is above a fifth of its peak; look at every node."""
        x, p = np.abs(found.x), found.pressure
        inner = p > 0.2 * p.max()
        slope, square = np.polyfit(x[inner] ** 2, p[inner] ** 2, 1)
        slips = np.abs(found.shear) >= MU * p * (1.0 - 1e-6)
        ends = float(x[~slips & (p > 0.0)].max()), float(x[slips & (p > 0.0)].min())
        return cls(math.sqrt(-square / slope), math.sqrt(square), *ends)


PRESSED = 1.12 * math.pi * REDUCED * HALF_WIDTH**2 / (4.0 * RADIUS)  # N on the top; its springs take a part


def main() -> None:
    """Print the figures, draw the picture."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.6), sharey=True, layout="constrained")
    for axis, share in zip(axes, (0.5, 0.8), strict=True):
        found = tractions(cylinder_on_flat(24, force=PRESSED, rub=share * MU * PRESSED))
        wanted, seen = ClosedForm.of(found.P, found.Q), Measured.of(found)
        a = wanted.half_width
        print(f"Q/(mu P) {found.Q / (MU * found.P):.3f}")
        print(f"  half width {1e3 * seen.half_width:.4f} mm, Hertz {1e3 * a:.4f} mm")
        print(f"  peak {1e-6 * seen.peak:.2f} MPa, Hertz {1e-6 * wanted.peak:.2f} MPa")
        print(f"  sticks to {seen.sticks_to / a:.3f} a, slips from {seen.slips_from / a:.3f} a, "
              f"Cattaneo and Mindlin {wanted.stick:.3f} a")  # fmt: skip
        s = np.linspace(-1.3, 1.3, 400) * a
        for closed, nodes, words in zip(wanted.at(s), found[1:3], ("pressure", "shear / μ"), strict=True):
            scale = wanted.peak * (MU if words != "pressure" else 1.0)
            (line,) = axis.plot(s / a, closed / scale, lw=1.0, label=f"{words}, closed form")
            axis.plot(found.x / a, nodes / scale, ".", color=line.get_color(), label=f"{words}, mortar")
        axis.set(xlabel="x / a", title=f"Q = {found.Q / (MU * found.P):.2f} μP")
    axes[0].set_ylabel("traction / peak pressure")
    axes[0].legend(fontsize=8, loc="lower center")
    figure.savefig("cylinder.png", dpi=110)


if __name__ == "__main__":
    main()
