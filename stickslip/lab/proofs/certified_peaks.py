"""Proofs of the peaks that a study found: of the least peak over a load, or of those at one value."""

from __future__ import annotations

from collections.abc import Sequence

from stickslip.lab.proofs.certificate import (
    Certificate,
    CertificateStatus,
    certify,
    check_certifiable,
    loads_of,
)
from solver.response.solve import solve
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene


def certified_peaks(
    peaks: Sequence[tuple[Scene, float]],
    *,
    least_over: str = "",
    harmonics: int = 11,
    should_stop: ShouldStop = None,
) -> tuple[Certificate, ...]:
    """Prove peaks that were found.

    One alone that is least over a load is proved to be that: if all of the load varies with N0, and where the
    proof succeeds. Of several each is proved by itself, which does not say that the highest is least.

    Parameters
    ----------
    peaks : of each the scene, with the values that make it, and its frequency [Hz].
    least_over : the path over which the highest is least, within the range.
    harmonics : highest harmonic of the balance that the search begins with.
    should_stop : asked now and then, as by `certify`.

    Raises
    ------
    SettingError
        A scene that cannot be certified.
    MissingExtraError
        Without python-flint.
    """
    for scene, _ in peaks:
        check_certifiable(scene)
    near = [solve(scene, frequency_hz=hertz, harmonics=harmonics) for scene, hertz in peaks]
    if len(near) == 1 and _all_in_proportion(peaks[0][0], least_over):
        least = certify(near[0], least_over=least_over, should_stop=should_stop)
        if least.reached or least.status is CertificateStatus.STOPPED:
            return (least,)
        return least, certify(near[0], peak=True, should_stop=should_stop)
    return tuple(certify(each, peak=True, should_stop=should_stop) for each in near)


def _all_in_proportion(scene: Scene, path: str) -> bool:
    """Whether a path is that of a load which varies in proportion to it."""
    loads = [scene.contacts[i].load for i in loads_of(scene, path)]
    return bool(loads) and all(load is not None and load.in_proportion for load in loads)
