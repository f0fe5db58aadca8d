"""What a sweep says of a scene beside what is true by brute force over points."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from light_truth import Truth, true_response

from solver import Branch, Scene, sweep

Intervals = list[tuple[float, float]]

HEIGHT = 1e-4  # relative error allowed to a peak's value
PLACE = 1e-3  # relative distance of its frequency: the top of a broad peak is flat
WIDTH = 1e-4  # error of a band, relative to its width
COUNTS = 0.01  # share of the highest from which a peak must be there
STANDS_OUT = 1e-3  # prominence, relative to its value, from which it must be there
HISTORY = 1e-6  # relative difference between starts beyond which a height is history
TANGENT = 1e-6  # relative change of a limit: the band must lie between those of both
SHARES = (None, 0.2, 0.05)  # limits of bands as shares of the highest amplitude; None: half power


class Outcome(Enum):
    """Of one scene."""

    RIGHT = "right"
    SAID_SO = "status"
    WRONG = "wrong"


@dataclass(slots=True)
class Verdict:
    """Of one scene: what is wrong with what was said, in words."""

    faults: list[str] = field(default_factory=list)
    statuses: list[str] = field(default_factory=list)
    judged: bool = True  # whether brute force found every point and no height is history

    @property
    def outcome(self) -> Outcome:
        if self.statuses:
            return Outcome.SAID_SO
        return Outcome.WRONG if self.faults else Outcome.RIGHT


def judge(
    scene: Scene, harmonics: int, truth: Truth | None = None, *, downwards: bool = False,
    shares: tuple[float | None, ...] = SHARES,
) -> Verdict:  # fmt: skip
    """Compare sweeps of a scene, one for each limit of a band, with brute force over points."""
    truth = truth or true_response(scene, harmonics)
    verdict = Verdict(judged=not truth.unsolved and all(p.history <= HISTORY for p in truth.peaks))
    ends = scene.observe.band[::-1] if downwards else scene.observe.band
    for share in shares:
        limit = None if share is None else share * truth.highest
        branch = sweep(scene, start=ends[0], stop=ends[1], harmonics=harmonics, limit=limit)
        if not says_it_knows(branch):
            verdict.statuses.append(status_of(branch))
            continue
        if share is shares[0]:
            verdict.faults += highest_faults(branch, truth) + peak_faults(branch, truth)
        verdict.faults += band_faults(branch, truth, limit)
    return verdict


def says_it_knows(branch: Branch) -> bool:
    """Whether a branch claims that its peaks are all there are."""
    certificate = getattr(branch, "peak_certificate", None)
    return branch.reached and (certificate is None or bool(certificate.known))


def status_of(branch: Branch) -> str:
    return branch.status.name if not branch.reached else "peaks not known"


def highest_faults(branch: Branch, truth: Truth) -> list[str]:
    assert branch.peak is not None
    error = branch.peak.value / truth.highest - 1.0
    if abs(error) <= HEIGHT:
        return []
    at = truth.hz[int(np.argmax(truth.amplitude))]
    said = f"{branch.peak.value:.8g} at {branch.peak.at:.8g} Hz"
    return [f"highest: {said}, but {truth.highest:.8g} at {at:.8g} Hz ({error:+.2g})"]


def peak_faults(branch: Branch, truth: Truth) -> list[str]:
    """Peaks that are missing or of the wrong height, and those where the amplitude is another one."""
    faults = []
    said = [peak for peak in branch.peaks if peak.interior]
    for peak in truth.peaks:
        if peak.value < COUNTS * truth.highest or peak.prominence < STANDS_OUT or peak.history > HISTORY:
            continue
        near = [one for one in said if abs(one.at / peak.at - 1.0) <= PLACE]
        error = min((abs(one.value / peak.value - 1.0) for one in near), default=1.0)
        if error > HEIGHT:
            what = f"off by {error:.2g}" if near else "missing"
            share = peak.value / truth.highest
            faults.append(f"peak {what}: {peak.value:.8g} ({share:.2g} of the highest) at {peak.at:.10g} Hz")
    return faults + _not_there(branch, truth)


def _not_there(branch: Branch, truth: Truth) -> list[str]:
    """Peaks a branch tells of though the amplitude is another one at their frequency."""
    said = [peak for peak in branch.peaks if peak.value >= COUNTS * truth.highest]
    said.sort(key=lambda peak: peak.at)
    found = truth.solver.amplitudes(np.array([peak.at for peak in said]))
    return [
        f"peak said: {peak.value:.8g} at {peak.at:.10g} Hz, where the amplitude is {value:.8g}"
        for peak, value in zip(said, found, strict=True)
        if abs(peak.value / value - 1.0) > HEIGHT
    ]


def band_faults(branch: Branch, truth: Truth, limit: float | None) -> list[str]:
    """What of the band above a limit (half power of the highest without one) is missing or too much."""
    if branch.band is None:
        return ["no band"]
    if limit is None:
        limit = truth.highest / np.sqrt(2.0)
    least, most = truth.band(limit * (1.0 + TANGENT)), truth.band(limit * (1.0 - TANGENT))
    said = list(branch.band.intervals)
    allowed = WIDTH * measure(most) + 1e-10 * truth.hz[-1]
    faults = []
    for what, error in (("missing", beyond(least, said)), ("too much", beyond(said, most))):
        if error > allowed:
            share = error / max(measure(most), 1e-300)
            faults.append(
                f"band above {limit:.8g} ({limit / truth.highest:.2g} of the highest): {share:.2g} of its "
                f"width of {measure(most):.6g} Hz {what}, {len(said)} pieces for {len(most)}"
            )
    return faults


def measure(intervals: Intervals) -> float:
    """Length of disjoint intervals."""
    return float(sum(high - low for low, high in intervals))


def beyond(these: Intervals, others: Intervals) -> float:
    """Length of what `these` cover and `others` do not."""
    shared = sum(max(0.0, min(high, top) - max(low, bottom)) for low, high in these for bottom, top in others)
    return measure(these) - float(shared)
