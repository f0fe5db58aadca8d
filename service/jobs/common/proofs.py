"""What studies of peaks have in common that prove what they find: the key, the result, the proofs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import Table
from service.jobs.study import Answer, Watch
from solver.lab import from_lab

if TYPE_CHECKING:
    from solver.scene.scene import Scene

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

    Arguments as of `stickslip.lab.proofs.certified_peaks.certified_peaks`.
    """
    certified_peaks = from_lab("proofs.certified_peaks:certified_peaks")
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
