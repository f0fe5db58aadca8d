"""The balance of a scene: its `System` for the compiled loops, for any parameter that may be continued in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.parameter import Kind, Parameter, check_fixed, resolve
from solver.balance.simplifications import Effects, even_harmonics_reason
from solver.balance.speed_line import numbers_along_line, speed_line
from solver.contacts.kernels.system import System
from solver.errors import SettingError, check_count
from solver.jit.fourier import Integer, Real
from solver.jit.trig_polynomial import grid_size, grid_tables
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.condensation import reduce_model
from solver.linear.contact_table import contact_set, highest_load, port_stiffnesses
from solver.scene.bodies.kinematics import static_forces
from solver.scene.cyclic.annulus import check_in_annulus, written_out
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import MOST_HARMONICS, forced_harmonics, kept_harmonics
from solver.wording import listing


@dataclass(frozen=True, slots=True, kw_only=True)
class Balance:
    """A scene with its harmonics and the parameter λ of a run."""

    scene: Annotated[Scene, "What is solved."]
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
    effects = effects or Effects()
    whole = written_out(scene, every_sector=effects.every_sector)
    if whole is not scene:
        check_in_annulus(scene, path)
    scene = whole
    parameter = resolve(scene, path)
    ks = _harmonics(scene, path, check_harmonics(harmonics), effects)
    omega = 0.0
    if parameter.kind is not Kind.FREQUENCY:
        hertz = check_fixed(path, frequency_hz)
        omega, scene = 2.0 * math.pi * hertz, scene.at_frequency(hertz)
    if parameter.kind is Kind.LEVEL:
        check_level(scene)
    if parameter.kind is Kind.LEVEL and scene.value("excitation.amplitude") == 0.0:
        scene = scene.with_values({"excitation.amplitude": 1.0})
    system, sizes = _system(scene, parameter, ks, omega, effects, poles=poles)
    return Balance(
        scene=scene, parameter=parameter, system=system, n_harmonics=harmonics, effects=effects, sizes=sizes
    )


def _harmonics(scene: Scene, path: str, highest: int, effects: Effects) -> Integer:
    """Return the harmonics kept: all of them, or the odd ones where a symmetry makes the others zero."""
    odd = not effects.even_harmonics and even_harmonics_reason(scene, (path,)) is None
    return kept_harmonics(scene, (path,), highest, odd=odd)


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
        system, sizes = _system(balance.scene, parameter, balance.system.ks, omega, balance.effects)
    else:
        system = balance.system._replace(
            kind=parameter.code, active=parameter.active, omega=omega,
            level_reference=_level(balance.scene), phase_reference=balance.scene.value("excitation.phase"),
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
    cos_table, sin_table = grid_tables(grid_size(highest), highest)
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
    return not (static_forces(scene) and any(force.harmonic == 0 for force in scene.excitation))


def _level(scene: Scene) -> float:
    """Return the excitation amplitude the unit excitation stands for (1 where it is zero: nothing scales)."""
    return scene.value("excitation.amplitude") or 1.0


def _system(
    scene: Scene, parameter: Parameter, ks: Integer, omega: float, effects: Effects, *, poles: bool = True
) -> tuple[System, Real]:  # fmt: skip
    """Put the arrays of the compiled loops together; with them what rounding is relative to."""
    model = linear_model(scene)
    derivative = structure_derivative(scene, parameter.path) if parameter.kind is Kind.STRUCTURE else None
    if derivative is not None and derivative.contact_here is not None:
        wanted = "moves the contacts, which are followed in gradients and designs, not continued in"
        raise SettingError("parameter", parameter.path, wanted)
    reduced = reduce_model(
        model, ks, port_stiffnesses(scene, model), derivative, whole_matrices=effects.whole_matrices,
        each_port=effects.every_port, poles=poles,
    )  # fmt: skip
    load_order = highest_load(scene)
    highest = max(int(ks[-1]), load_order)
    cos_table, sin_table = grid_tables(grid_size(highest), highest)
    line = speed_line(scene)
    system = System(
        ks=ks, load_ks=np.arange(load_order + 1, dtype=np.int64), which=reduced.which, cos_table=cos_table,
        sin_table=sin_table, **contact_set(scene)._asdict(), contacts=numbers_along_line(scene, int(ks[-1])),
        samples=0, condense=0 if effects.every_contact else 1,
        least_size=reduced.least_size,
        active=parameter.active, load_rise=line.load_rise, level=line.level,
        shift=reduced.shift, leading=reduced.leading, span=reduced.span, loose=reduced.loose, hold=0,
        kind=parameter.code, omega=omega,
        level_reference=_level(scene), phase_reference=scene.value("excitation.phase"),
        centred=int(scene.observe.centred), only=scene.observe.harmonic or -1,
        haigh=np.zeros(4),
        parameter_reference=scene.value(parameter.path) if derivative is not None else 0.0,
        form=reduced.form, eigenvalues=reduced.eigenvalues, dampings=reduced.dampings,
        contact_modes=reduced.contact_modes, contact_duals=reduced.contact_duals,
        observe_modes=reduced.observe_modes, modal_forces=reduced.modal_forces, K=reduced.K, C=reduced.C,
        M=reduced.M, dK=reduced.dK, dC=reduced.dC, dM=reduced.dM, ddK=reduced.ddK, L=reduced.L,
        observe=reduced.observe,
        forces=reduced.forces, dforces=reduced.dforces, constant_mean=int(bool(static_forces(scene))),
    )  # fmt: skip
    return system, reduced.sizes


def contact_index(scene: Scene, contact: str) -> int:
    """Return the number of a contact by its name; SettingError where there is none of that name."""
    names = [each.name for each in scene.contacts]
    if contact not in names:
        raise SettingError("contact", contact, f"must be one of {listing(names)}")
    return names.index(contact)
