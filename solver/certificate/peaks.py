"""Proofs of the peaks that a study found: of the least peak over a load, or of those at one value."""

from __future__ import annotations

from collections.abc import Sequence

from solver.certificate.certificate import Certificate, certify, check_certifiable, loads_of
from solver.response.solve import solve
from solver.scene.scene import Scene


def certified_peaks(
    scene: Scene, frequencies_hz: Sequence[float], *, least_over: str = "", harmonics: int = 11
) -> tuple[Certificate, ...]:
    """Prove the peaks of a scene beside frequencies.

    One alone that is least over a load is proved to be that: if all of the load varies with N0, and where the
    proof succeeds. Of equally high ones each is proved by itself, which does not say that the highest is
    least.

    Parameters
    ----------
    scene : with the values of the optimum.
    frequencies_hz : of its highest peaks [Hz].
    least_over : the path over which the highest is least, if it is within the range.
    harmonics : highest harmonic of the balance that the search begins with.

    Raises
    ------
    SettingError
        A scene that cannot be certified.
    MissingExtraError
        Without python-flint.
    """
    check_certifiable(scene)
    near = [solve(scene, frequency_hz=hertz, harmonics=harmonics) for hertz in frequencies_hz]
    varied = [scene.contacts[i].load for i in loads_of(scene, least_over)]
    if len(near) == 1 and varied and all(load is not None and load.in_proportion for load in varied):
        least = certify(near[0], least_over=least_over)
        if least.reached:
            return (least,)
        return least, certify(near[0], peak=True)
    return tuple(certify(each, peak=True) for each in near)
