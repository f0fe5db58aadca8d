"""The balance of a scene: its `System` for the compiled loops, and what the parameter λ of a run is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from solver.balance.simplifications import Effects
from solver.contacts.fields import LARGEST
from solver.contacts.kernels import columns
from solver.contacts.kernels import system as kernel
from solver.contacts.kernels.columns import NODES
from solver.contacts.kernels.laws import call_law
from solver.contacts.kernels.system import DENSE, System
from solver.errors import SettingError, check_count
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.trig_polynomial import grid_size, grid_tables
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.condensation import reduce_model
from solver.linear.model import LinearModel
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.bodies.shape_parts import SPEED
from solver.scene.cyclic.annulus import check_in_annulus, written_out
from solver.scene.parameter_paths import AMPLITUDE, FREQUENCY, check_frequency, follows_speed, parameter_of
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import (
    MOST_HARMONICS,
    MULTIPLES,
    among,
    even_harmonics_reason,
    forced_harmonics,
    kept_harmonics,
    spread,
)
from solver.wording import listing


class Kind(IntEnum):
    """What a parameter changes; the numbers are those of `solver.contacts.kernels.system`.

    CONTACTS stands for any column of the contact table, which `Parameter.column` says.
    """

    FREQUENCY = kernel.FREQUENCY
    LEVEL = kernel.LEVEL
    FORCE_PHASE = kernel.FORCE_PHASE
    STRUCTURE = kernel.STRUCTURE
    CONTACTS = columns.COLUMN_KIND


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter path resolved against a scene."""

    path: Annotated[str, "As the user wrote it, for example ``shroud.N0``."]
    kind: Annotated[Kind, "What it changes."]
    active: Annotated[
        Real,
        "Its share in the number of each contact it acts on (1.0 but for faces with several points), else "
        "0.0, (n_contacts,).",
    ]
    unit: Annotated[str, "Unit of the values at the user boundary."]
    least: Annotated[float, "Smallest value that means something."]
    column: Annotated[int, "Of the contact table, if it is a parameter of contacts."] = 0

    @property
    def code(self) -> int:
        """What λ is, as a number of the compiled loops."""
        return int(self.kind) + self.column

    def inside(self, value: float) -> float:
        """Convert a user value to the one inside (Hz to rad/s)."""
        return 2.0 * math.pi * value if self.kind is Kind.FREQUENCY else value

    def outside(self, value: float) -> float:
        """Convert an inside value to the user's (rad/s to Hz)."""
        return value / (2.0 * math.pi) if self.kind is Kind.FREQUENCY else value

    def all_outside(self, values: Real) -> Real:
        """Convert an array of inside values to the user's."""
        return values / (2.0 * math.pi) if self.kind is Kind.FREQUENCY else values

    def check(self, name: str, value: float) -> float:
        """Return a value that the parameter may have as a float; SettingError, which names `name`, else."""
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float, np.number))
            or not np.isfinite(value)
        ):
            raise SettingError(name, value, f"must be a finite number ({self.path})")
        if self.kind is Kind.FREQUENCY:
            return check_frequency(name, value)
        if value < self.least:
            raise SettingError(name, value, f"must be >= 0, a value of `{self.path}`")
        if abs(value) > LARGEST:
            raise SettingError(name, value, f"must be at most {LARGEST:g}, a value of `{self.path}`")
        return float(value)


def resolve(scene: Scene, path: str) -> Parameter:
    """Return what `path` means in `scene`; SettingError with those that it has if it is none of them."""
    active = np.zeros(len(scene.contacts))
    if path == FREQUENCY:
        return Parameter(path=path, kind=Kind.FREQUENCY, active=active, unit="Hz", least=-math.inf)
    scene.check_path(path)
    followed = follows_speed(scene, path)
    if followed is not None:
        raise SettingError("path", path, f"cannot be continued in: {followed} follows the speed")
    if path == SPEED and (scene.speed_order is not None or scene.with_speed):
        wanted = "is swept along an engine-order line (`speed_order`) alone where loads follow it"
        raise SettingError("path", path, wanted)
    found = parameter_of(scene, path)
    if found.in_steps:
        raise SettingError("path", path, "must be a number that changes without steps: set it in the scene")
    columns_set = {quantity.column for quantity in found.quantities} or {0}
    if len(columns_set) > 1:
        raise SettingError("path", path, "must be of contacts whose laws mean the same by it")
    active[list(found.contacts)] = list(found.contacts.values())
    return Parameter(
        path=path, kind=Kind[found.acts_on.name], active=active, unit=found.unit, least=found.least,
        column=columns_set.pop(),
    )  # fmt: skip


def check_fixed(path: str, frequency_hz: float | None) -> float:
    """Return the frequency [Hz] at which another parameter is followed; SettingError without a good one."""
    if frequency_hz is None:
        raise SettingError("frequency_hz", None, f"is needed when the parameter is `{path}`")
    return check_frequency("frequency_hz", frequency_hz)


_AS_CALLED_FOR = Effects()
_SINGLE = (
    "must be finite here: contacts with kt = inf or kn = inf are for solve, sweep and march; elsewhere give "
    "kt = 1e4 times the stiffness beside it"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Balance:
    """A scene with its harmonics and the parameter λ of a run."""

    scene: Annotated[Scene, "What is solved."]
    model: Annotated[LinearModel, "Its linear part."]
    parameter: Annotated[Parameter, "What λ is; its unit inside is that of `Parameter.inside`."]
    system: Annotated[System, "The arrays the compiled loops work on."]
    n_harmonics: Annotated[
        int,
        "Highest harmonic asked for. The system keeps `system.ks`: these, or the odd ones of them, and "
        "those that forces and loads call for whatever was asked, see "
        "`solver.scene.scene_harmonics.kept_harmonics`.",
    ]
    effects: Annotated[Effects, "What is paid for though the scene does not call for it."]
    sizes: Annotated[
        Real, "What rounding of the matrices is relative to, see `solver.balance.rounding`, (2, 3, ns, ·)."
    ]

    @property
    def highest_harmonic(self) -> int:
        """Highest harmonic of full coefficients: the one asked for, or that of a force above it."""
        return max(self.n_harmonics, int(self.system.ks[-1]))

    @property
    def n_ports(self) -> int:
        """Relative motions of all contacts."""
        return int(self.system.owner.size)

    @property
    def n_leading(self) -> int:
        """Relative motions that all others follow from: what a Newton step is solved for."""
        return int(self.system.leading.size)

    @property
    def n_coefficients(self) -> int:
        """Real coefficients kept of each motion."""
        return int(2 * self.system.ks.size - (self.system.ks[0] == 0))

    @property
    def n_unknowns(self) -> int:
        """Unknowns of the condensed balance."""
        return self.n_ports * self.n_coefficients


def check_harmonics(harmonics: int) -> int:
    """Return `harmonics`; SettingError if it is no whole number from 0 to `MOST_HARMONICS`."""
    return check_count("harmonics", harmonics, 0, MOST_HARMONICS)


def build(
    scene: Scene, path: str = "frequency", *, harmonics: int = 11, frequency_hz: float | None = None,
    effects: Effects | None = None, poles: bool = True,
) -> Balance:  # fmt: skip
    """Set up the balance of a scene for continuation in `path`.

    Parameters
    ----------
    scene : the scene, with the values that stay fixed.
    path : the parameter that λ is.
    harmonics : highest harmonic asked for; all from 0 on are kept, or the odd ones where the others are zero,
        and those that forces and loads call for, see `solver.scene.scene_harmonics.kept_harmonics`.
    frequency_hz : the excitation frequency [Hz], needed unless λ is the frequency.
    effects : what is paid for though the scene does not call for it.
    poles : damping that couples the modes may be carried by poles; otherwise matrices are kept where it does.

    Raises
    ------
    SettingError
        Unknown path, a missing or bad frequency, or a bad number of harmonics.
    """
    effects = effects or _AS_CALLED_FOR
    if scene.structure.has_sectors:
        whole = written_out(scene, every_sector=effects.every_sector)
        if whole is not scene:
            check_in_annulus(scene, path)
        scene = whole
    parameter, asked = resolve(scene, path), check_harmonics(harmonics)
    odd = not effects.even_harmonics and even_harmonics_reason(scene, (path,)) is None
    ks, omega = kept_harmonics(scene, (path,), asked, odd=odd), 0.0
    if parameter.kind is not Kind.FREQUENCY:
        hertz = check_fixed(path, frequency_hz)
        omega, scene = 2.0 * math.pi * hertz, scene.at_frequency(hertz)
    if parameter.kind is Kind.LEVEL:
        check_level(scene)
        if scene.level == 0.0:
            scene = scene.with_values({AMPLITUDE: 1.0})
    model = linear_model(scene)
    system, sizes = _system(scene, model, parameter, ks, omega, effects, poles=poles)
    return Balance(
        scene=scene, model=model, parameter=parameter, system=system, n_harmonics=harmonics, effects=effects,
        sizes=sizes,
    )  # fmt: skip


def for_parameter(balance: Balance, path: str, frequency_hz: float) -> Balance:
    """Return the same balance with another λ, at a fixed frequency.

    Raises
    ------
    SettingError
        Even harmonics were left out, but λ calls for them: build the first balance with them.
    """
    if balance.scene.speed_order is not None:
        scene = balance.scene.at_frequency(frequency_hz)
        effects = replace(balance.effects, even_harmonics=int(balance.system.ks[0]) == 0)
        return build(scene, path, harmonics=balance.n_harmonics, frequency_hz=frequency_hz, effects=effects)
    parameter = resolve(balance.scene, path)
    if parameter.kind is Kind.LEVEL:
        check_level(balance.scene)
    omega = 2.0 * math.pi * frequency_hz
    reason = even_harmonics_reason(balance.scene, (path,))
    if reason is not None and balance.system.ks[0] != 0:
        raise SettingError("parameter", path, f"needs a balance with even harmonics: {reason}")
    sizes = balance.sizes
    if parameter.kind is Kind.STRUCTURE or balance.parameter.kind is Kind.STRUCTURE:
        system, sizes = _system(
            balance.scene, balance.model, parameter, balance.system.ks, omega, balance.effects
        )
    else:
        system = balance.system._replace(
            kind=parameter.code, active=parameter.active, omega=omega,
            level_reference=balance.scene.level or 1.0, phase_reference=balance.scene.phase,
        )  # fmt: skip
    return replace(balance, parameter=parameter, system=system, sizes=sizes)


def fewer_harmonics(balance: Balance, count: int) -> Balance:
    """Return the same balance with `count` of its harmonics (the mean counts as one).

    The lowest are kept, and before all others the mean and those of the forces and loads.
    """
    ks = balance.system.ks
    needed = np.isin(ks, [0, *forced_harmonics(balance.scene, (balance.parameter.path,))])
    rank = np.argsort(~needed, kind="stable")
    return with_harmonics(balance, ks[np.sort(rank[: max(count, int(needed.sum()))])])


def with_harmonics(balance: Balance, ks: Integer) -> Balance:
    """Return the same balance with the harmonics `ks`, some of its own."""
    system = balance.system
    at = np.searchsorted(system.ks, ks)
    highest = max(int(ks[-1]), int(system.load_ks[-1]))
    cos_table, sin_table = tables_for(highest)
    rows = {name: getattr(system, name) for name in ("modal_forces", "forces")}
    rows = {name: np.ascontiguousarray(row[at]) if row.shape[0] else row for name, row in rows.items()}
    if system.dforces.size:
        rows["dforces"] = np.ascontiguousarray(system.dforces[:, at])
    smaller = system._replace(ks=ks, which=system.which[at], cos_table=cos_table, sin_table=sin_table, **rows)
    return replace(balance, system=smaller, n_harmonics=min(balance.n_harmonics, int(ks[-1])))


def check_level(scene: Scene) -> None:
    """Raise SettingError where constant forces are partly excitation, which has a level, and partly loads."""
    if not level_scales_all(scene):
        raise SettingError(
            "parameter", AMPLITUDE,
            "scales static forces of the excitation but no loads: write those as [[loads]] too",
        )  # fmt: skip


def level_scales_all(scene: Scene) -> bool:
    """Return whether the level of the excitation scales all constant forces, or none of them."""
    return not (scene.constant_forces and any(force.harmonic == 0 for force in scene.excitation))


@lru_cache(maxsize=16)
def tables_for(highest: int) -> tuple[Real, Real]:
    """Return the tables of the event search for harmonics up to `highest`."""
    return grid_tables(grid_size(highest), highest)


def _system(
    scene: Scene, model: LinearModel, parameter: Parameter, ks: Integer, omega: float, effects: Effects, *,
    poles: bool = True,
) -> tuple[System, Real]:  # fmt: skip
    """Put the arrays of the compiled loops together; with them what rounding is relative to."""
    derivative = structure_derivative(scene, parameter.path) if parameter.kind is Kind.STRUCTURE else None
    if derivative is not None and derivative.contact_here is not None:
        wanted = "moves the contacts, which are followed in gradients and designs, not continued in"
        raise SettingError("parameter", parameter.path, wanted)
    reduced = reduce_model(
        model, ks, derivative, whole_matrices=effects.whole_matrices, each_port=effects.every_port,
        poles=poles,
    )  # fmt: skip
    load_order = _highest_load(scene)
    cos_table, sin_table = tables_for(max(int(ks[-1]), load_order))
    line = _of_line(scene) if scene.speed_order is not None else _NO_LINE
    rise = np.zeros((2, len(scene.contacts)))
    for i, (_, first, second) in line.loads.items():
        rise[:, i] = first, second
    system = System(
        ks=ks, load_ks=np.arange(load_order + 1, dtype=np.int64), which=reduced.which, cos_table=cos_table,
        sin_table=sin_table, **_contact_set(scene), contacts=contact_rows(scene, int(ks[-1])),
        samples=0, condense=0 if effects.every_contact else 1,
        least_size=reduced.least_size,
        active=parameter.active, load_rise=rise, level=line.level,
        shift=reduced.shift, leading=reduced.leading, span=reduced.span, loose=reduced.loose, hold=0,
        kind=parameter.code, omega=omega,
        level_reference=scene.level or 1.0, phase_reference=scene.phase,
        centred=int(scene.observe.centred), only=scene.observe.harmonic or -1,
        haigh=np.zeros(4),
        parameter_reference=scene.value(parameter.path) if derivative is not None else 0.0,
        form=reduced.form, eigenvalues=reduced.eigenvalues, dampings=reduced.dampings,
        contact_modes=reduced.contact_modes, contact_duals=reduced.contact_duals,
        observe_modes=reduced.observe_modes, modal_forces=reduced.modal_forces, K=reduced.K, C=reduced.C,
        M=reduced.M, dK=reduced.dK, dC=reduced.dC, dM=reduced.dM, ddK=reduced.ddK, L=reduced.L,
        observe=reduced.observe,
        forces=reduced.forces, dforces=reduced.dforces, constant_mean=int(bool(scene.constant_forces)),
    )  # fmt: skip
    return system, reduced.sizes


def _contact_set(scene: Scene) -> dict[str, Any]:
    """Return kernels and ports of all contacts, see `solver.contacts.kernels.system.System`.

    A kernel that never ran in this process is loaded.
    """
    contacts, ports = scene.contacts, np.array(scene.port_counts, dtype=np.int64)
    first = np.append(0, np.cumsum(ports))
    rubs, normal, begins = np.zeros(first[-1], dtype=np.int64), [], first.tolist()
    for contact, begin in zip(contacts, begins, strict=False):
        rubs[[begin + port for port in contact.RUBBING]] = 1
        normal.append(-1 if contact.normal_port is None else begin + contact.normal_port)
    held = [tuple(port) for contact in contacts for port in contact.held]
    return {
        "laws": np.array([call_law.number(contact.kernel) for contact in contacts], dtype=np.int64),
        "jenkins": np.array([contact.JENKINS for contact in contacts], dtype=np.int64),
        "alone": np.array([contact.force_alone for contact in contacts], dtype=np.int64),
        "normal_port": np.array(normal, dtype=np.int64), "first_port": first,
        "first_block": np.append(0, np.cumsum(ports**2)), "owner": np.repeat(np.arange(ports.size), ports),
        "rubs": rubs, "held": np.array(held, dtype=np.int64).reshape(-1, 3),
    }  # fmt: skip


def _highest_load(scene: Scene) -> int:
    """Return the highest harmonic of the normal loads, 1 or more."""
    loads = [contact.load for contact in scene.contacts]
    return max([1, *(len(load.higher) + 1 for load in loads if load is not None)])


def contact_rows(scene: Scene, highest: int) -> Real:
    """Return the rows of the contact table, (n_contacts, ·), for harmonics up to `highest`.

    A load that is not tied has a ratio NaN; one that follows the speed has its N0 at rest.

    Raises
    ------
    SettingError
        A contact is rigid: its events are followed, there is no balance of harmonics with it.
    """
    order = _highest_load(scene)
    width = columns.COLUMNS if order == 1 else columns.wave_column(order + 1)
    table = np.zeros((len(scene.contacts), width))
    table[:, columns.RATIO] = math.nan
    for row, contact in zip(table, scene.contacts, strict=True):
        if contact.is_rigid:
            key = "kt" if math.isinf(contact.stiffnesses[0]) else "kn"
            raise SettingError(f"{contact.name}.{key}", math.inf, _SINGLE)
        contact.fill(row, highest)
    if scene.speed_order is not None:
        for i, (at_rest, *_) in _of_line(scene).loads.items():
            table[i, columns.N0] = at_rest
    return table


class _Line(NamedTuple):
    """Polynomials of ω in place of numbers."""

    loads: dict[int, list[float]]  # by the number of a contact whose N0 follows, by 1, ω and ω²
    level: Real  # (2, 3) factors of the excitation and of constant forces by 1, ω and ω²


_NO_LINE = _Line({}, np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))


def _of_line(scene: Scene) -> _Line:
    """Return what follows the frequency along the engine-order line of a scene.

    With speed = ω / (REVOLUTIONS · order) a polynomial of the speed is one of ω; centrifugal loads, written
    at 1 rad/s, go with (ω / order)².
    """
    level, order, loads = _NO_LINE.level.copy(), scene.speed_order or 1.0, dict[int, list[float]]()
    powers = (1.0 / (REVOLUTIONS * order)) ** np.arange(3)
    for each in scene.with_speed:
        found = np.array(each.coefficients) * powers
        if each.path == AMPLITUDE:
            level[0] = found / scene.level
            continue
        loads |= dict.fromkeys(parameter_of(scene, each.path).contacts, found.tolist())
    if any(body.radius_of_rotation for body in scene.bodies):
        level[1] = [0.0, 0.0, order**-2.0]
    return _Line(loads, level)


def contact_index(scene: Scene, contact: str) -> int:
    """Return the number of a contact by its name; SettingError where there is none of that name."""
    names = [each.name for each in scene.contacts]
    if contact not in names:
        raise SettingError("contact", contact, f"must be one of {listing(names)}")
    return names.index(contact)


def more_harmonics(balance: Balance, top: int, *, multiples: int = MULTIPLES) -> Balance:
    """Return the same balance with the harmonics kept for `top`; one of odd harmonics stays one.

    The modes do not depend on the harmonics kept, only the tables of the event search are made anew. A cyclic
    structure is reduced again where a further harmonic meets a nodal diameter that is not there yet.
    """
    ks = further_harmonics(balance, top, multiples)
    system = _extended(balance, ks)
    if system is None:
        return _rebuilt(balance, top)
    cos_table, sin_table = tables_for(max(int(ks[-1]), 1))
    contacts = contact_rows(balance.scene, int(ks[-1]))
    # Where a law is followed from node to node an estimate has to see what lies between them too.
    contacts[:, NODES] = np.maximum(contacts[:, NODES], 2.0 * balance.system.contacts[:, NODES])
    system = system._replace(cos_table=cos_table, sin_table=sin_table, contacts=contacts)
    return replace(balance, system=system, n_harmonics=top)


def less_harmonics(balance: Balance, top: int) -> Balance:
    """Return the same balance with those of its harmonics that are kept if only `top` are asked for."""
    ks = kept_harmonics(balance.scene, (balance.parameter.path,), top, odd=False)
    return replace(with_harmonics(balance, np.intersect1d(balance.system.ks, ks)), n_harmonics=top)


def linear_part(balance: Balance, top: int) -> System:
    """Return the linear part alone with the harmonics up to `top`: a `System` for receptances, no forces."""
    system = _extended(balance, further_harmonics(balance, top))
    return _rebuilt(balance, top).system if system is None else system


def further_harmonics(balance: Balance, top: int, multiples: int = MULTIPLES) -> Integer:
    """Return the harmonics of a balance and those that are kept if `top` are asked for."""
    ks = balance.system.ks
    odd = bool(np.all(ks % 2 == 1))
    path = balance.parameter.path
    wider = kept_harmonics(balance.scene, (path,), top, odd=odd, multiples=multiples)
    return np.array(sorted({*ks.tolist(), *wider.tolist()}), np.int64)


def pad(coefficients: Real, balance: Balance, wider: Balance) -> Real:
    """Return coefficients (of one motion or of all unknowns) of `balance` filled up for `wider`."""
    kept = coefficients.reshape(-1, balance.n_coefficients)
    return spread(kept, balance.system.ks, wider.system.ks).reshape(-1)


def _rebuilt(balance: Balance, top: int) -> Balance:
    """Return the balance of the same scene with the harmonics up to `top`, everything made anew."""
    frequency_hz = balance.system.omega / (2.0 * math.pi) or None
    return build(
        balance.scene,
        balance.parameter.path,
        harmonics=top,
        frequency_hz=frequency_hz,
        effects=balance.effects,
    )


def _extended(balance: Balance, ks: Integer) -> System | None:
    """Return the system with the harmonics `ks` but the old tables; None if the balance lacks what they need.

    That is a nodal diameter not met so far, or a force with one of the further harmonics.
    """
    scene, system = balance.scene, balance.system
    known = among(system.ks, ks)
    if any(force.harmonic in ks[~known] for force in scene.forces):
        return None
    sectors = scene.structure.sector_count
    diameters = (ks * scene.engine_order) % sectors
    # Of the matrices themselves the mean has others than what moves.
    moving = (system.ks > 0) | (system.form != DENSE)
    structures = dict(zip(diameters[known][moving].tolist(), system.which[moving].tolist(), strict=True))
    wanted = diameters[~known].tolist()
    if not structures.keys() >= set(wanted):
        return None
    at, which = np.flatnonzero(known), np.zeros(ks.size, np.int64)
    which[known], which[~known] = system.which, [structures[diameter] for diameter in wanted]
    return system._replace(
        ks=ks, which=which,
        modal_forces=_padded_rows(system.modal_forces, at, ks.size),
        forces=_padded_rows(system.forces, at, ks.size),
        # Of none at all numpy would make reals, for which every kernel would be compiled once more.
        dforces=np.array([_padded_rows(each, at, ks.size) for each in system.dforces], np.complex128).reshape(
            (2, ks.size, -1) if system.dforces.size else (0, 0, 0)
        ),
    )  # fmt: skip


def _padded_rows(rows: Complex, at: Integer, count: int) -> Complex:
    """Return (nk, m) unit forces put at `at` of `count` rows, the rest zero; without rows they stay so."""
    if rows.shape[0] == 0:
        return rows
    padded = np.zeros((count, rows.shape[1]), np.complex128)
    padded[at] = rows
    return padded
