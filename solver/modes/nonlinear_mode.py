"""The nonlinear mode of a scene: the function users call, from checked settings to the result.

The points become arrays, each begun where harmonic 1 lags the excitation by 90 degrees. What more harmonics
would change of a point is told by one Newton step with twice as many.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from solver.balance.balance import Balance, build, check_harmonics
from solver.balance.kernels.output import extremes
from solver.balance.simplifications import Effects
from solver.contacts.kernels.system import DENSE, System, by_reference
from solver.errors import SettingError, check_count
from solver.jit.fourier import Complex, Integer, Real, to_full
from solver.jit.timer import clock
from solver.linear.assembly import linear_model
from solver.modes.mode_curve import Corrected, FollowedCurve, ModeState, follow, scales
from solver.modes.mode_equations import BESIDES, Equations
from solver.modes.mode_results import NonlinearMode, NonlinearModeStatus
from solver.modes.mode_start import (
    LinearMode,
    begin,
    damped_mode,
    equilibrium,
    linear_modes,
    phase_of,
    slopes_at_rest,
)
from solver.results.watch import shows_progress
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import MOST_HARMONICS, even_harmonics_reason, spread

if TYPE_CHECKING:
    from solver.scene.scene import Scene

LEAST = 1e-100  # amplitude whose square, and that of its inverse, floating-point numbers can tell
MOST_POINTS = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeProblem:
    """A scene made ready: equations, the linear mode it begins with, whether it may begin any time."""

    equations: Equations
    mode: LinearMode
    all_modes: Annotated[list[LinearMode], "The linear modes, slowest first."]
    rest: Annotated[Real, "(r, n) the equilibrium at the leading ports."]
    turns: Annotated[bool, "No load varies with a phase of its own: the motion may begin at any instant."]


@shows_progress("nonlinear mode")
def nonlinear_mode(
    scene: Scene, mode: int = 1, *, amplitudes: Sequence[float], nodal_diameter: int | None = None,
    harmonics: int = 11, errors: bool = True, most_points: int = MOST_POINTS,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> NonlinearMode:  # fmt: skip
    """Follow a mode over its amplitude by the extended periodic motion concept.

    [−k²ω²M + ikω(C − 2ζωM) + K] q_k + F_k(q) = 0, k = 0 … H (Krack, Comput. Struct. 154 (2015) 59,
    doi:10.1016/j.compstruc.2015.03.008): the artificial damping −2ζωM keeps the motion periodic, so ζ(a) is
    what the structure and its contacts dissipate. Constant forces stay, all others are left out.

    Parameters
    ----------
    scene : what vibrates; its loads and constant forces count, its excitation gives the phase alone.
    mode : number of the mode, 1 the slowest, of the structure with its contacts as they are at rest.
    amplitudes : smallest and largest modal amplitude a [√kg m], a² = Σ_k≥1 Q_kᴴ M Q_k.
    nodal_diameter : of a cyclic structure, from −sectors/2 to sectors/2, negative for a wave that travels
        backward; that of the scene's engine order if left out.
    harmonics : highest harmonic kept.
    errors : estimate what more harmonics would change, for about as much time again.
    most_points : of the curve.
    on_progress : is told the share of ln a that is done and the number of points.
    should_stop : is asked at every point whether to stop there.

    Raises
    ------
    SettingError
        A mode, amplitudes, nodal diameter or harmonics that cannot be, each with what would be right.
    """
    begun = clock()
    low, high = (math.log(each) for each in check_amplitudes(amplitudes))
    check_count("most_points", most_points, 1)
    problem = pose(scene, mode, nodal_diameter, harmonics)
    equations = problem.equations
    first = begin(equations, problem.mode, problem.rest, low, turns=problem.turns)
    curve = follow(
        equations, first, high, turns=problem.turns, most_points=most_points, on_progress=on_progress,
        should_stop=should_stop,
    )  # fmt: skip
    return collect(equations, curve, mode=int(mode), turns=problem.turns, errors=errors, begun=begun)


def check_amplitudes(amplitudes: Sequence[float]) -> tuple[float, float]:
    """Return smallest and largest amplitude; SettingError where their squares cannot be told."""
    wanted = f"must be two numbers, {LEAST:g} <= smallest < largest <= {1.0 / LEAST:g} [√kg m]"
    try:
        low, high = (float(each) for each in amplitudes)
    except (TypeError, ValueError):
        raise SettingError("amplitudes", amplitudes, wanted) from None
    if not LEAST <= low < high <= 1.0 / LEAST:
        raise SettingError("amplitudes", tuple(amplitudes), wanted)
    return low, high


def pose(
    scene: Scene, mode: int, nodal_diameter: int | None, harmonics: int, *, whole: bool = False,
    kind: type[Equations] = Equations, paths: Sequence[str] = (),
) -> ModeProblem:  # fmt: skip
    """Return the equations of a mode and where it begins; errors as `nonlinear_mode`.

    Parameters
    ----------
    whole : keep whole matrices whatever the damping is.
    kind : what is asked of a motion.
    paths : by which derivatives are wanted: some call for even harmonics.
    """
    if check_harmonics(harmonics) < 1:
        raise SettingError("harmonics", harmonics, "must be from 1: a mode needs harmonic 1")
    scene = at_nodal_diameter(scene, nodal_diameter)
    check_mode(scene, mode)
    even = even_harmonics_reason(scene, paths) is not None
    equations = kind(_balance(scene, harmonics, whole=whole, even=even))
    found = _begin(equations, mode)
    if equations.structure.is_diagonal and not found[0].moves_contacts:
        # The modes kept are those that contacts or forces see.
        equations = kind(_balance(scene, harmonics, whole=True, even=even))
        found = _begin(equations, mode)
    loads = [contact.load for contact in equations.balance.scene.contacts]
    turns = not any(load is not None and load.orders for load in loads)
    return ModeProblem(equations=equations, mode=found[0], rest=found[1], turns=turns, all_modes=found[2])


def _balance(scene: Scene, harmonics: int, *, whole: bool, even: bool) -> Balance:
    effects = Effects(whole_matrices=whole, even_harmonics=even)
    return build(scene, harmonics=harmonics, effects=effects, poles=False)


def _begin(equations: Equations, mode: int) -> tuple[LinearMode, Real, list[LinearMode]]:
    """Return the linear mode about the equilibrium, that, and all linear modes."""
    guess = 1.0
    nc = equations.balance.n_ports
    modes = linear_modes(equations.balance, np.zeros((nc, nc), np.complex128))
    guess = max(modes[mode - 1].omega, 1e-3 * modes[-1].omega)
    rest = equilibrium(equations, guess)
    slopes = None if rest is None else slopes_at_rest(equations, rest, guess)
    if rest is None or slopes is None:
        raise SettingError(
            "scene", equations.balance.scene.name, "must have an equilibrium under its constant forces"
        )
    found = linear_modes(equations.balance, slopes, guess)
    return damped_mode(found, mode - 1), rest, found


def check_mode(scene: Scene, mode: int) -> None:
    """Raise SettingError unless the structure has a mode of that number."""
    most = int(np.count_nonzero(linear_model(scene).free))
    whole = isinstance(mode, (int, np.integer)) and not isinstance(mode, bool)
    if not whole or not 1 <= mode <= most:
        wanted = f"must be a whole number from 1, the slowest, to {most}, as many as the structure has"
        raise SettingError("mode", mode, wanted)


def at_nodal_diameter(scene: Scene, nodal_diameter: int | None) -> Scene:
    """Return a cyclic scene whose harmonic 1 is of a nodal diameter; the scene itself for None."""
    if nodal_diameter is None:
        return scene
    if not scene.structure.has_sectors:
        wanted = "must be left out: the structure has no sectors"
        raise SettingError("nodal_diameter", nodal_diameter, wanted)
    n = scene.structure.sector_count
    order = check_count("nodal_diameter", nodal_diameter, -(n // 2), n // 2, ", half the sectors") % n
    changed = tuple(
        force.model_copy(update={"engine_order": order}) if force.engine_order is not None else force
        for force in scene.excitation
    )
    return scene.model_copy(update={"excitation": changed})


class Wider:
    """The same equations with about twice the harmonics."""

    def __init__(self, equations: Equations) -> None:
        balance = equations.balance
        harmonics = min(2 * balance.n_harmonics + 1, MOST_HARMONICS)
        effects = Effects(
            whole_matrices=balance.system.form == DENSE, even_harmonics=int(balance.system.ks[0]) == 0
        )
        self._given = equations
        self.equations = equations.over(build(balance.scene, harmonics=harmonics, effects=effects))
        self.has_more = harmonics > balance.n_harmonics

    def spread(self, state: ModeState) -> ModeState:
        """Return the same motion, the harmonics it lacks at 0."""
        given = self._given
        w = state.y[: given.size].reshape(given.r, given.n)
        wide = spread(w, given.structure.ks, self.equations.structure.ks).reshape(-1)
        return replace(state, y=np.concatenate([wide, state.y[-BESIDES:]]))

    def estimate(self, found: Corrected) -> tuple[float, float]:
        """Return the changes of frequency [Hz] and of the last unknown by a Newton step; NaN if none.

        The step begins at the point with the harmonics it lacks at 0.
        """
        wide, state = self.equations, found.state
        y = self.spread(state).y
        at = wide.evaluate(y, state.log_amplitude, state.phase, state.mode)
        if at is None:
            return math.nan, math.nan
        move: Real | None = at.step(-at.residual, scales(y, wide.size))
        if move is None:
            return math.nan, math.nan
        return abs(float(move[-2])) / (2.0 * math.pi), abs(float(move[-1]))


_FAINT = 1e-9  # share of the excitation along a mode below which it gives no phase


@dataclass(frozen=True, slots=True, kw_only=True)
class PointRecord:
    """What a point of a curve gives; see `solver.modes.mode_results.NonlinearMode`."""

    motions: Real
    forces: Real
    dofs: Real
    max_abs: float
    states: Integer
    forcing: float
    observed: Real


class Recorder:
    """Makes records of the points of a curve.

    Parameters
    ----------
    turns : the motion may begin at any instant: it is made to begin in the phase of the excitation.
    """

    def __init__(self, equations: Equations, *, turns: bool) -> None:
        self._equations, self._turns = equations, turns
        self._force = phase_of(equations)
        self._system: System = by_reference(equations.balance.system)
        model = equations.balance.model
        self._shapes = np.asarray(model.shapes @ equations.structure.shapes, dtype=np.complex128)

    def of(self, point: Corrected) -> PointRecord:
        """Return the record of a converged point."""
        equations, s, hat = self._equations, self._equations.structure, self._equations.amplitudes
        if point.at is None:
            raise ValueError("a point without a value is none of a curve")
        w = point.state.y[: equations.size].reshape(equations.r, equations.n)
        equations.contacts(w, float(point.state.y[-2]))
        turns = self._angles(point.at.x)
        x = np.asarray(point.at.x * turns[:, None])
        top = equations.balance.highest_harmonic

        def turned(coefficients: Real) -> Real:
            return to_full(hat.coefficients(hat.of(coefficients) * turns), s.ks, top)

        moved = (self._shapes @ x[:, :, None])[:, :, 0]
        observed = hat.coefficients(np.einsum("kn,kn->k", s.observe, x))
        high, _, low, _ = extremes(self._system, observed)
        forcing = abs(complex(np.vdot(s.force, x[s.first]))) / math.exp(point.state.log_amplitude)
        return PointRecord(
            motions=turned(equations.motions(w)), forces=turned(equations.point.F),
            dofs=to_full(hat.coefficients(moved.T), s.ks, top), max_abs=max(high, -low),
            states=equations.point.states.copy(), forcing=forcing,
            observed=to_full(observed, s.ks, top),
        )  # fmt: skip

    def _angles(self, x: Complex) -> Complex:
        """Return e^{ikα} of each harmonic that brings the motion into the phase of the excitation."""
        s = self._equations.structure
        seen = complex(np.vdot(self._force, x[s.first]))
        size = float(np.linalg.norm(self._force) * np.linalg.norm(x[s.first]))
        if not self._turns or abs(seen) <= _FAINT * size:
            return np.ones(s.ks.size, np.complex128)
        turn = -1j * abs(seen) / seen
        return np.asarray(turn ** s.ks.astype(np.float64))


def curve_fields(
    equations: Equations, points: Sequence[Corrected], rows: Sequence[PointRecord], begun: float
) -> dict[str, Any]:
    """Return the fields of every `ModalCurve`."""
    scene, n = equations.balance.scene, len(points)
    return {
        "scene": scene,
        "max_abs": np.array([row.max_abs for row in rows], dtype=np.float64),
        "states": np.array([row.states for row in rows], dtype=np.int64).reshape(n, len(scene.contacts)),
        "residual": np.array([point.residual for point in points], dtype=np.float64),
        "seconds": clock() - begun,
    }


def last_unknowns(points: Sequence[Corrected]) -> tuple[Real, Real]:
    """Return the frequencies [Hz] and the last unknown of points, (n,) each."""
    y = np.array([point.state.y[-2:] for point in points], dtype=np.float64).reshape(len(points), 2)
    return y[:, 0] / (2.0 * math.pi), y[:, 1]


def collect(
    equations: Equations, curve: FollowedCurve, *, mode: int, turns: bool, errors: bool, begun: float
) -> NonlinearMode:
    """Return the result of a curve; arguments as `solver.modes.nonlinear_mode` has them."""
    balance, points = equations.balance, curve.points
    scene, n, size = balance.scene, len(points), 2 * balance.highest_harmonic + 1
    recorder = Recorder(equations, turns=turns)
    rows = [recorder.of(point) for point in points]
    frequency, zeta = last_unknowns(points)
    error = np.full((n, 2), math.nan)
    if errors and points:
        wider = Wider(equations)
        error = np.array([wider.estimate(point) for point in points])
    logs = np.array([point.state.log_amplitude for point in points], dtype=np.float64)
    return NonlinearMode(
        **curve_fields(equations, points, rows, begun), mode=mode, nodal_diameter=diameter_of(scene),
        n_harmonics=balance.n_harmonics, status=NonlinearModeStatus[curve.end.name], amplitude=np.exp(logs),
        frequency_hz=frequency, damping_ratio=zeta, frequency_error=error[:, 0], damping_error=error[:, 1],
        contact_motions=np.array([row.motions for row in rows]).reshape(n, balance.n_ports, size),
        contact_forces=np.array([row.forces for row in rows]).reshape(n, balance.n_ports, size),
        dof_motions=np.array([row.dofs for row in rows]).reshape(n, len(scene.dofs), size),
        forcing=np.array([row.forcing for row in rows], dtype=np.float64),
        points=tuple(point.state for point in points),
        whole_matrices=balance.system.form == DENSE, rejected_steps=curve.rejected,
        newton_iterations=sum(point.iterations for point in points),
    )  # fmt: skip


def diameter_of(scene: Scene) -> int | None:
    """Return the nodal diameter of harmonic 1, negative for a wave that travels backward."""
    if not scene.structure.has_sectors:
        return None
    n = scene.structure.sector_count
    folded = scene.engine_order % n
    return folded if folded <= n // 2 else folded - n
