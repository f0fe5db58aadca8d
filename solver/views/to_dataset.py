"""The results of the solver as named arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.results.dataset import Attribute, Dataset, Variable
from solver.views.io import scene_attributes

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch
    from solver.jit.fourier import Real
    from solver.marching.result import MarchResult
    from solver.modes.driven.results import HeldAmplitude, PhaseResonance
    from solver.modes.peaks.performance import PerformanceCurve
    from solver.modes.results import ModalCurve, NonlinearMode
    from solver.response.solution import Solution
    from solver.response.stability.floquet import Stability
    from solver.scene.scene import Scene
    from solver.studies.blades import BladeAmplitudes, BladePeaks
    from solver.studies.mistuning_result import MistuningStudy
    from solver.studies.peaks.results import LeastPeak, PeakTrack
    from solver.studies.study_results import AccuracyStudy, InterferenceDiagram, Plan, ResponseMap

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


def march_dataset(march: MarchResult) -> Dataset:
    """The last period: the observed DOF, and motion, force and load of every contact."""
    variables = {
        "time": column("time", march.time, "s", "from the start of the last period"),
        "displacement": column("time", march.displacement, "m", "of the observed DOF"),
        "velocity": column("time", march.velocity, "m/s", "of the observed DOF"),
    }
    if march.contacts:
        variables["contact"] = column("contact", np.array(march.contacts, dtype=np.str_))
        for name, values, unit in (
            ("slip", march.slip, "m"), ("force", march.contact_force, "N"),
            ("normal_load", march.normal_load, "N"),
        ):  # fmt: skip
            variables[name] = Variable(dims=("contact", "time"), values=values, unit=unit)
    notes = attributes(
        march.status.value, frequency_hz=march.frequency_hz, max_abs=march.max_abs, periods=march.periods,
        steps_per_period=march.steps_per_period, error_estimate=march.error_estimate,
    )  # fmt: skip
    return Dataset(kind="march", rows=("time",), variables=variables, attributes=notes)


def map_dataset(found: ResponseMap) -> Dataset:
    """The grid; the tracked highest peak beside it, where it was asked for."""
    variables = {
        "parameter": column("parameter", found.parameter, found.unit, found.parameter_path),
        "frequency": column("frequency", found.frequency, "Hz", "excitation frequency"),
    }
    for name, values in (("amplitude", found.amplitude), ("half_peak_to_peak", found.half_peak_to_peak)):
        variables[name] = Variable(
            dims=("parameter", "frequency"), values=values, unit="m",
            about=AMPLITUDE if name == "amplitude" else "(max x - min x) / 2",
        )  # fmt: skip
    if found.ridge is not None:
        ridge = found.ridge.to_dataset().variables
        names = ("parameter", "peak", "frequency")
        variables |= {
            f"ridge_{name}": column("ridge", ridge[name].values, ridge[name].unit) for name in names
        }
    notes = attributes(
        found.status.value, found.given, parameter=found.parameter_path, harmonics=found.n_harmonics
    )
    return Dataset(kind="map", rows=("parameter", "frequency"), variables=variables, attributes=notes)


def track_dataset(track: PeakTrack) -> Dataset:
    """The highest peak over the parameter."""
    variables = {
        "parameter": column("point", track.parameter, track.unit, track.parameter_path),
        "peak": column("point", track.peak, "m", "highest peak, max|x| of the observed DOF"),
        "frequency": column("point", track.frequency, "Hz", "of the highest peak"),
        "slope": column("point", track.slope, "", "d peak / d parameter"),
    }
    best = track.optimum
    notes = attributes(
        track.status.value, track.given, parameter=track.parameter_path, harmonics=track.n_harmonics,
        least_at=best.at, least_peak=best.peak,
    )  # fmt: skip
    return Dataset(kind="peaks", rows=("point",), variables=variables, attributes=notes)


def accuracy_dataset(study: AccuracyStudy) -> Dataset:
    """A row for each way to compute the point."""
    units = {"max_abs": "m", "error": "m", "milliseconds": "ms"}
    names = (
        "harmonics", "evaluator", "samples", "max_abs", "error", "milliseconds", "iterations", "residual",
        "pareto",
    )  # fmt: skip
    variables = {
        name: column("way", np.array([getattr(row, name) for row in study.rows]), units.get(name, ""))
        for name in names
    }
    notes = attributes(
        study.status.value, frequency_hz=study.frequency_hz, reference=study.reference,
        reference_harmonics=study.reference_harmonics, reference_error=study.reference_error,
        scene_name=study.scene,
    )  # fmt: skip
    return Dataset(kind="accuracy", rows=("way",), variables=variables, attributes=notes)


def mistuning_dataset(study: MistuningStudy) -> Dataset:
    """A disk a row: its magnification, and the factor and the peak of every blade."""
    disks = study.disks
    sectors = len(study.tuned.value)
    variables = {
        "seed": column("disk", np.array([disk.seed for disk in disks], dtype=np.int64)),
        "magnification": column("disk", np.array([disk.magnification for disk in disks], dtype=np.float64)),
        "sector": column("sector", np.arange(sectors)),
    }
    rows = {
        "factor": ([disk.factors for disk in disks], "", "of the named parts"),
        "peak": ([disk.peaks.value for disk in disks], "m", "highest peak of the blade"),
        "frequency": ([disk.peaks.at_hz for disk in disks], "Hz", "of that peak"),
    }
    for name, (values, unit, words) in rows.items():
        array = np.array(values, dtype=np.float64).reshape(len(disks), -1)
        variables[name] = Variable(dims=("disk", "sector"), values=array, unit=unit, about=words)
    notes = attributes(
        study.status.value, spread=study.spread, of=", ".join(study.of), harmonics=study.n_harmonics,
        tuned_peak=study.tuned.largest, scene_name=study.scene,
    )  # fmt: skip
    return Dataset(kind="mistuning", rows=("disk",), variables=variables, attributes=notes)


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


def plan_dataset(found: Plan) -> Dataset:
    """An effect a row: whether it is paid for, and why."""
    variables = {
        "effect": column("effect", np.array([effect.name for effect in found.effects], dtype=np.str_)),
        "used": column("effect", np.array([effect.used for effect in found.effects], dtype=bool)),
        "reason": column("effect", np.array([effect.reason for effect in found.effects], dtype=np.str_)),
    }
    return Dataset(kind="plan", rows=("effect",), variables=variables, attributes=attributes("planned"))


def least_dataset(best: LeastPeak) -> Dataset:
    """A local minimum of the highest peak a row, best first."""
    basins = best.basins
    variables = {
        "parameter": column("minimum", np.array([one.at for one in basins], dtype=np.float64)),
        "peak": column("minimum", np.array([one.peak for one in basins], dtype=np.float64), "m"),
        "solved": column("minimum", np.array([one.solved for one in basins], dtype=bool)),
        "proven": column("minimum", np.array([one.proven for one in basins], dtype=bool)),
    }
    scene = None if best.branch is None else best.branch.scene
    notes = attributes(best.status.value, scene, least_at=best.at, least_peak=best.peak)
    return Dataset(kind="least", rows=("minimum",), variables=variables, attributes=notes)


def blade_peaks_dataset(peaks: BladePeaks) -> Dataset:
    """A sector a row: the highest peak of its blade."""
    variables = {
        "sector": column("sector", np.arange(peaks.value.size)),
        "peak": column("sector", peaks.value, "m", f"highest peak, max|x| of {peaks.dof}"),
        "frequency": column("sector", peaks.at_hz, "Hz", "of that peak"),
        "status": column("sector", np.array([one.value for one in peaks.status], dtype=np.str_)),
    }
    return Dataset(kind="blade-peaks", rows=("sector",), variables=variables, attributes=attributes("solved"))


def amplitudes_dataset(blades: BladeAmplitudes) -> Dataset:
    """A sector a row: the motion of its blade."""
    variables = {
        "sector": column("sector", np.arange(blades.max_abs.size)),
        "max_abs": column("sector", blades.max_abs, "m", f"max|x| of {blades.dof}"),
        "half_peak_to_peak": column("sector", blades.half_peak_to_peak, "m", "(max x - min x) / 2"),
    }
    return Dataset(kind="blades", rows=("sector",), variables=variables, attributes=attributes("solved"))


def stability_dataset(found: Stability) -> Dataset:
    """A Floquet multiplier a row, largest first."""
    variables = {
        "real": column("multiplier", found.multipliers.real),
        "imaginary": column("multiplier", found.multipliers.imag),
        "modulus": column("multiplier", np.abs(found.multipliers)),
    }
    notes = attributes(found.growth.value, frequency_hz=found.frequency_hz, neutral=found.neutral)
    return Dataset(kind="stability", rows=("multiplier",), variables=variables, attributes=notes)


def mode_dataset(found: NonlinearMode) -> Dataset:
    """A point a row: amplitude, frequency, damping ratio, the states of the contacts and the mode shape."""
    variables = {
        "amplitude": column("point", found.amplitude, "√kg m", "a² = Σ Q_kᴴ M Q_k"),
        "frequency": column("point", found.frequency_hz, "Hz"),
        "damping_ratio": column("point", found.damping_ratio),
        "frequency_error": column("point", found.frequency_error, "Hz", "estimate by more harmonics"),
        "damping_error": column("point", found.damping_error, "", "estimate by more harmonics"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
        "forcing": column("point", found.forcing, "N/√kg", "|Qᴴ f| of the excitation, mode normalised"),
        **_states(found),
        "dof": column("dof", np.array(found.scene.dofs, dtype=np.str_)),
        **harmonics(found.dof_motions, ("point", "dof", "harmonic"), "motion", "m"),
    }
    notes = attributes(
        found.status.value, found.scene, mode_number=found.mode, harmonics=found.n_harmonics,
        nodal_diameter=found.nodal_diameter,
    )  # fmt: skip
    return Dataset(kind="modes", rows=("point",), variables=variables, attributes=notes)


def _states(found: ModalCurve) -> dict[str, Variable]:
    words = np.array(found.state_words, np.str_).reshape(found.states.shape)
    names = column("contact", np.array(found.contact_names, dtype=np.str_))
    return {"contact": names, "state": Variable(dims=("point", "contact"), values=words)}


def performance_dataset(curve: PerformanceCurve) -> Dataset:
    """A point of the mode a row: factor on the excitation or on the loads, and the peak with it."""
    variables = {
        "excitation": column("point", curve.excitation, "", "factor on every force"),
        "peak": column("point", curve.peak, "m", AMPLITUDE),
        "frequency": column("point", curve.frequency_hz, "Hz", "of the peak"),
        "load": column("point", curve.load, "", "factor on every load, the excitation as it is"),
        "peak_at_load": column("point", curve.peak_at_load, "m", "the peak then"),
    }
    notes = attributes(curve.mode.status.value, curve.mode.scene, mode_number=curve.mode.mode)
    return Dataset(kind="performance", rows=("point",), variables=variables, attributes=notes)


def held_dataset(found: HeldAmplitude) -> Dataset:
    """A frequency a row: the force that holds the amplitude, and the response to it."""
    stable = ["" if one is None else "yes" if one else "no" for one in found.stable]
    variables = {
        "frequency": column("point", found.frequency_hz, "Hz"),
        "excitation": column("point", found.excitation, "", "factor on every force"),
        "excitation_error": column("point", found.excitation_error, "", "estimate by more harmonics"),
        "phase": column("point", found.phase_deg, "deg", "of harmonic 1, ahead of the excitation"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
        "stable": column("point", np.array(stable, dtype=np.str_), "", "while the force is held"),
        **_states(found),
        **harmonics(found.observed, ("point", "harmonic"), "observed", "m"),
    }
    notes = attributes(found.status.value, found.scene, amplitude=found.held, harmonics=found.n_harmonics)
    return Dataset(kind="controlled", rows=("point",), variables=variables, attributes=notes)


def resonance_dataset(found: PhaseResonance) -> Dataset:
    """An amplitude a row: frequency and force of phase resonance."""
    variables = {
        "amplitude": column("point", found.amplitude, "√kg m", "a² = Σ Q_kᴴ M Q_k"),
        "frequency": column("point", found.frequency_hz, "Hz"),
        "excitation": column("point", found.excitation, "", "factor on every force"),
        "max_abs": column("point", found.max_abs, "m", AMPLITUDE),
    }
    notes = attributes(found.status.value, found.scene, mode_number=found.mode)
    return Dataset(kind="phase-resonance", rows=("point",), variables=variables, attributes=notes)
