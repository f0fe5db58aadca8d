"""Where a nonlinear mode begins: the linear mode about the equilibrium, contacts as they are there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance
from solver.continuation.walk import Pace
from solver.jit.fourier import Complex, Real, cosine_position
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.modes.mode_curve import Corrected, ModeState, carried_anew, correct
from solver.modes.mode_equations import Equations, step
from solver.modes.mode_structure import plain

_MOST = 60  # Newton steps to the equilibrium
_LEAST = 1e-10  # relative motion of a contact below which a mode does not move it
_RUNGS = 6  # decades below the first amplitude from which the mode is walked up, if it must
_DECADE = math.log(10.0)
_PACE = Pace(first=_DECADE / 3.0, least=_DECADE / 100.0)  # of ln a on the way up
_MOST_AT_FIRST = 40
_MAJORITY = 0.5  # share of a² in the mode asked for, of which only one mode can have more
_SAME = 1e-4  # of ω and in ζ, within which a motion of another shape is of a mode just as fast
_HEAVY = 0.3  # first-order share of another mode by damping, beyond which the modes are complex
_PARTS = np.geomspace(1e-3, 1.0, 31)  # of the damping, by which such a mode is followed from the undamped one


class LinearMode:
    """A mode of the structure with the contacts' slopes at rest.

    Attributes
    ----------
    omega : natural frequency [rad/s]; zeta : damping ratio ψᴴ C ψ / 2ω.
    shape : (n,) mass-normalised, in the coordinates of the matrices.
    ports : (nc,) motions of the contacts; drag : (n,) what dashpots answer per unit of its speed.
    """

    def __init__(self, omega: float, zeta: float, shape: Complex, ports: Complex, drag: Complex) -> None:
        self.omega, self.zeta, self.shape, self.ports, self.drag = omega, zeta, shape, ports, drag

    @property
    def moves_contacts(self) -> bool:
        """Whether any contact takes part."""
        largest = float(np.abs(self.shape).max(initial=0.0))
        return bool(np.any(np.abs(self.ports) > _LEAST * largest))


def linear_modes(balance: Balance, slopes: Complex, omega: float = 1.0) -> list[LinearMode]:
    """Return the modes of harmonic 1 with stiffness `slopes` (nc, nc) at the ports, slowest first.

    Parameters
    ----------
    slopes : what is not Hermitian in them is drag, iω times dashpots.
    omega : frequency [rad/s] at which they were taken.

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass matrix is not positive definite.
    """
    model = balance.model
    one = np.array([1], dtype=np.int64)
    diameters = model.diameters(one)
    (K,), (C,), (M,) = model.at(diameters, one > 0)
    if model.line is None:
        (M,) = model.inertia(diameters, one)
    L = model.ports_at(diameters)[0]
    free = np.ix_(model.free, model.free)
    held = L.conj().T @ slopes @ L
    dashpots = C + (held - hermitian(held)) / (1j * omega)
    found = undamped_modes(plain(hermitian((K + held)[free])), plain(hermitian(M[free])))
    shapes = np.zeros((M.shape[0], found.flexibility.size), np.complex128)
    shapes[model.free] = found.phi
    drags = dashpots @ shapes
    lost = np.sum(shapes.conj() * drags, axis=0).real
    omegas = np.sqrt(np.maximum(found.omega2, 0.0))
    zetas = np.divide(lost, 2.0 * omegas, out=np.zeros(lost.size), where=omegas > 0.0)
    rows = zip(omegas.tolist(), zetas.tolist(), shapes.T, (L @ shapes).T, drags.T, strict=True)
    return [LinearMode(*each) for each in rows]


def damped_mode(modes: list[LinearMode], i: int) -> LinearMode:
    """Return the solution of [K + iωC − (ω² + 2iζω²) M] ψ = 0 that mode i becomes as C rises from 0.

    A dashpot may be so stiff that it holds what the undamped mode moves most.
    """
    basis = np.stack([mode.shape for mode in modes], 1)
    squares = np.array([mode.omega**2 for mode in modes])
    drag = basis.conj().T @ np.stack([mode.drag for mode in modes], 1)
    apart = np.abs(squares - squares[i])
    apart[i] = np.inf
    if np.all(modes[i].omega * np.abs(drag[:, i]) <= _HEAVY * apart):
        return modes[i]
    omega, zeta, share = modes[i].omega, modes[i].zeta, np.eye(len(modes), dtype=np.complex128)[i]
    for part in _PARTS:
        values, vectors = np.linalg.eig(np.diag(squares) + 1j * omega * part * drag)
        alike = np.abs(vectors.conj().T @ share)
        alike[values.real <= 0.0] = -1.0
        best = int(np.argmax(alike))
        share, square = vectors[:, best], float(values[best].real)
        omega, zeta = math.sqrt(max(square, 0.0)), float(values[best].imag) / (2.0 * square)
    ports = np.stack([mode.ports for mode in modes], 1)
    return LinearMode(omega, zeta, basis @ share, ports @ share, modes[i].drag)


def equilibrium(equations: Equations, omega: float) -> Real | None:
    """Return the motions of the leading ports at rest under constant forces, (r, n); None if not found."""
    w, s, n = np.zeros((equations.r, equations.n)), equations.structure, equations.n
    if s.ks[0] != 0 or equations.size == 0:
        return w
    still = s.at(omega, 0.0, s.nearest(omega, 0.0))
    A = still.receptance()[0].real
    pushed = np.zeros((s.ks.size, s.constant.size), np.complex128)
    pushed[0] = s.constant * (s.level @ omega ** np.arange(3))
    free = still.solve(pushed)[0]
    free = (s.contact[0] @ free).real
    for _ in range(_MOST):
        if not equations.contacts(w, omega):
            return None
        residual = w[:, 0] - free + A @ equations.shifted_forces(w)[:, 0]
        size = max(np.abs(w[:, 0]).max(initial=0.0), np.abs(free).max(initial=0.0), 1e-300)
        if np.abs(residual).max(initial=0.0) <= 1e-12 * size:
            break
        motions, pulls = equations.loose()[:, :, : equations.size : n]
        J = np.eye(equations.r) + A @ equations.slopes()[:, 0, :, 0] + motions.T @ pulls
        move = step(J, -residual, np.ones(equations.r))
        if move is None:
            return None
        w = w.copy()
        w[:, 0] += move
    return w if n else None


def slopes_at_rest(equations: Equations, w: Real, omega: float) -> Complex | None:
    """Return the slopes of the port forces of harmonic 1 by its motions, (nc, nc), without the shift.

    Forces that follow the speed are their imaginary part.
    """
    if not equations.contacts(w, omega):
        return None
    balance, ks = equations.balance, equations.structure.ks
    here = int(cosine_position(ks, equations.structure.first))
    nc = balance.n_ports
    G = np.zeros((nc, nc), np.complex128)
    rows, columns, blocks = equations._blocks.T
    block = equations.point.dF_dU[blocks]
    # A force that is no function of the phase answers a cosine and a sine alike; the mean of both else.
    G[rows, columns] = 0.5 * (block[:, here, here] + block[:, here + 1, here + 1])
    G[rows, columns] += 0.5j * (block[:, here, here + 1] - block[:, here + 1, here])
    return G


def phase_of(equations: Equations) -> Complex:
    """Return the force (N,) that harmonic 1 lags by a quarter of a period: the excitation's first harmonic.

    Where there is none it is a force along the observed motion.
    """
    s = equations.structure
    force = s.force if np.any(s.force) else s.observe[s.first].conj()
    return np.asarray(force / (np.abs(force).max() or 1.0))


def coordinates_of(equations: Equations, mode: LinearMode) -> Complex:
    """Return a linear mode in the coordinates of the structure, (N,)."""
    s = equations.structure
    if not s.is_diagonal:
        return mode.shape
    model = equations.balance.model
    one = np.array([1], dtype=np.int64)
    (M,) = model.plain(model.diameters(one))[2]
    return np.asarray(s.shapes[s.first].conj().T @ (M @ mode.shape))


def first_state(
    equations: Equations, mode: LinearMode, rest: Real, log_amplitude: float, *, turns: bool,
) -> ModeState:  # fmt: skip
    """Return a guess at an amplitude: the equilibrium and the linear mode, in the phase of the equations.

    Parameters
    ----------
    rest : (r, n) the equilibrium.
    turns : the motion may begin at any instant: the phase is then one in which the mode is seen.
    """
    s, a = equations.structure, math.exp(log_amplitude)
    x = coordinates_of(equations, mode)
    force = phase_of(equations)
    seen = complex(np.vdot(force, x))
    if abs(seen) > 1e-9 * np.linalg.norm(force) * np.linalg.norm(x):
        x = x * (-1j * abs(seen) / seen)
    phase = force
    if turns:
        phase = 1j * s.momentum(x)
    number = s.nearest(mode.omega, mode.zeta)
    q = a * complex(np.vdot(s.carried[:, number], x))
    moved = a * (s.contact[s.first] @ x)
    w, here = rest.copy(), int(cosine_position(s.ks, s.first))
    if equations.size:
        w[:, here], w[:, here + 1] = moved.real, -moved.imag
    y = np.concatenate([w.reshape(-1), [q.real, q.imag, mode.omega, mode.zeta]])
    return ModeState(y=y, log_amplitude=log_amplitude, mode=number, phase=phase / np.linalg.norm(phase))


def begin(equations: Equations, mode: LinearMode, rest: Real, low: float, *, turns: bool) -> Corrected:
    """Solve at the first amplitude, ln a = `low`; where that fails, from a smaller one upward.

    What another mode has most of is no beginning of the one asked for: it counts as failed.
    """

    def guess(at: float) -> ModeState:
        return first_state(equations, mode, rest, at, turns=turns)

    spent = 0
    for rung in range(_RUNGS + 1):
        found = correct(equations, guess(low - rung * _DECADE), most=_MOST_AT_FIRST)
        found = replace(found, converged=found.converged and _is_of(equations, mode, found))
        spent += found.iterations
        if found.converged:
            break
    while found.converged and found.state.log_amplitude < low:
        found = _raised(equations, found, rest, low)
        spent += found.iterations
    return replace(found, iterations=spent)


def _is_of(equations: Equations, mode: LinearMode, found: Corrected) -> bool:
    """Return whether a point moves mostly in a linear mode, or in one as fast and as damped."""
    if found.at is None:
        return False
    s, shape = equations.structure, coordinates_of(equations, mode)
    x = found.at.x[s.first]
    own, moved = s.momentum(shape), s.momentum(x)
    size = abs(complex(np.vdot(shape, own))) * abs(complex(np.vdot(x, moved)))
    omega, zeta = found.state.y[-2:]
    alike = abs(omega - mode.omega) <= _SAME * mode.omega and abs(zeta - mode.zeta) <= _SAME
    return bool(alike or abs(complex(np.vdot(own, x))) ** 2 >= _MAJORITY * size)


def _raised(equations: Equations, found: Corrected, rest: Real, low: float) -> Corrected:
    """Return the next point on the way up to ln a = `low`, a third of a decade on, or less if it must."""
    rise = min(_PACE.first, low - found.state.log_amplitude)
    # The last rise may be as short as it will.
    size, better, least = equations.size, found, min(_PACE.least, 0.5 * rise)
    while rise > least:
        raised = found.state.scaled(size, math.exp(rise), rest.reshape(-1))
        guess = replace(raised, log_amplitude=found.state.log_amplitude + rise)
        better = correct(equations, guess, most=_MOST_AT_FIRST)
        if better.converged:
            return carried_anew(equations, better)
        rise = _PACE.shorter(rise)
    return better
