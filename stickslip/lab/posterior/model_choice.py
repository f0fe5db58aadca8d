"""Which of several models the data speak for: `compare_models`, by the evidence of each.

p(model | data) ∝ p(model) p(data | model): the evidence is an average of the likelihood over what the
unknowns may be, so a model with more of them has to explain more (D. J. C. MacKay, Neural Comput. 4 (1992)
415).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np
from scipy.special import logsumexp

from optim.problem.checks import DesignError
from stickslip.lab.posterior.posterior import posterior
from stickslip.lab.posterior.posterior_result import Posterior
from stickslip.lab.posterior.sampling import SAMPLING, Sampling
from optim.identification.reading import Given
from optim.problem.checks import is_number
from solver.arrays import FloatOrNaN
from solver.results.base import Drawn
from solver.results.told import Piece
from solver.results.base import Data, Views
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.scene import Scene

_DRAWN = 4000  # of the evidences, for the errors of probabilities


class ChoiceStatus(Enum):
    """How a comparison ended; the value is a sentence a user can act on."""

    COMPARED = "The evidence of every model is known."
    NONE_DESCRIBES = "The evidence is known, but even the best of the models does not describe the data."
    UNKNOWN = (
        "The evidence of a model is not known, so no probabilities are given: see its status; more draws or "
        "narrower bounds may help, or leave it out."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ModelEvidence(Piece):
    """One model."""

    JSON: ClassVar = "name probability probability_error posterior"

    name: Annotated[str, "As it was given."]
    probability: Annotated[FloatOrNaN, "Of the models compared; NaN where an evidence is not known."]
    probability_error: Annotated[FloatOrNaN, "Its standard error, from those of all evidences."]
    posterior: Annotated[Posterior, "What is known of its unknowns."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ModelChoice(Drawn):
    """Models, the most probable first."""

    VIEWS: ClassVar = Views("stickslip.lab.posterior", "tables:told", "pictures:drawn")
    DATA: ClassVar = Data(
        "model-choice", {"model=models": "model=name probability probability_error"
        " log_evidence=posterior.log_evidence log_evidence_error=posterior.log_evidence_error"},
        scene="",
    )  # fmt: skip
    JSON: ClassVar = "reached status models"

    status: Annotated[ChoiceStatus, "How it ended."]
    models: Annotated[tuple[ModelEvidence, ...], "The most probable first; as given without probabilities."]

    @property
    def best(self) -> ModelEvidence | None:
        """The most probable model; None without probabilities."""
        return None if self.status is ChoiceStatus.UNKNOWN else self.models[0]


@shows_progress("models")
def compare_models(
    models: Mapping[str, tuple[Scene, Mapping[str, Sequence[float]]]],
    data: Sequence[Given],
    *,
    weights: Mapping[str, float] | None = None,
    sampling: Sampling = SAMPLING,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> ModelChoice:
    """Compare models of what was measured by their evidence.

    Parameters
    ----------
    models : name to (scene, unknowns within bounds): such as Coulomb, Iwan and a contact in space.
    data, sampling : as of `posterior`; the same for every model.
    weights : how probable each model is before the data, relative to the others; equal if left out.
    on_progress, should_stop : as of `identify`.

    Raises
    ------
    DataError, DesignError, SettingError
        As `posterior`; fewer than two models, or weights that are not one above 0 for each.
    """
    if not isinstance(models, Mapping) or len(models) < 2:
        raise DesignError("models", models, "must be a table of at least two names to (scene, unknowns)")
    before = dict.fromkeys(models, 1.0) if weights is None else dict(weights)
    good = set(before) == set(models) and all(is_number(one) and one > 0.0 for one in before.values())
    if not good:
        raise DesignError("weights", weights, f"must be a number > 0 for each of {', '.join(models)}")
    found: dict[str, Posterior] = {}
    for i, (name, (scene, unknowns)) in enumerate(models.items()):
        progress = part_of(on_progress, i / len(models), (i + 1) / len(models), i)
        found[name] = posterior(
            scene, data, unknowns, sampling=sampling, on_progress=progress, should_stop=should_stop
        )
    return _chosen(found, before, sampling.seed)


def _chosen(found: Mapping[str, Posterior], before: Mapping[str, float], seed: int) -> ModelChoice:
    """Return the probabilities of evidences."""
    logs = np.array([one.log_evidence + math.log(before[name]) for name, one in found.items()])
    errors = np.array([one.log_evidence_error for one in found.values()])
    shares = np.exp(logs - logsumexp(logs))
    drawn = logs + errors * np.random.default_rng(seed).normal(size=(_DRAWN, logs.size))
    spread = np.exp(drawn - logsumexp(drawn, axis=1, keepdims=True)).std(axis=0)
    rows = [
        ModelEvidence(name=name, probability=float(p), probability_error=float(e), posterior=one)
        for (name, one), p, e in zip(found.items(), shares, spread, strict=True)
    ]
    if not np.isfinite(logs).all():
        return ModelChoice(status=ChoiceStatus.UNKNOWN, models=tuple(rows))
    rows.sort(key=lambda one: -one.probability)
    doubtful = bool(rows[0].posterior.misfit)
    status = ChoiceStatus.NONE_DESCRIBES if doubtful else ChoiceStatus.COMPARED
    return ModelChoice(status=status, models=tuple(rows))
