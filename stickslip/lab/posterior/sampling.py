"""How posteriors are sampled, the same for one model, for several and for reassemblies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.problem.checks import DesignError
from optim.identification.fit import STARTS
from optim.identification.identify import check_fit
from optim.problem.checks import is_number
from solver.wording import documented

SAMPLERS = ("auto", "importance", "nuts")
_FEWEST, _MOST = 100, 100_000


@documented
@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """How a posterior is sampled; DesignError or SettingError where something cannot be."""

    noise: Annotated[float | None, "Relative noise, as of `identify`; integrated out if None."] = None
    harmonics: Annotated[int, "Highest harmonic of the balance."] = 11
    starts: Annotated[int, "Places within the bounds that are tried for the fit it begins with."] = STARTS
    seed: Annotated[int, "Of those places and of the draws."] = 0
    draws: Annotated[
        int, "Samples; as many evaluations of all runs by importance, several times as many by NUTS."
    ] = 600
    sampler: Annotated[
        str,
        "``importance``, adaptive importance sampling from the optimum; ``nuts``, four chains of the "
        "no-U-turn sampler; ``auto``, the latter where the diagnosis of the former fails.",
    ] = "auto"

    def __post_init__(self) -> None:
        check_fit(self.noise, self.starts, self.seed, self.harmonics)
        whole = isinstance(self.draws, (int, np.integer)) and is_number(self.draws)
        if not whole or not _FEWEST <= self.draws <= _MOST:
            raise DesignError("draws", self.draws, f"must be a whole number from {_FEWEST} to {_MOST}")
        if self.sampler not in SAMPLERS:
            raise DesignError("sampler", self.sampler, f"must be one of {', '.join(SAMPLERS)}")


SAMPLING = Sampling()
