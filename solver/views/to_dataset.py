"""The results of the solver as named arrays."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from enum import Enum
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from solver.results.files import Attribute, Dataset, Variable
from solver.results.told import UNIT, at, keys_and_paths
from solver.views.io import scene_attributes

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch
    from solver.jit.fourier import Real
    from solver.response.solution import Solution
    from solver.response.stability.multipliers import Stability
    from solver.results.base import Shown
    from solver.scene.scene import Scene
    from solver.studies.study_results import InterferenceDiagram

AMPLITUDE = "max|x| of the observed DOF"


def attributes(status: str, scene: Scene | None = None, **more: Attribute | None) -> dict[str, Attribute]:
    """What every dataset says of itself: the version, the status, the scene."""
    try:
        made_by = f"stickslip {version('stickslip')}"
    except PackageNotFoundError:
        made_by = "stickslip"
    given: Mapping[str, Attribute | None] = {"source": made_by, "status": status, **more}
    known = {name: value for name, value in given.items() if value is not None}
    return known if scene is None else {**known, **scene_attributes(scene)}


def column(dim: str, values: object, unit: str = "", about: str = "") -> Variable:
    """One value for each place along a dimension."""
    return Variable(dims=(dim,), values=np.asarray(values), unit=unit, about=about)


def harmonics(coefficients: Real, dims: tuple[str, ...], name: str, unit: str) -> dict[str, Variable]:
    """Cosine and sine parts of full coefficients (..., 2H + 1), each (..., H + 1); the mean is the first."""
    size = (coefficients.shape[-1] + 1) // 2
    cosine, sine = np.zeros((2, *coefficients.shape[:-1], size))
    cosine[..., 0], cosine[..., 1:] = coefficients[..., 0], coefficients[..., 1::2]
    sine[..., 1:] = coefficients[..., 2::2]
    words = f"of the {name.replace('_', ' ')}, by harmonic"
    return {
        f"{name}_cos": Variable(dims=dims, values=cosine, unit=unit, about=f"cosine part {words}"),
        f"{name}_sin": Variable(dims=dims, values=sine, unit=unit, about=f"sine part {words}"),
    }


def described(found: Shown) -> Dataset:
    """What the class of a result says of its data set, see `solver.results.base.Data`."""
    data = found.DATA
    variables: dict[str, Variable] = {}
    for place, names in data.columns.items():
        over, _, rows = place.partition("=")
        dims = tuple(over.split())
        owners = at(found, rows) if rows else (found,)
        for name, path in keys_and_paths(names).items():
            given = [at(one, path) for one in owners]
            if rows or given[0] is not None:
                values = np.asarray(_plain(given if rows else given[0]))
                unit, about = _said(owners[0], path) if len(owners) else ("", "")
                coefficients = dims[-1] == "harmonic"
                one = Variable(dims=dims, values=values, unit=unit, about=about)
                variables |= harmonics(values, dims, name, unit) if coefficients else {name: one}
    rows_of = data.rows or tuple(next(iter(data.columns)).partition("=")[0].split())
    sizes = Dataset(kind=data.kind, rows=rows_of, variables=variables).sizes
    if data.index:
        variables = {data.index: column(data.index, np.arange(sizes[data.index])), **variables}
    status = at(found, data.status) if hasattr(found, data.status.partition(".")[0]) else data.status
    scene = at(found, data.scene) if data.scene else None
    notes = {name: at(found, path) for name, path in keys_and_paths(data.notes).items()}
    notes |= {"scene_name": scene} if isinstance(scene, str) else {}
    said = {name: ", ".join(value) if isinstance(value, tuple) else value for name, value in notes.items()}
    whole = attributes(_plain(status), None if isinstance(scene, str) else scene, **said)
    # A structure without contacts has no dimension of them.
    kept = {name: one for name, one in variables.items() if "contact" not in one.dims or sizes["contact"]}
    return Dataset(kind=data.kind, rows=rows_of, variables=kept, attributes=whole)


def _plain(value: Any) -> Any:
    """A value with the words of what is one of a few."""
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value.value if isinstance(value, Enum) else value


def _said(owner: Any, path: str) -> tuple[str, str]:
    """Unit and description of an attribute: of the parameter of a result as the result says."""
    before, _, name = path.rpartition(".")
    owner = at(owner, before) if before else owner
    if name == "parameter":
        return owner.unit, owner.parameter_path
    made = (getattr(type(owner), name, None).__doc__ or "").partition("\n")[0]  # of a property
    words = getattr(owner, "WORDS", {}).get(name, made)
    unit = UNIT.search(words)
    return "" if unit is None else unit[1], _SHAPE.sub("", UNIT.sub("", words)).replace(" .", "").strip(" .")


_SHAPE = re.compile(r",? \((?:\w+, ?)+[^()]*\)")  # of an array, (n, 2H + 1)
_SAMPLES = 500
ContactStates = tuple[Sequence[str], NDArray[np.integer]]


def point_variables(
    path: str, unit: str, columns: Mapping[str, Real], observed: Real | None, states: ContactStates | None
) -> dict[str, Variable]:
    """What a branch knows of each of its points, computed just now or stored before.

    Parameters
    ----------
    path, unit : of the parameter.
    columns : ``parameter`` and any of the other names of one number a point.
    observed : (P, 2H + 1) full coefficients of the observed DOF [m].
    states : names of the contacts, and their states by number, (P, n_contacts).
    """
    from solver.response.contact_response import state_of

    # `max_abs` is the word that `solve` and measured data have for it; `amplitude` stays for who reads it.
    columns = {**columns, **({"max_abs": columns["amplitude"]} if "amplitude" in columns else {})}
    told = {
        "parameter": (unit, path), "amplitude": ("m", AMPLITUDE), "max_abs": ("m", AMPLITUDE),
        "half_peak_to_peak": ("m", "(max x - min x) / 2"), "mean": ("m", "mean of the observed DOF"),
        "residual": ("", "relative residual"),
    }  # fmt: skip
    variables = {name: column("point", columns[name], *told[name]) for name in told if name in columns}
    if observed is not None:
        top = (observed.shape[-1] - 1) // 2
        variables["harmonic"] = column(
            "harmonic", np.arange(top + 1), "", "multiple of the excitation frequency"
        )
        variables |= harmonics(observed, ("point", "harmonic"), "displacement", "m")
    if states is not None and states[0]:
        names, codes = states
        words = [[state_of(int(code)).value for code in row] for row in codes]
        variables["contact"] = column("contact", np.array(names, dtype=np.str_), "", "name of the contact")
        variables["state"] = Variable(
            dims=("point", "contact"), values=np.array(words, dtype=np.str_).reshape(len(codes), len(names)),
            about="what the contact does over a period",
        )  # fmt: skip
    return variables


def branch_dataset(branch: AnyBranch) -> Dataset:
    """A point a row, with the harmonics of the observed DOF and the state of every contact."""
    columns = {
        "parameter": branch.values, "amplitude": branch.amplitude,
        "half_peak_to_peak": branch.half_peak_to_peak, "mean": branch.mean, "residual": branch.residuals,
    }  # fmt: skip
    names = [contact.name for contact in branch.scene.contacts]
    variables = point_variables(
        branch.parameter, branch.unit, columns, branch.observed,
        (names, branch.states),
    )  # fmt: skip
    peak, band = branch.peak, branch.band
    notes = attributes(
        branch.status.value, branch.scene, parameter=branch.parameter, harmonics=branch.n_harmonics,
        observed=branch.scene.observe.dof, peak=None if peak is None else peak.value,
        peak_at=None if peak is None else peak.at, band=None if band is None else band.width,
        band_limit=None if band is None else band.limit,
    )  # fmt: skip
    return Dataset(kind="branch", rows=("point",), variables=variables, attributes=notes)


def solution_dataset(solution: Solution) -> Dataset:
    """Harmonics of the observed DOF and of every contact, and one period in time."""
    # Not above: the service tells stored sweeps without Numba, which this loads.
    from solver.jit.fourier import basis

    top, names = solution.n_harmonics, [contact.name for contact in solution.contacts]
    share = np.linspace(0.0, 1.0, _SAMPLES, endpoint=False)
    functions = basis(2.0 * np.pi * share, solution.highest_harmonic)
    variables = {
        "time": column("time", share / solution.frequency_hz, "s", "from the start of a period"),
        "displacement": column("time", functions @ solution.observed, "m", "of the observed DOF"),
        "harmonic": column(
            "harmonic", np.arange(solution.highest_harmonic + 1), "", "multiple of the excitation frequency"
        ),
        **harmonics(solution.observed, ("harmonic",), "displacement", "m"),
    }
    if names:
        from solver.response.time_history import hysteresis_loop

        loops = [hysteresis_loop(solution, name, samples=_SAMPLES) for name in names]
        parts = (("slip", 0, "m", "relative displacement"), ("force", 1, "N", "contact force"))
        variables["contact"] = column("contact", np.array(names, dtype=np.str_), "", "name of the contact")
        variables["state"] = column("contact", np.array([c.state.value for c in solution.contacts]))
        for name, which, unit, about in parts:
            variables[name] = Variable(
                dims=("contact", "time"), values=np.array([loop[which] for loop in loops]), unit=unit,
                about=about,
            )  # fmt: skip
            rows = np.array([(c.slip, c.force)[which] for c in solution.contacts])
            variables |= harmonics(rows, ("contact", "harmonic"), name, unit)
    notes = attributes(
        solution.status.value, solution.scene, frequency_hz=solution.frequency_hz, harmonics=top,
        observed=solution.scene.observe.dof, max_abs=solution.max_abs, error_estimate=solution.error_estimate,
        flags=", ".join(solution.flags),
    )  # fmt: skip
    return Dataset(kind="solution", rows=("time",), variables=variables, attributes=notes)


def interference_dataset(found: InterferenceDiagram) -> Dataset:
    """A family at a nodal diameter a row; beside them the orders with what they meet."""
    rows = [
        (point.diameter, point.wave.value, i, free, stuck)
        for point in found.points
        for i, (free, stuck) in enumerate(zip(point.open_hz, point.stuck_hz, strict=True), start=1)
    ]
    variables = {
        "diameter": column("mode", np.array([row[0] for row in rows], np.int64), "", "nodal diameter"),
        "wave": column("mode", np.array([row[1] for row in rows], np.str_), "", "direction"),
        "family": column("mode", np.array([row[2] for row in rows], np.int64), "", "1 the lowest"),
        "open": column("mode", np.array([row[3] for row in rows], np.float64), "Hz", "all contacts open"),
        "stuck": column("mode", np.array([row[4] for row in rows], np.float64), "Hz", "all contacts stuck"),
    }
    for name, field, unit in (
        ("order", "order", ""), ("order_diameter", "diameter", ""), ("order_family", "family", ""),
        ("order_frequency", "frequency_hz", "Hz"), ("order_margin", "margin", ""),
    ):  # fmt: skip
        kind = np.float64 if unit or field == "margin" else np.int64
        values = np.array([getattr(one, field) for one in found.crossings], kind)
        variables[name] = column("crossing", values, unit)
    notes = attributes(
        found.status.value, found.scene, sectors=found.sectors, speed_rpm=found.speed_rpm, within=found.within
    )
    return Dataset(kind="interference", rows=("mode",), variables=variables, attributes=notes)


def stability_dataset(found: Stability) -> Dataset:
    """A Floquet multiplier a row, largest first."""
    variables = {
        "real": column("multiplier", found.multipliers.real),
        "imaginary": column("multiplier", found.multipliers.imag),
        "modulus": column("multiplier", np.abs(found.multipliers)),
    }
    notes = attributes(found.growth.value, frequency_hz=found.frequency_hz, neutral=found.neutral)
    return Dataset(kind="stability", rows=("multiplier",), variables=variables, attributes=notes)
