"""The results of the solver in a few words, with units."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from solver.continuation.branch import BranchStatus
from solver.results import units
from solver.results.notes import BAND_OPEN, between_points, drift_words, flag_words
from solver.results.told import Summary
from solver.scene.parameter_paths import parameter

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch
    from solver.marching.result import MarchResult
    from solver.modes.peaks.performance import PerformanceCurve
    from solver.modes.results import HeldAmplitude, NonlinearMode, PhaseResonance
    from solver.response.solution import Solution
    from solver.response.stability.floquet import Stability
    from solver.studies.blades import BladeAmplitudes, BladePeaks
    from solver.studies.mistuning_result import MistuningStudy
    from solver.studies.peaks.results import LeastPeak, PeakTrack
    from solver.studies.study_results import AccuracyStudy, InterferenceDiagram, Plan, ResponseMap

LEVEL = 1e-9  # relative difference of damping ratios that is none
Pairs = list[tuple[str, str]]


def made(title: str, pairs: Pairs, status: str) -> Summary:
    """A summary that ends with the status."""
    return Summary(title=title, pairs=(*pairs, ("status", status)))


def of_branch(branch: AnyBranch) -> Summary:
    """Peak, band and size of a branch."""
    path, pairs = branch.parameter, []
    if branch.peak is not None:
        height = units.length(branch.peak.value)
        pairs.append(("peak", f"{height} at {parameter(path, branch.peak.at)}"))
        if math.isfinite(branch.error_estimate):
            pairs.append(("estimated error", units.length(branch.error_estimate)))
        pairs.append(("stable at the peak", branch.peak_stability[0].line))
    if branch.band is not None:
        width = parameter(path, branch.band.width)
        pairs.append(("band", f"{width} above {units.length(branch.band.limit)}"))
    if branch.ratchets:
        pairs.append(("drifts", drift_words(branch.drift_per_period, branch.flags)))
    pairs += _branch_notes(branch)
    pairs += [("points", str(len(branch.values))), ("time", units.duration(branch.seconds))]
    title = f"{branch.scene.name} over {path}, {branch.n_harmonics} harmonics"
    return made(title, pairs, branch.status.value)


def _branch_notes(branch: AnyBranch) -> list[tuple[str, str]]:
    """The certificate of a branch and its flags, as rows of a summary."""
    pairs: list[tuple[str, str]] = []
    if branch.peak is not None:
        found = branch.peak_certificate
        pairs.append(("between points", between_points(known=found.known, reason=found.reason)))
        if found.known and branch.band is not None and not branch.band.known:
            pairs.append(("note", BAND_OPEN))
    return pairs + [("note", words) for words in flag_words(branch.flags)]


def of_solution(solution: Solution) -> Summary:
    """Amplitude, error and contacts of a solution."""
    pairs: Pairs = []
    if solution.converged:
        pairs += [
            ("max|x|", units.length(solution.max_abs)),
            ("estimated error", units.length(solution.error_estimate)),
            *((contact.name, contact.state.value) for contact in solution.contacts),
            ("stable", solution.stability.line),
        ]
        if "mean_undetermined" in solution.flags and math.isfinite(solution.mean_range[0]):
            low, high = (units.length(bound) for bound in solution.mean_range)
            pairs.append(("mean, any history", f"{low} to {high}"))
    if solution.ratchets:
        pairs.append(("drifts", drift_words(solution.drift_per_period, solution.flags)))
    pairs += [("note", words) for words in flag_words(solution.flags)]
    pairs += [("residual", f"{solution.residual:.1e}"), ("time", units.duration(solution.seconds))]
    title = f"{solution.scene.name} at {solution.frequency_hz:.6g} Hz, {solution.n_harmonics} harmonics"
    return made(title, pairs, solution.status.value)


def of_march(march: MarchResult) -> Summary:
    """Amplitude and length of a march."""
    pairs: Pairs = []
    if march.converged:
        pairs += [("max|x|", units.length(march.max_abs)), ("relative error", f"{march.error_estimate:.1e}")]
    pairs += [
        ("periods", str(march.periods)),
        ("steps a period", str(march.steps_per_period)),
        ("time", units.duration(march.seconds)),
    ]
    return made(f"at {march.frequency_hz:.6g} Hz", pairs, march.status.value)


def of_map(found: ResponseMap) -> Summary:
    """Size of a map, and its ridge."""
    rows, columns = found.amplitude.shape
    pairs: Pairs = [("points", f"{rows} × {columns}")]
    if found.ridge is not None:
        pairs += _least(found.ridge)
    pairs.append(("time", units.duration(found.seconds)))
    title = f"{found.scene} over frequency and {found.parameter_path}, {found.n_harmonics} harmonics"
    return made(title, pairs, found.status.value)


def of_track(track: PeakTrack) -> Summary:
    """The least highest peak, and what it took."""
    pairs = [
        *_least(track),
        ("points", f"{len(track.parameter)}, {track.sweeps} sweeps"),
        ("time", units.duration(track.seconds)),
    ]
    title = f"highest peak of {track.scene} over {track.parameter_path}, {track.n_harmonics} harmonics"
    return made(title, pairs, track.status.value)


def _least(track: PeakTrack) -> Pairs:
    best = track.optimum
    if not math.isfinite(best.at):
        return []
    return [("least peak", f"{units.length(best.peak)} at {parameter(track.parameter_path, best.at)}")]


def of_accuracy(study: AccuracyStudy) -> Summary:
    """The ways that no other beats, with error and time."""
    pairs: Pairs = [("reference", units.length(study.reference))]
    for row in study.rows:
        if row.pareto:
            how = row.evaluator if not row.samples else f"{row.samples} samples"
            cost = f"error {row.error / study.reference:.1e}, {row.milliseconds:.3g} ms"
            pairs.append((f"{row.harmonics} harmonics, {how}", cost))
    return made(f"{study.scene} at {study.frequency_hz:.6g} Hz", pairs, study.status.value)


def of_mistuning(study: MistuningStudy) -> Summary:
    """Magnification over the disks, and the worst."""
    factors, pairs = study.magnifications, []
    if math.isfinite(study.tuned.largest):
        pairs.append(("tuned peak", units.length(study.tuned.largest)))
    if factors.size:
        pairs.append(("magnification", f"{factors.mean():.4g} in the mean, {factors.max():.4g} at most"))
    pairs.append(("time", units.duration(study.seconds)))
    title = f"{len(study.disks)} disks of {study.scene}, spread {study.spread:g} of {', '.join(study.of)}"
    return made(title, pairs, study.status.value)


def of_interference(found: InterferenceDiagram) -> Summary:
    """The range of the lowest families, and how many orders meet a family."""
    pairs: Pairs = []
    for i in range(min((len(point.open_hz) for point in found.points), default=0)):
        free, stuck = ([values[i] for values in each] for each in (
            [point.open_hz for point in found.points], [point.stuck_hz for point in found.points],
        ))  # fmt: skip
        pairs.append(
            (f"family {i + 1}", f"{min(free):.5g} to {max(free):.5g} Hz open, "
                                f"{min(stuck):.5g} to {max(stuck):.5g} Hz stuck")
        )  # fmt: skip
    if found.speed_rpm is not None:
        inside = sum(one.inside for one in found.crossings)
        met = f"{inside} within the range of a family, {len(found.crossings) - inside} near one"
        pairs.append((f"orders at {found.speed_rpm:g} rpm", met))
    if found.missing:
        pairs.append(("missing", f"nodal diameters {', '.join(map(str, found.missing))}"))
    pairs.append(("time", units.duration(found.seconds)))
    return made(f"{found.scene.name}, {found.sectors} sectors", pairs, found.status.value)


def of_mode(found: NonlinearMode) -> Summary:
    """Frequency and damping ratio at both ends, and where it damps most."""
    pairs: Pairs = []
    if found.amplitude.size:
        # Where damping is level, rounding would choose among its places.
        most = found.damping_ratio.max()
        best = int(np.argmax(found.damping_ratio >= most - LEVEL * abs(most)))
        for name, i in (("smallest", 0), ("most damping", best), ("largest", -1)):
            at = f"a = {found.amplitude[i]:.4g} √kg m"
            pairs.append((name, f"{found.frequency_hz[i]:.6g} Hz, ζ = {found.damping_ratio[i]:.5g} at {at}"))
    pairs += [("points", str(found.amplitude.size)), ("time", units.duration(found.seconds))]
    of = "" if found.nodal_diameter is None else f", nodal diameter {found.nodal_diameter}"
    title = f"{found.scene.name}, mode {found.mode}{of}, {found.n_harmonics} harmonics"
    return made(title, pairs, found.status.value)


def of_performance(curve: PerformanceCurve) -> Summary:
    """The least peak over the loads, and the range of the curve."""
    pairs: Pairs = []
    load, peak = curve.least
    if math.isfinite(peak):
        pairs.append(("least peak", f"{units.length(peak)} with {load:.4g} times the loads"))
    if curve.excitation.size:
        low, high = float(curve.excitation.min()), float(curve.excitation.max())
        pairs.append(("excitation", f"from {low:.3g} to {high:.3g} times the scene's"))
    title = f"{curve.mode.scene.name}, mode {curve.mode.mode}"
    return made(title, pairs, curve.mode.status.value)


def of_held(found: HeldAmplitude) -> Summary:
    """The least force and its frequency, kinks, and what is not stable."""
    pairs: Pairs = []
    factor, at = found.least
    if math.isfinite(factor):
        pairs.append(("least force", f"{factor:.4g} times the excitation at {at:.6g} Hz"))
    pairs.append(("kinks", str(len(found.changes))))
    unstable = sum(one is False for one in found.stable)
    pairs.append(("unstable points", found.unknown or str(unstable)))
    pairs += [("points", str(found.frequency_hz.size)), ("time", units.duration(found.seconds))]
    title = f"{found.scene.name}, |{found.scene.observe.dof}| held at {units.length(found.held)}"
    return made(title, pairs, found.status.value)


def of_resonance(found: PhaseResonance) -> Summary:
    """Frequency and force at both ends."""
    pairs: Pairs = []
    if found.amplitude.size:
        for name, i in (("smallest", 0), ("largest", -1)):
            force = f"{found.frequency_hz[i]:.6g} Hz, {found.excitation[i]:.4g} times the excitation"
            pairs.append((name, f"{force} at a = {found.amplitude[i]:.4g} √kg m"))
    pairs += [("points", str(found.amplitude.size)), ("time", units.duration(found.seconds))]
    title = f"{found.scene.name}, phase resonance of mode {found.mode}"
    return made(title, pairs, found.status.value)


def of_plan(found: Plan) -> Summary:
    """Every effect with its reason, and the cost of a point."""
    pairs = [(("" if e.used else "left out: ") + e.name, e.reason) for e in found.effects]
    pairs.append(("unknowns", str(found.unknowns)))
    pairs.append(("a point takes about", units.duration(found.seconds_a_point)))
    pairs.append(("stability takes about", units.duration(found.seconds_of_stability)))
    pairs.append(("dense matrices take about", f"{found.dense_bytes / 1e6:.3g} MB"))
    return Summary(title=f"{found.scene}, {found.harmonics} harmonics", pairs=tuple(pairs))


def of_least(best: LeastPeak) -> Summary:
    """The least highest peak, what holds it, and what else was met."""
    pairs: Pairs = []
    if math.isfinite(best.at):
        pairs.append(("least peak", f"{units.length(best.peak)} at {best.at:.6g}"))
        pairs.append(("peaks there", ", ".join(f"{one.frequency:.6g} Hz" for one in best.active)))
    if best.plateau is not None:
        low, high = best.plateau
        pairs.append(("the same from", f"{low:.6g} to {high:.6g}, chosen by: {best.chosen_by}"))
    others = [f"{units.length(basin.peak)} at {basin.at:.6g}" for basin in best.basins[1:]]
    if others:
        pairs.append(("other minima", "; ".join(others)))
    pairs += [("responses", f"{best.sweeps}, the work of {best.work:.3g}")]
    pairs.append(("time", units.duration(best.seconds)))
    scene = "" if best.branch is None else f"of {best.branch.scene.name}"
    return made(f"highest peak {scene}".rstrip(), pairs, best.status.value)


def of_blade_peaks(peaks: BladePeaks) -> Summary:
    """The highest blade, the least, and those whose branch did not reach the end."""
    known = peaks.value[np.isfinite(peaks.value)]
    pairs: Pairs = []
    if known.size:
        at = int(np.nanargmax(peaks.value))
        pairs.append(("highest", f"{units.length(known.max())} at {peaks.at_hz[at]:.6g} Hz, blade {at}"))
        pairs.append(("lowest", units.length(known.min())))
    pairs.append(("blades", str(peaks.value.size)))
    reached = BranchStatus.COMPLETED
    ended = next((one for one in peaks.status if one is not reached), reached)
    return made(peaks.dof, pairs, ended.value)


def of_amplitudes(blades: BladeAmplitudes) -> Summary:
    """The blade that moves most, and the one that moves least."""
    pairs = (
        ("largest", f"{units.length(blades.largest)}, blade {blades.worst}"),
        ("smallest", units.length(float(blades.max_abs.min()))),
        ("blades", str(blades.max_abs.size)),
    )
    return Summary(title=f"max|x| of {blades.dof}", pairs=pairs)


def of_stability(found: Stability) -> Summary:
    """Whether it is stable, and the largest multiplier."""
    pairs: Pairs = [
        ("stable", "yes" if found.stable else "no"),
        ("largest multiplier", f"{found.radius:.6g} in modulus"),
        ("multipliers", f"{found.multipliers.size}, and {found.neutral} that are 1 by construction"),
        ("time", units.duration(found.seconds)),
    ]
    return made(f"at {found.frequency_hz:.6g} Hz", pairs, found.growth.value)
