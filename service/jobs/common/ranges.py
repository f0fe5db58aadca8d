"""What the kinds share that look at the frequency response over the range of a parameter."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field

from service.jobs.common.scenes import HarmonicRequest, Number, ParameterPath, check
from service.jobs.registry import Flag
from solver.errors import Issue, Naming, Shown
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene

FREQUENCY = "frequency"


class RangeRequest(HarmonicRequest):
    """A range of a parameter; the frequency is looked at over the scene's band."""

    model_config = ConfigDict(validate_by_alias=True)

    parameter: Annotated[ParameterPath, Flag(metavar="PATH")] = Field(
        description=f"Path of what changes, for example {DISK_LOAD}."
    )
    start: Annotated[Number, Flag(metavar="A")] = Field(alias="from", description="Start of the range.")
    stop: Annotated[Number, Flag(metavar="B")] = Field(alias="to", description="End of the range.")


def range_issues(request: RangeRequest, scene: Scene) -> list[Issue]:
    """Everything wrong with the range for the scene."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from solver.continuation.parameter_scale import scale_of

    path = request.parameter
    unknown = check(partial(scene.check_path, path), "parameter")
    if unknown:
        return unknown
    if path == FREQUENCY:
        return [Issue(("parameter",), "cannot be the frequency: all of the band is looked at")]
    issues: list[Issue] = []
    for key, value in (("from", request.start), ("to", request.stop)):
        issues += check(partial(scene.with_values, {path: value}), key)
    if request.start == request.stop:
        issues.append(Issue(("to",), Naming("must differ from {from}"), Shown(f"{request.stop!r} for both")))
    return issues or check(partial(scale_of, scene, path, request.start, request.stop), "parameter")


def band_issues(scene: Scene, start: float | None, stop: float | None) -> list[Issue]:
    """Refuse frequencies [Hz], the scene's band where left out, of which the last is not above the first."""
    low, high = (
        end if given is None else given for end, given in zip(scene.observe.band, (start, stop), strict=True)
    )
    return [] if low < high else [Issue(("to",), Naming(f"must be above {{from}} = {low!r} Hz"), high)]


def law_issues(key: str, scene: Scene) -> list[Issue]:
    """Refuse contacts whose peaks cannot be tracked, as what is wrong with `key`."""
    from solver.studies.peaks.tracker import check_laws

    found = check(partial(check_laws, scene))
    return [Issue((key,), issue.message, named=False) for issue in found]
