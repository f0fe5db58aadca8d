"""What measurements tell: results of an identification, posteriors, model choice, reassemblies."""

from optim import (
    ChoiceStatus as ChoiceStatus,
    Identification as Identification,
    IdentifyStatus as IdentifyStatus,
    Marginal as Marginal,
    ModelChoice as ModelChoice,
    ModelEvidence as ModelEvidence,
    Population as Population,
    Posterior as Posterior,
    PosteriorStatus as PosteriorStatus,
    ReassemblyStatus as ReassemblyStatus,
    Sampling as Sampling,
    compare_models as compare_models,
    posterior as posterior,
    reassemblies as reassemblies,
)
