"""Random chains with contacts that follow their history, and a march of their free vibration in numpy alone.

Nothing of the solver is used: matrices and laws are written out here from the numbers of the scene.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvalsh

Real = NDArray[np.float64]
SLIDERS, RATIO = 40, 10.0 ** (-3.0 / 40)  # of the law `iwan`, docs/laws.md
HALVINGS = 16  # of what the state of the contacts lacks to the steady one


def chain_of_history(seed: int) -> tuple[dict[str, Any], int, float]:
    """1 to 3 masses in a row with 1 or 2 contacts; the number of a mode and a size of its motion [m].

    Units of micrometres to decametres, contacts from a hundredth of the springs to ten times as stiff.
    """
    r = np.random.default_rng([seed, 1980])
    n = int(r.integers(1, 4))
    size, k0 = 10.0 ** r.uniform(-6.0, 1.0), 10.0 ** r.uniform(0.0, 6.0)
    dofs = [f"m{i}" for i in range(n)]
    masses = r.uniform(0.3, 3.0, n) * 10.0 ** r.uniform(-2.0, 2.0)
    omega = float(np.sqrt(k0 / masses.mean()))
    springs = [
        {"between": [dof, dofs[i - 1] if i else "ground"], "k": float(k), "c": float(0.004 * k / omega)}
        for i, (dof, k) in enumerate(zip(dofs, k0 * r.uniform(0.5, 2.0, n), strict=True))
    ]
    contacts = []
    for i in range(int(r.integers(1, 3))):
        first, second = int(r.integers(n)), int(r.integers(-1, n))
        ends = [dofs[first], "ground" if second in (-1, first) else dofs[second]]
        law = ("coulomb-tanh", "iwan", "bouc-wen")[(seed + i * int(r.integers(3))) % 3]
        contacts.append({"name": f"c{i}", "law": law, "between": ends, **_numbers(r, law, k0, size, omega)})
    body = {
        "name": f"history-mode-{seed}",
        "structure": {"kind": "lumped", "masses": dict(zip(dofs, masses.tolist(), strict=True)),
                      "springs": springs},
        "contacts": contacts,
        "excitation": {"dof": "m0", "amplitude": 1.0},
        "observe": {"dof": dofs[-1], "band": [0.01 * omega, omega]},
    }  # fmt: skip
    return body, int(r.integers(1, n + 1)), size * float(np.sqrt(masses.mean()))


def _numbers(r: np.random.Generator, law: str, k0: float, size: float, omega: float) -> dict[str, float]:
    """Parameters of a law that gives way at a motion of about `size`."""
    k, near = k0 * 10.0 ** r.uniform(-2.0, 1.0), size * 10.0 ** r.uniform(-0.5, 0.5)
    if law == "coulomb-tanh":
        mu, force = float(r.uniform(0.1, 0.8)), k0 * size * 10.0 ** r.uniform(-2.0, 0.0)
        return {"mu": mu, "N0": force / mu, "v0": omega * near * 10.0 ** r.uniform(-1.5, 0.3)}
    if law == "iwan":
        beta = 0.0 if r.random() < 0.2 else 10.0 ** r.uniform(-3.0, 1.0)
        return {"limit": k * near, "k": k, "chi": float(r.uniform(-0.9, 2.0)), "beta": beta}
    # Beyond 1e15 in 1/mⁿ a scene takes no number.
    sharp = [each for each in (1.0, 1.5, 2.0, 5.0, 10.0) if near**-each < 1e14]
    n, slope = float(r.choice(sharp)), float(r.choice([1.0, 0.5, 2.0]))
    beta = slope / near**n
    return {
        "k": k, "alpha": float(r.choice([0.0, 0.05, 0.5])), "A": slope, "beta": beta,
        "gamma": beta * float(r.choice([0.0, 1.0, r.uniform(-0.8, 1.0)])), "n": n,
    }  # fmt: skip


class _Law:
    """A contact of many motions at once, each with its state."""

    def __init__(self, given: dict[str, Any], count: int) -> None:
        self.given = given
        self.z = np.zeros((count, SLIDERS + 1 if given["law"] == "iwan" else 1))
        if given["law"] == "iwan":
            chi, beta, k = given["chi"], given["beta"], given["k"]
            mean = (chi + 1.0) / (chi + 2.0)
            top = given["limit"] * (1.0 + beta) / (k * (beta + mean))
            edges = np.append(RATIO ** np.arange(SLIDERS), 0.0)
            stiff, strong = -np.diff(edges ** (chi + 1.0)), -mean * top * np.diff(edges ** (chi + 2.0))
            self.kt = k / (1.0 + beta) * np.append(stiff, beta)
            self.reach = np.append(strong / stiff, top)

    @property
    def stiffness(self) -> float:
        """At rest [N/m]."""
        given = self.given
        if given["law"] == "bouc-wen":
            return float(given["k"] * (given["alpha"] + (1.0 - given["alpha"]) * given["A"]))
        return float(given.get("k", 0.0))

    def move(self, du: Real) -> None:
        """Follow changes of the motion, (count,)."""
        given, z = self.given, self.z
        if given["law"] == "iwan":
            self.z = np.clip(z + du[:, None], -self.reach, self.reach)
        elif given["law"] == "bouc-wen":
            middle = z[:, 0] + 0.5 * du * self._slope(z[:, 0], du)
            z[:, 0] += du * self._slope(middle, du)

    def _slope(self, z: Real, du: Real) -> Real:
        same = self.given["beta"] * np.sign(du * z) + self.given["gamma"]
        return np.asarray(self.given["A"] - same * np.abs(z) ** self.given["n"])

    def force(self, u: Real, v: Real) -> Real:
        """Force [N] at motions and speeds, (count,) each."""
        given = self.given
        if given["law"] == "iwan":
            return np.asarray(self.z @ self.kt)
        if given["law"] == "bouc-wen":
            return np.asarray(given["k"] * (given["alpha"] * u + (1.0 - given["alpha"]) * self.z[:, 0]))
        return np.asarray(given["mu"] * given["N0"] * np.tanh(v / given["v0"]))


class FreeMarch:
    """Free vibrations of a chain with the damping −2ζωM, several at once.

    Parameters
    ----------
    motions : (count, n, 2H + 1) coefficients [mean, c1, s1, …] of odd harmonics alone.
    omega, zeta : (count,).
    steps : of a period, even.
    """

    def __init__(self, body: dict[str, Any], motions: Real, omega: Real, zeta: Real, steps: int) -> None:
        of = body["structure"]
        dofs = list(of["masses"])
        self.m = np.array(list(of["masses"].values()))

        def row(ends: list[str]) -> Real:
            return np.array([(dof == ends[0]) - 1.0 * (dof == ends[1]) for dof in dofs])

        lines = np.array([row(each["between"]) for each in of["springs"]])
        k, c = (np.array([each[key] for each in of["springs"]]) for key in "kc")
        self.K, self.C = lines.T @ (k[:, None] * lines), lines.T @ (c[:, None] * lines)
        self.rows = np.array([row(each["between"]) for each in body["contacts"]])
        self.laws = [_Law(each, len(motions)) for each in body["contacts"]]
        self.motions, self.omega, self.zeta, self.steps = motions, omega, zeta, steps

    def _at(self, turns: float) -> tuple[Real, Real]:
        """Displacements and speeds of the motions given after a share of their period."""
        ks = np.arange(1, (self.motions.shape[2] - 1) // 2 + 1)
        c, s = self.motions[:, :, 1::2], self.motions[:, :, 2::2]
        cos, sin = np.cos(2.0 * np.pi * turns * ks), np.sin(2.0 * np.pi * turns * ks)
        x = self.motions[:, :, 0] + c @ cos + s @ sin
        return x, self.omega[:, None] * (s @ (ks * cos) - c @ (ks * sin))

    def natural(self) -> tuple[Real, Real]:
        """Frequencies ω [rad/s] with all contacts away, and as at rest."""
        stiff = np.array([law.stiffness for law in self.laws])
        matrices = self.K, self.K + self.rows.T @ (stiff[:, None] * self.rows)
        free, stuck = (np.sqrt(eigvalsh(matrix, np.diag(self.m))) for matrix in matrices)
        return free, stuck

    def balances(self) -> tuple[Real, Real]:
        """ω and ζ by work and virial of the motions given; the contacts end in their steady states.

        Odd motions have odd forces: the state after half a period is the negative of the one before. The mean
        of what a state is and the negative of what it becomes is nearer by half or better.
        """
        half = self.steps // 2
        x, v = zip(*(self._at(j / self.steps) for j in range(half + 1)), strict=True)
        for law, row in zip(self.laws, self.rows, strict=True):
            law.move(x[0] @ row)  # one step is enough to begin with
        for turn in range(HALVINGS + 1):
            before = [law.z.copy() for law in self.laws]
            work, virial = np.zeros(self.omega.size), np.zeros(self.omega.size)
            for j in range(half):
                if turn == HALVINGS:
                    f = self._forces(x[j], v[j])
                    work += ((v[j] @ self.C + f) * v[j]).sum(axis=1)
                    virial += ((x[j] @ self.K + f) * x[j]).sum(axis=1)
                for law, row in zip(self.laws, self.rows, strict=True):
                    law.move((x[j + 1] - x[j]) @ row)
            for law, was in zip(self.laws, before, strict=True):
                law.z = 0.5 * (was - law.z)
        kinetic = sum((each**2) @ self.m for each in v[:-1])
        omega = self.omega * np.sqrt(virial / kinetic)
        return omega, work / (2.0 * self.omega * kinetic)

    def last_harmonics(self) -> Real:
        """The speed in the last third of the harmonics, relative to that in the first."""
        size = np.hypot(self.motions[:, :, 1::2], self.motions[:, :, 2::2])
        speeds = np.arange(1, size.shape[2] + 1) * size
        last = speeds[:, :, 2 * size.shape[2] // 3 :].sum(axis=2).max(axis=1)
        return np.asarray(last / size[:, :, 0].max(axis=1))

    def departure(self) -> Real:
        """How far a march is from where it began after one period, relative to the largest motion.

        Leapfrog; what depends on the speed by the midpoint rule.
        """
        x, v = self._at(0.0)
        first, largest = np.concatenate([x, v / self.omega[:, None]], axis=1), np.abs(x).max(axis=1)
        dt = (2.0 * np.pi / self.omega / self.steps)[:, None]
        for _ in range(self.steps):
            middle = x + 0.5 * dt * v
            self._move(middle - x)
            half = v + 0.5 * dt * self._push(middle, v)
            v = v + dt * self._push(middle, half)
            self._move(0.5 * dt * v)
            x = middle + 0.5 * dt * v
            largest = np.maximum(largest, np.abs(x).max(axis=1))
        last = np.concatenate([x, v / self.omega[:, None]], axis=1)
        return np.asarray(np.abs(last - first).max(axis=1) / largest)

    def _move(self, dx: Real) -> None:
        for law, row in zip(self.laws, self.rows, strict=True):
            law.move(dx @ row)

    def _forces(self, x: Real, v: Real) -> Real:
        rows = zip(self.laws, self.rows, strict=True)
        return np.asarray(sum(np.outer(law.force(x @ row, v @ row), row) for law, row in rows))

    def _push(self, x: Real, v: Real) -> Real:
        less = 2.0 * (self.zeta * self.omega)[:, None] * v
        return np.asarray(less - (x @ self.K + v @ self.C + self._forces(x, v)) / self.m)
