"""What studies share that solve the balance, look at the range of a parameter, or prove what they find."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict, Field

from optim.criteria.key import Share
from service.jobs.common.result_models import Table
from service.jobs.common.scene_requests import HarmonicRequest, Number, ParameterPath, check
from service.jobs.common.sizes import balance_issues
from service.jobs.kind_registry import Flag
from service.jobs.study import Answer, Proposed, Study, Watch, rounded
from solver.errors import Issue, Naming, Shown
from solver.lab import from_lab
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene

AUTO = "auto"
WORDS = (AUTO, "all", "even-harmonics", "every-contact", "every-port", "every-sector", "whole-matrices")
EffectsWord = Annotated[
    str,
    Field(
        max_length=200,
        description=f"What to pay for though the scene does not call for it: {', '.join(WORDS[2:])}.",
    ),
    Flag(metavar="auto|all|NAME,…", words=WORDS),
]
Accuracy = Annotated[
    Share | None,
    Field(description="Estimated error relative to the amplitude; chooses the harmonics itself."),
    Flag(metavar="E"),
]
_FIRST_TRIES = 23  # harmonics; with more unknowns than a few nobody adds any to reach an accuracy


def effects_issues(effects: str) -> list[Issue]:
    """Return what is wrong with the word of effects."""
    from solver.balance.simplifications import Effects

    return check(partial(Effects.read, effects), "effects")


def with_effects(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the effects that their word stands for."""
    from solver.balance.simplifications import Effects

    return {**asked, "effects": Effects.read(asked.get("effects", AUTO))}


def solved_issues(
    key: str, scene: Scene, harmonics: int, effects: str, *, accuracy: float | None = None, points: int = 1
) -> list[Issue]:
    """Refuse responses whose balance is too large, or too many of them, as `balance_issues`."""
    every_sector = with_effects({"effects": effects})["effects"].every_sector
    highest = harmonics if accuracy is None else max(harmonics, _FIRST_TRIES)
    return balance_issues(key, scene, highest, points, every_sector=every_sector)


FREQUENCY = "frequency"
NOTHING_DESIGNED = "The scene has no contact to design."
_HEAVY = 1.5  # times its own mass a damper stays in its seat


class RangeRequest(Study, HarmonicRequest):
    """A range of a parameter; the frequency is looked at over the scene's band."""

    model_config = ConfigDict(validate_by_alias=True)

    parameter: Annotated[ParameterPath, Flag(metavar="PATH")] = Field(
        description=f"Path of what changes, for example {DISK_LOAD}."
    )
    start: Annotated[Number, Flag(metavar="A")] = Field(alias="from", description="Start of the range.")
    stop: Annotated[Number, Flag(metavar="B")] = Field(alias="to", description="End of the range.")

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Return the range of what is designed by itself."""
        from service.jobs.common.scene_parameters import designed

        for path, (low, high) in designed(scene).items():
            return Proposed({"parameter": path, "from": low, "to": high})
        return NOTHING_DESIGNED


def heavy(scene: Scene, path: str) -> float | None:
    """Return the mass from which a damper stays in its seat; None where `path` is no mass of one.

    Lighter ones lift off: then a point takes a second or is not found, and peaks fold.
    """
    return rounded(_HEAVY * scene.value(path)) if path.endswith(".mass") else None


def range_issues(request: RangeRequest, scene: Scene) -> list[Issue]:
    """Everything wrong with the range for the scene."""
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

    return of_keys(check(partial(check_laws, scene)), (), key)


def of_keys(issues: list[Issue], keys: Collection[str], other: str = "scene") -> list[Issue]:
    """Return what is wrong with keys of a request as it is; all else as what is wrong with `other`."""
    return [
        one if keys and one.subject[0] in keys else Issue((other,), one.message, named=False)
        for one in issues
    ]


Certify = Annotated[
    bool, Field(strict=True, description="Prove the peaks found, where contacts are piecewise linear.")
]
CERTIFICATES: Any = (
    list[Table] | None,
    Field(None, description="Of `certify`: whether each is proved, in which bounds, and the proofs."),
)


def prepare(scene: Scene, *, rigid: bool = True) -> None:
    """Refuse what cannot be proved before anything is computed; `rigid`: friction may be."""
    from_lab("proofs.certificate:check_certifiable")(scene, rigid=rigid)


def with_proofs(
    answer: Answer, peaks: Sequence[tuple[Scene, float]], least_over: str, watch: Watch
) -> Answer:
    """Return an answer with proofs of peaks; it falls short if one is not proved.

    Arguments as of `stickslip.lab.proofs.certificate.certified_peaks`.
    """
    certified_peaks = from_lab("proofs.certificate:certified_peaks")
    return with_certificates(
        answer, certified_peaks(peaks, least_over=least_over, should_stop=watch.should_stop)
    )


def with_certificates(answer: Answer, found: Sequence[Any]) -> Answer:
    """Return an answer with certificates; it falls short if one is not reached."""
    missing = [each.status.value for each in found if not each.reached]
    return answer._replace(
        json=answer.json | {"certificates": [each.to_json() for each in found]},
        reached=answer.reached and not missing, status=missing[0] if missing else answer.status,
    )  # fmt: skip
