"""The equations of motion of a scene as the time march reads them: sparse rows in the angle tau = omega t.

They share nothing with the harmonic balance: matrices are inverted here, not decomposed.

In the modes of the structure full matrices become diagonal ones: x = V q with Vᵀ M V = 1 makes of
x'' = W (f − Lᵀ F) − A x − B x' the rows q'' = Vᵀ f − (L V)ᵀ F − Λ q − D q'. A force acts on all modes: its
DOF stays as a coordinate that never moves, whose pull goes to the modes. What is observed is a sum of modes,
one more coordinate.

Each excitation and each phase of its shares has a motion y of its own, that of a mass on a spring and a
dashpot, driven so that its steady motion is the one prescribed, y'' + 2ω y' + ω² y = f(t): what else it does
dies out within a few periods. Its acceleration drives the rest. The last coordinate adds up the observed
motion: it has the acceleration of what is observed, and begins at rest with it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import block_diag, csr_array, diags_array, vstack

from solver.arrays import Real
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.contact_parts import Row
from solver.errors import SettingError
from solver.marching.kernels import march_state as kernel
from solver.marching.kernels.march_state import SparseRows, System, steady
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.bodies.kinematics import Form, pair_form
from solver.scene.excitation import Excitation
from solver.scene.linear_terms import End, dofs_at
from solver.scene.scene import LumpedStructure, MatricesStructure, Scene

FloatArray = NDArray[np.float64]
Push = tuple[int, float, float, int]  # coordinate, amplitude, phase [rad] and harmonic of a force
Terms = tuple[tuple[int, float], ...]  # coordinates with their factors in what is observed
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def with_base(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, index: dict[str, int], omega: float, *,
    swept: bool = False,
) -> tuple[csr_array, csr_array, csr_array, Terms, list[Push]]:  # fmt: skip
    """Return x'' = W f - A x - B x' with the base and what is observed behind x, of which terms, and f.

    Driven DOFs are pushed by what holds their accelerations a to those prescribed: with the rows S of x they
    are, x'' = P (W f - A x - B x') + Q a, Q = W Sᵀ (S W Sᵀ)⁻¹ and P = 1 - Q S. While the frequency is `swept`
    a base of which velocity or acceleration is prescribed has it by itself, without spring and dashpot.
    """
    n = A.shape[0]
    phases = _bases(scene)
    m = n + len(phases)
    A, B, W = (_grown(each, m) for each in (A, B, W))
    shares = np.zeros((n, len(phases)))
    pushes = []
    for i, (e, turn) in enumerate(phases):
        at = n + i
        held = not swept or (e.base is not None and e.base.motion == "displacement")
        A[at, at], B[at, at], W[at, at] = omega**2 * held, 2.0 * omega * held, 1.0
        # What drives the base to the motion prescribed, at ω.
        if e.base is None:
            raise SettingError("excitation", e.place, "must be a base that moves")
        turning = 1j * e.harmonic * omega
        steady = e.amplitude * cmath.exp(1j * (e.phase + turn)) / turning ** _ORDERS[e.base.motion]
        push = steady * (turning + omega) ** 2
        pushes.append((at, abs(push), cmath.phase(push), e.harmonic))
        for dof, share, phase in e.base.shares if e.base else ():
            shares[index[dof], i] += share * (phase == turn)
    ground = any(e.ground for e, _ in phases)
    moved = {index[dof] for e, _ in phases if e.base and not ground for dof, *_ in e.base.shares}
    driven = np.array(sorted(moved), np.int64)
    pulled, points = shares.copy(), np.array([index[point] for point in scene.points], np.int64)
    if points.size:  # no inertia pulls a point, but what its dashpot joins it to is accelerated
        heavy = np.setdiff1d(np.arange(n), points)
        pulled[points] = W[np.ix_(points, heavy)] @ np.linalg.solve(W[np.ix_(heavy, heavy)], shares[heavy])
    pushed = W[:n, driven] @ np.linalg.inv(W[np.ix_(driven, driven)])
    for matrix in (A, B, W):
        if ground:  # counted from the ground
            matrix[:n] -= pulled @ matrix[n:]
        else:
            matrix[:n] += pushed @ (shares[driven] @ matrix[n:] - matrix[driven])
    seen = [(index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ()]
    if scene.observe.relative:
        total = 0.0 if ground else sum(factor for _, factor in seen)
        of_base = np.array([-total * (turn == 0.0) for _, turn in phases])
    else:
        of_base = ground * sum((factor * shares[at] for at, factor in seen), np.zeros(len(phases)))
    terms = [*seen, *zip(range(n, m), of_base.tolist(), strict=True)]
    *grown, _ = with_sum(terms, csr_array(A), csr_array(B), csr_array(W))
    return *grown, tuple(terms), pushes


def base_over(scene: Scene, system: kernel.System, begin: float, change: float) -> kernel.System:
    """Return the equations of `with_base`, swept, with what moves the base as prescribed while φ' changes.

    With θ = k φ + phase the base moves by y = a cos θ, or y' or y'' is that: with y'' + 2 y' + y = f, in the
    unit of time, f = a (1 − θ'²) cos θ − a (2 θ' + θ'') sin θ, polynomials of time; else y'' = −a θ' sin θ,
    or a cos θ.

    Parameters
    ----------
    begin, change : φ' at its beginning and φ'', in the unit of time.
    """
    bases = _bases(scene)
    kept, omega = system.force_dof.size - len(bases), system.omega
    places, amplitudes, phases, harmonics = [], [], [], []
    for place, (e, turn) in zip(_places(scene, system), bases, strict=True):
        motion = e.base.motion if e.base else ""
        a, first, second = e.amplitude / omega ** _ORDERS[motion], e.harmonic * begin, e.harmonic * change
        by_motion = {
            "displacement": [
                (0.0, (1.0 - first**2, -2.0 * first * second, -(second**2))),
                (0.5 * math.pi, (2.0 * first + second, 2.0 * second, 0.0)),
            ],
            "velocity": [(0.5 * math.pi, (first, second, 0.0))],
            "acceleration": [(0.0, (1.0, 0.0, 0.0))],
        }
        for ahead, polynomial in by_motion[motion]:
            places.append(place)
            amplitudes.append(omega**2 * a * np.array(polynomial))
            phases.append(e.phase + turn + ahead)
            harmonics.append(e.harmonic)
    level, course = np.array(amplitudes)[:, 0], np.array(amplitudes)[:, 1:].T
    before = system.force_course[:, :kept] if system.force_course.size else np.zeros((2, kept))
    return system._replace(
        force_dof=np.append(system.force_dof[:kept], np.array(places, np.int64)),
        force_amplitude=np.append(system.force_amplitude[:kept], level),
        force_phase=np.append(system.force_phase[:kept], phases),
        force_harmonic=np.append(system.force_harmonic[:kept], np.array(harmonics, np.int64)),
        force_course=np.ascontiguousarray(np.hstack([before, course])),
    )


def base_begins(
    scene: Scene, index: Mapping[str, int], system: kernel.System, begin: float
) -> tuple[FloatArray, FloatArray]:
    """Return place and velocity of the base and of what it drives where a run begins, NaN of all else.

    Of a velocity or an acceleration the motion is the one that is steady at the first frequency, and at 0 Hz
    begins at the place 0. `begin` is φ' there in the unit of time.
    """
    places = _places(scene, system)
    x, v = np.full((2, system.A.start.size - 1), np.nan)
    driven = {dof for e, _ in _bases(scene) if e.base and not e.ground for dof, *_ in e.base.shares}
    for vector in (x, v):
        vector[[*places, *(index[dof] for dof in driven)]] = 0.0
    for at, (e, turn) in zip(places, _bases(scene), strict=True):
        order = _ORDERS[e.base.motion if e.base else ""]
        a = e.amplitude / system.omega**order * cmath.exp(1j * (e.phase + turn))
        for power, vector in ((-order, x), (1 - order, v)):
            known = power >= 0 or begin > 0.0
            vector[at] = (a * (1j * e.harmonic * begin) ** power).real if known else 0.0
            for dof, share, phase in e.base.shares if e.base and not e.ground else ():
                vector[index[dof]] += share * (phase == turn) * vector[at]
    return x, v


def _places(scene: Scene, system: kernel.System) -> range:
    """Return the coordinates of the bases: what is observed stands behind them."""
    end = system.A.start.size - 2
    return range(end - len(_bases(scene)), end)


def with_sum(
    terms: Sequence[tuple[int, float]], A: csr_array, B: csr_array, W: csr_array
) -> tuple[csr_array, csr_array, csr_array, int]:
    """Return the equations with a sum of coordinates as one more behind them, and where it is."""
    n = A.shape[0]
    grown = [_grown(each, n + 1) for each in (A, B, W)]
    for matrix in grown:
        matrix[n] = sum(factor * matrix[at] for at, factor in terms)
    A, B, W = map(csr_array, grown)
    return A, B, W, n


def _bases(scene: Scene) -> list[tuple[Excitation, float]]:
    """Return each base that moves with each phase of its shares, in the order of their coordinates."""
    moved = ((e, e.base.shares) for e in scene.excitation if e.base)
    # First the phase 0, that of what a relative motion is counted from.
    return [(e, phase) for e, own in moved for phase in dict.fromkeys((0.0, *(phase for *_, phase in own)))]


def _grown(matrix: csr_array, n: int) -> FloatArray:
    dense = np.zeros((n, n))
    dense[: matrix.shape[0], : matrix.shape[1]] = matrix.toarray()
    return dense


def rows(contacts: tuple[AnyContact, ...]) -> tuple[Row, ...]:
    """Return the rows of all contacts; a square limit in two directions is two of them.

    Raises
    ------
    SettingError
        A contact has a law that the march does not follow, such as a circular limit.
    """
    return tuple(row for contact in contacts for row in contact.rows())


def columns(placed: Sequence[tuple[Row, tuple[Form, ...]]], index: dict[str, int], n: int) -> dict[str, Any]:
    """Return the arrays of `solver.marching.kernels.march_state.System` that belong to the contacts.

    Parameters
    ----------
    placed : every row, and the relative motions of its contact.
    index : the coordinate of each DOF in use; n : how many coordinates there are.
    """
    found = [row for row, _ in placed]
    L = selection([own[row.port] for row, own in placed], index, n)
    normal = [() if row.normal_port is None else own[row.normal_port] for row, own in placed]
    loads = [np.array([(row.N1, row.N1_phase), *row.higher]).T for row in found]
    waves, phases = (_table([load[which] for load in loads], least=1) for which in range(2))
    scalars = ("kt", "mu", "N0", "kn", "rest", "presses", "gap", "damping")
    whole = ("history", "in_steps", "states")
    counts = {name: np.array([getattr(row, name) for row in found], dtype=np.int64) for name in whole}
    numbers = {name: np.array([getattr(row, name) for row in found], dtype=np.float64) for name in scalars}
    laws = np.array([row.follows.value for row in found], dtype=np.int64)
    motions = {"L": sparse_rows(L), "normal": sparse_rows(selection(normal, index, n))}
    swings = {"waves": waves, "wave_phases": phases, **steady(waves)}
    tables = {
        "powers": _table([row.powers for row in found], least=1),
        "numbers": _table([row.numbers for row in found]),
    }
    return {**numbers, **counts, **motions, **swings, "law": laws, **tables}


def _table(given: Sequence[Sequence[float]], *, least: int = 0) -> Real:
    """Return rows of several lengths as one array, 0 behind the shorter ones."""
    table = np.zeros((len(given), max([least, *map(len, given)])))
    for row, numbers in zip(table, given, strict=True):
        row[: len(numbers)] = numbers
    return table


def limit_of(system: System, load: Real) -> Real:
    """Return the limit of each row's friction for its load [N]."""
    return np.asarray(system.mu * load)


def selection(forms: Sequence[Form], index: dict[str, int], n: int) -> csr_array:
    """Return relative motions as rows over the coordinates."""
    terms = [(row, index[t.dof], t.factor) for row, form in enumerate(forms) for t in form]
    row, column, factor = np.array(terms, dtype=float).reshape(-1, 3).T
    return csr_array((factor, (row.astype(np.int64), column.astype(np.int64))), shape=(len(forms), n))


def sparse_rows(matrix: csr_array) -> SparseRows:
    """Return a matrix as the kernels read it."""
    return SparseRows(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data)


def as_sparse(rows: SparseRows, n: int) -> csr_array:
    """Return it again, with n columns."""
    return csr_array((rows.value, rows.column, rows.start), shape=(rows.start.size - 1, n))


_INDEPENDENT = 1e-9  # smallest singular value of the modes at the DOFs in use, relative to the largest


Equations = tuple[Real, Real, Real, dict[str, int]]
"""M⁻¹ K [1/s²], M⁻¹ C [1/s] and M⁻¹ [1/kg], (n, n) each, and the coordinate of each DOF in use."""


def _of_structure(structure: MatricesStructure, used: Sequence[str], spin: float) -> Equations:
    """The equations with the DOFs `used` as coordinates, at a speed of rotation `spin` [rad/s].

    SettingError if the structure is given by too few modes to tell the motions of these DOFs apart.
    """
    rows = dict(zip(structure.dofs, structure.dofs.rows, strict=True))
    if structure.modes is not None:
        return _of_modes(structure, list(dict.fromkeys(used)), rows)
    if structure.M is None or structure.K is None:
        raise SettingError("structure", structure.kind, "must have M and K, or `modes`")
    M, K = structure.M.array, structure.K.array
    symmetric = 0.5 * (K + K.T)
    C = structure.stiffness_proportional_damping * symmetric + structure.mass_proportional_damping * M
    if structure.C is not None:
        C = C + structure.C.array
    if structure.damping_ratio is not None:
        # C = 2 ζ M sqrt(M⁻¹ K): the square root taken in the coordinates where M is 1.
        factor = linalg.cholesky(M, lower=True)
        half = linalg.solve_triangular(factor, symmetric, lower=True)
        C = C + factor @ _modal_damping_root(linalg.solve_triangular(factor, half.T, lower=True),
                                            structure.damping_ratio) @ factor.T  # fmt: skip
    if structure.G is not None:
        C = C + spin * structure.G.array
    if structure.K_omega2 is not None:
        K = K + spin**2 * structure.K_omega2.array
    W = linalg.inv(M)
    return W @ K, W @ C, W, {name: rows[name] for name in used}


def _modal_damping_root(scaled: Real, ratios: float | Sequence[float]) -> Real:
    """Twice the square root of a stiffness where M is 1, each mode with its damping ratio."""
    values, vectors = linalg.eigh(scaled)
    zeta = _ratio_of_each(ratios, values.size)
    return np.asarray((vectors * (2.0 * zeta * np.sqrt(np.maximum(values, 0.0)))) @ vectors.T)


def _ratio_of_each(ratios: float | Sequence[float], count: int) -> Real:
    """The damping ratio of each of `count` modes: the last one given also of those above it."""
    given = np.atleast_1d(np.array(ratios, dtype=np.float64))
    return np.concatenate([given, np.full(max(count - given.size, 0), given[-1])])[:count]


def _of_modes(structure: MatricesStructure, used: list[str], rows: dict[str, int]) -> Equations:
    """Coordinates y = S q: the DOFs in use, and what of the modes q is orthogonal to them."""
    modes = structure.modes
    if modes is None:
        raise SettingError("structure", structure.kind, "must have `modes`")
    seen = modes.modes[[rows[name] for name in used]]
    sizes = linalg.svdvals(seen)
    if seen.shape[0] > seen.shape[1] or sizes[-1] <= _INDEPENDENT * sizes[0]:
        raise SettingError(
            "scene",
            f"{modes.omega2.size} modes at the DOFs {', '.join(used)}",
            "must have modes that tell its DOFs in use apart to be marched in time (or M and K)",
        )
    S = np.vstack([seen, linalg.null_space(seen).T])
    inverse = linalg.inv(S)
    omega = np.sqrt(modes.omega2)
    ratio = modes.damping_ratio
    if ratio is None:
        ratio = _ratio_of_each(structure.damping_ratio or 0.0, omega.size)
    damping = (
        2.0 * ratio * omega
        + structure.stiffness_proportional_damping * modes.omega2
        + structure.mass_proportional_damping
    )
    index = {name: i for i, name in enumerate(used)}
    return (S * modes.omega2) @ inverse, (S * damping) @ inverse, S @ S.T, index


@dataclass(frozen=True, slots=True)
class MarchEquations:
    """The equations of a scene, and what its coordinates are."""

    system: kernel.System
    observed: Annotated[
        int, "Coordinate observed; one behind those of the DOFs where it is a sum of several."
    ]
    index: Annotated[dict[str, int], "Coordinate of each DOF."]
    seen: Annotated[tuple[tuple[int, float], ...], "Coordinates that `observed` adds up, with their factors."]
    modes: Annotated[Real | None, "Motion of the DOFs in each, (n, n), where they are coordinates."] = None


_IN_TIME = "cannot be marched in time: it is a term of the frequency domain; give dashpots or damping ratios"


def _equations(scene: Scene) -> tuple[csr_array, csr_array, csr_array, dict[str, int]]:
    """A = M⁻¹ K, B = M⁻¹ C, W = M⁻¹ and the coordinate of each DOF in use."""
    structure, bodies = scene.structure, scene.bodies
    inertias = [csr_array(np.linalg.inv(body.mass_matrix())) for body in bodies]
    if isinstance(structure, MatricesStructure):
        # The bodies stand behind the coordinates of a structure given by matrices.
        own = [dof for body in scene.bodies for dof in body.dofs]
        ends = [term.dof for forms in scene.forms for form in forms for term in form]
        pushed = [dof for force in scene.forces for dof, *_ in force.parts]
        moved = [dof for force in scene.forces if force.base is not None for dof, *_ in force.base.shares]
        used = [*ends, *pushed, *moved, *(dof for dof, _ in scene.seen(scene.observe.dof) or ())]
        used += [dof for entry in scene.entries for end in (entry.on, entry.of) for dof in dofs_at(end)]
        spin = (scene.speed or 0.0) * REVOLUTIONS
        beside = {*own, *scene.points}
        *_, index = found = _of_structure(structure, [dof for dof in used if dof not in beside], spin)
        A, B, W = (csr_array(each) for each in found[:3])
        if not own:
            return A, B, W, index
        nothing, n = csr_array((len(own), len(own))), A.shape[0]
        A, B = (csr_array(block_diag([each, nothing])) for each in (A, B))
        W = csr_array(block_diag([W, *inertias]))
        return A, B, W, index | {dof: n + i for i, dof in enumerate(own)}
    if not isinstance(structure, LumpedStructure):
        raise SettingError("scene", scene.name, "must be written out as its annulus to be marched")
    every = (*structure.dofs, *(dof for body in bodies for dof in body.dofs))
    index = {dof: i for i, dof in enumerate(every)}
    M = np.array([mass.m for mass in structure.masses])
    k = np.array([spring.k for spring in structure.springs])
    c = np.array([spring.c for spring in structure.springs]) + structure.stiffness_proportional_damping * k
    dashpots = np.array([damper.c for damper in structure.dampers])
    springs = selection([pair_form(spring.between) for spring in structure.springs], index, len(index))
    dampers = selection([pair_form(damper.between) for damper in structure.dampers], index, len(index))
    K = springs.T @ diags_array(k) @ springs
    C = springs.T @ diags_array(c) @ springs + dampers.T @ diags_array(dashpots) @ dampers
    if structure.damping_ratio is not None:
        root, points = np.sqrt(M), M.size
        scaled = K.toarray()[:points, :points] / np.outer(root, root)
        modal = np.outer(root, root) * _modal_damping_root(scaled, structure.damping_ratio)
        C = csr_array(C) + csr_array(np.pad(modal, (0, len(index) - points)))
    C, K = csr_array(C), csr_array(K)
    inverse = diags_array(1.0 / M)
    if bodies:
        inverse = block_diag([inverse, *inertias], format="csr")
    return csr_array(inverse @ K), csr_array(inverse @ C), csr_array(inverse), index


def _with_couplings(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, index: dict[str, int]
) -> tuple[csr_array, csr_array, csr_array, dict[str, int]]:
    """The same with the couplings: each is a force on one DOF by the motion of another.

    SettingError for a term of the frequency domain: structural damping, an imaginary coefficient.
    """
    if scene.structure.loss_factor:
        raise SettingError("loss_factor", scene.structure.loss_factor, _IN_TIME)
    spin, n, points = (scene.speed or 0.0) * REVOLUTIONS, W.shape[0], scene.points
    index = index | {point: n + i for i, point in enumerate(points)}
    nothing = csr_array((len(points),) * 2)
    A, B, W = (csr_array(block_diag([each, nothing])) if points else each for each in (A, B, W))
    K, C = np.zeros((2, len(points), n + len(points)))
    for entry in scene.entries:
        if entry.k.imag != 0.0:
            raise SettingError("k_imaginary", entry.k.imag, _IN_TIME)
        k, c = entry.k.real + spin**2 * entry.k_omega2, entry.c.real + spin * entry.g
        on, at = (_row_at(end, index, W.shape[0]) for end in (entry.on, entry.of))
        if isinstance(entry.on, str) and entry.on in points:
            row = index[entry.on] - n
            K[row], C[row] = K[row] + k * at.toarray()[0], C[row] + c * at.toarray()[0]
            continue
        push = W @ on.T
        A, B = A + k * (push @ at), B + c * (push @ at)
    A, B, W = (csr_array(each) for each in (A, B, W))
    return (*(_with_points(scene, A, B, W, K, C) if points else (A, B, W)), index)


def _row_at(end: End, index: dict[str, int], size: int) -> csr_array:
    """What an entry acts on as a row over the coordinates."""
    if isinstance(end, str):
        factors, columns = np.ones(1), np.array([index[end]])
    else:
        factors = end.factors
        columns = np.arange(factors.size) if end.dofs is None else np.array([index[dof] for dof in end.dofs])
    return csr_array((factors, (np.zeros(columns.size, np.int64), columns)), shape=(1, size))


def _with_points(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, K: Real, C: Real
) -> tuple[csr_array, csr_array, csr_array]:
    """The same with rows of the points without inertia, for which C x' + K x = 0.

    With x' + R x = 0, R = C_z⁻¹ K, S = C_z⁻¹ C, the second-order rows are (d/dt + r) (S x' + R x) = 0: what
    does not fulfil the equation at the start dies out by its own rate r, the diagonal of R. SettingError for
    a contact or a force on a point.
    """
    n, points = A.shape[0] - len(K), scene.points
    ends = [
        (one.name, t.dof)
        for one, own in zip(scene.contacts, scene.forms, strict=True)
        for f in own
        for t in f
    ]
    for name, dof in (*ends, *(("excitation", dof) for e in scene.forces for dof, *_ in e.parts)):
        if dof in points:
            raise SettingError(name, dof, "must not be a point without inertia where it is marched in time")
    R, S = (np.linalg.solve(C[:, n:], each) for each in (K, C))
    S[:, n:] = 0.0
    r, own = np.diag(R[:, n:])[:, None], np.eye(len(K), A.shape[0], n)
    more = (r * R - S @ A, R + r * (S + own) - S @ B, -(S @ W))
    return tuple(
        csr_array(vstack([each[:n], csr_array(rows)])) for each, rows in zip((A, B, W), more, strict=True)
    )


def equations_of_motion(scene: Scene, omega: float, *, swept: bool = False) -> MarchEquations:
    """The equations of a scene in the angle tau = omega t; `swept` as of `with_base`."""
    A, B, W, index = _with_couplings(scene, *_equations(scene))
    seen = tuple((index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ())
    observed = seen[0][0]
    pushes = [
        (index[dof], force.amplitude * factor, force.phase + phase, force.harmonic)
        for force in scene.forces
        for dof, factor, phase in force.parts
    ]
    moves = any(force.base for force in scene.excitation)
    if scene.observed_unit != "m":
        wanted = "is not followed by the march, whose tolerance is one of displacements: observe DOFs"
        raise SettingError("observe", scene.observe.dof, wanted)
    if scene.observe.dof not in index and not moves:
        A, B, W, observed = with_sum(seen, A, B, W)
    if moves:
        A, B, W, seen, driving = with_base(scene, A, B, W, index, omega, swept=swept)
        observed, pushes = A.shape[0] - 1, pushes + driving
    A, B, W = A / omega**2, B / omega, W / omega**2
    dof, amplitude, phase, harmonic = zip(*pushes, strict=True) if pushes else ((), (), (), ())
    placed = [(row, own) for one, own in zip(scene.contacts, scene.forms, strict=True) for row in one.rows()]
    system = kernel.System(
        A=sparse_rows(A),
        B=sparse_rows(B),
        W=sparse_rows(W),
        force_dof=np.array(dof, dtype=np.int64),
        force_amplitude=np.array(amplitude, dtype=np.float64),
        force_phase=np.array(phase, dtype=np.float64),
        force_harmonic=np.array(harmonic, dtype=np.int64),
        omega=omega,
        **columns(placed, index, A.shape[0]),
    )
    return MarchEquations(system, observed, index, seen)


_FEWEST = 6  # coordinates; below, full matrices cost no more
_ROUNDING = 1e-10  # relative: of what is to be symmetric or diagonal


def in_modes(equations: MarchEquations) -> MarchEquations:
    """Return the equations in modes; as they are where they are few, sparse, or modes do not part them."""
    system = equations.system
    n = system.A.start.size - 1
    if n < _FEWEST or 2 * system.A.value.size < n * n or system.A_course.size:
        return equations
    A, B, W, L, normal = (
        as_sparse(each, n).toarray() for each in (system.A, system.B, system.W, system.L, system.normal)
    )
    if not _is_small(W - W.T, W) or linalg.eigvalsh(W)[0] <= 0.0:
        return equations
    mass = linalg.inv(W)
    stiffness = mass @ A
    if not _is_small(stiffness - stiffness.T, stiffness):
        return equations
    squares, V = linalg.eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    damping = V.T @ mass @ B @ V
    own = np.diag(damping)
    if not _is_small(damping - np.diag(own), damping):
        return equations
    pushed, places = np.unique(system.force_dof, return_inverse=True)
    still = np.zeros(pushed.size)
    spread = np.block([[np.eye(n), V[pushed].T], [np.zeros((pushed.size, n + pushed.size))]])
    seen = tuple((m, float(factor)) for m, factor in enumerate(V[equations.observed]))
    sparse = (csr_array(each) for each in (np.diag([*squares, *still]), np.diag([*own, *still]), spread))
    *moved, observed = with_sum(seen, *sparse)
    to, drive, inverse = (sparse_rows(each) for each in moved)
    wider = csr_array(np.pad(L @ V, ((0, 0), (0, pushed.size + 1))))
    pressing = csr_array(np.pad(normal @ V, ((0, 0), (0, pushed.size + 1))))
    changed = system._replace(
        A=to, B=drive, W=inverse, L=sparse_rows(wider), normal=sparse_rows(pressing), force_dof=n + places,
    )  # fmt: skip
    return replace(equations, system=changed, observed=observed, index={}, seen=seen, modes=V)


def moved_to(state: kernel.State, before: MarchEquations, now: MarchEquations) -> None:
    """Give a state of equations in modes the coordinates of others of the same scene."""
    if before.modes is None or now.modes is None:
        return
    n = len(now.modes)
    for vector in (state.x, state.v):
        vector[:n] = linalg.solve(now.modes, before.modes @ vector[:n])


def _is_small(rest: Real, whole: Real) -> bool:
    return bool(np.abs(rest).max() <= _ROUNDING * np.abs(whole).max())
