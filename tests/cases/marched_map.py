"""The marched map of a state over a period around a periodic motion, stable or not, of every law it follows.

The motion is found by Newton's method on the map itself, from the state a balance gives at τ = 0.
"""

import math
from dataclasses import dataclass

import numpy as np

from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.pieces.piece import StatePiece
from solver.jit.fourier import basis
from solver.marching.kernels import march_state as kinds
from solver.marching.kernels import taylor as kernel
from solver.marching.march_equations import equations_of_motion
from solver.response.solution import Solution
from solver.response.time_history import all_coordinates

RUBBING = (kinds.COULOMB, kinds.ELASTIC_NORMAL)


@dataclass
class Start:
    """A contact part at τ = 0: its first row of the march, mode and forces."""

    row: int
    mode: int
    forces: list[float]


def _value(coefficients: np.ndarray) -> float:
    return float(basis(np.zeros(1), (coefficients.size - 1) // 2)[0] @ coefficients)


def _before(pieces: tuple[StatePiece, ...]) -> StatePiece | None:
    return next((piece for piece in pieces if piece.holds_at(2.0 * math.pi - 1e-9)), None)


def _starts(contact: AnyContact, motions: np.ndarray, forces: np.ndarray, row: int) -> list[Start]:
    parts = contact.perturbed(motions, contact.normal_load(motions))
    assert parts is not None
    circle = contact.friction is not None and len(contact.friction.ports) == 2 and len(parts) == 1
    found = []
    for part in parts:
        here = _before(part.pieces)
        values = [_value(forces[port]) for port in (range(2) if circle else part.ports[:1])]
        mode = kernel.SEPARATED if here is None else kernel.STICK
        if here is not None and circle:
            mode = kernel.STICK if here.memory == 2 else 1
        elif here is not None and contact.friction is not None and not here.memory:
            mode = 1 if values[0] > 0.0 else -1
        found.append(Start(row=row, mode=mode, forces=values if here is not None else [0.0] * len(values)))
        row += len(values)
    return found


class MarchedMap:
    """The map in the coordinates of `solver.response.stability.monodromy.Monodromy.matrix`."""

    def __init__(self, solution: Solution, steps: int = 1024) -> None:
        self.system = equations_of_motion(solution.scene, 2.0 * math.pi * solution.frequency_hz).system
        self.steps = steps
        amplitudes = all_coordinates(solution)
        orders = np.arange(amplitudes.shape[0])
        x, v = amplitudes.real.sum(axis=0), (1j * orders[:, None] * amplitudes).real.sum(axis=0)
        starts: list[Start] = []
        row = 0
        for contact, response in zip(solution.scene.contacts, solution.contacts, strict=True):
            starts += _starts(contact, np.array(response.motions), np.array(response.forces), row)
            row = starts[-1].row + len(starts[-1].forces)
        force, mode = np.zeros(row), np.zeros(row, dtype=np.int64)
        for start in starts:
            place = slice(start.row, start.row + len(start.forces))
            force[place], mode[place] = start.forces, start.mode
        self.state = kernel.State(x, v, force, mode, np.zeros((row, 1)))
        self.memory = [(s.row, len(s.forces)) for s in starts if self._remembers(s)]
        self._limits = {row: math.hypot(*force[row : row + 2]) for row, _ in self.memory}

    def _remembers(self, start: Start) -> bool:
        law = self.system.law[start.row]
        if law == kinds.CIRCLE:
            return start.mode != kernel.SEPARATED
        return law in RUBBING and start.mode == kernel.STICK

    def _row(self, c: int) -> np.ndarray:
        found, rows = np.zeros(self.state.x.size), self.system.L
        place = slice(rows.start[c], rows.start[c + 1])
        found[rows.column[place]] = rows.value[place]
        return found

    def numbers(self, state: kernel.State) -> np.ndarray:
        """Its coordinates."""
        held: list[float] = []
        for row, count in self.memory:
            kt = self.system.kt
            if count == 2 and self.state.mode[row] != kernel.STICK:
                turn = math.atan2(*state.force[[row + 1, row]]) - math.atan2(
                    *self.state.force[[row + 1, row]]
                )
                held.append(math.remainder(turn, 2.0 * math.pi) * self._limits[row] / kt[row])
                continue
            held += [self._row(c) @ state.x - state.force[c] / kt[c] for c in range(row, row + count)]
        return np.concatenate([state.x, state.v, held])

    def moved(self, move: np.ndarray) -> kernel.State:
        """The state moved by coordinates."""
        n, force, kt = self.state.x.size, self.state.force.copy(), self.system.kt
        place = 2 * n
        for row, count in self.memory:
            if count == 2 and self.state.mode[row] != kernel.STICK:
                turn = move[place] * kt[row] / self._limits[row]
                c, s = math.cos(turn), math.sin(turn)
                force[row : row + 2] = np.array([[c, -s], [s, c]]) @ force[row : row + 2]
                place += 1
                continue
            for c in range(row, row + count):
                force[c] += kt[c] * (self._row(c) @ move[:n] - move[place])
                place += 1
        x, v = self.state.x + move[:n], self.state.v + move[n : 2 * n]
        return kernel.State(x, v, force, self.state.mode.copy(), self.state.own.copy())

    def march(self, state: kernel.State, periods: int = 1) -> kernel.State:
        """The state some periods later."""
        one, many = np.zeros(0), np.zeros((self.system.kt.size, 0))
        nothing = kernel.Record(one, one, many, many, many)
        code, _ = kernel.run_periods(self.system, state, self.steps, 0.0, 0, nothing, np.empty(periods))
        assert code in (kernel.RAN, kernel.SETTLED)
        return state

    @property
    def size(self) -> float:
        """Of the motion."""
        return float(max(np.abs(self.state.x).max(), np.abs(self.state.v).max()))

    def jacobian(self) -> np.ndarray:
        """By central differences of marched periods."""
        count, step = self.numbers(self.state).size, 1e-6 * self.size
        columns = []
        for way in np.eye(count) * step:
            ends = [self.numbers(self.march(self.moved(sign * way))) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2.0 * step))
        return np.array(columns).T

    def refine(self) -> float:
        """Move to the motion that repeats; return how far from repeating it is, relative."""
        off = np.inf
        for _ in range(8):
            here = self.numbers(self.state)
            change = self.numbers(self.march(self.moved(np.zeros(here.size)))) - here
            off = float(np.abs(change).max()) / self.size
            if off < 1e-11:
                break
            move = np.linalg.lstsq(np.eye(here.size) - self.jacobian(), change, rcond=1e-9)[0]
            self.state = self.moved(move)
        return off
