"""What a design is judged by, as rows: one number with its gradient each, minimised, limited, or both.

Every peak that competes is a row of its own, and so is every band, every local maximum of friction work:
each is smooth, only the largest of them is not. That is what the methods of this package work on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

from optim.criteria.criterion import Criterion, CriterionRow
from optim.criteria.peak_criterion import BAND, PEAK
from solver.continuation.branch import Branch
from solver.results.known import MEAN_STRESS_OPEN
from solver.results.told import json_number

if TYPE_CHECKING:
    from solver.results.known import Known


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResponse:
    """A frequency response of a design: its case and the branch, and whether it served something else first.

    What was followed for another case, or by another measure, is not computed again.
    """

    case: str
    branch: Branch
    shared: bool = False

    def whole(self, limit: float | None) -> CaseResponse:
        """Return it looked at wholly, if it was not; its band is above `limit` [m]."""
        from solver.continuation.branches.observation import observing
        from solver.continuation.branches.sweep import with_error

        branch, seen = self.branch, self.branch.scene.observe
        if self.shared or math.isfinite(branch.error_estimate) or not branch.peaks:
            return replace(self, branch=with_error(branch))
        found = observing(branch, seen.dof, measure=seen.measure, limit=limit)
        spent = branch.newton_iterations + found.newton_iterations
        return replace(self, branch=replace(found, newton_iterations=spent))


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignEvaluation:
    """One design with everything it is judged by."""

    values: Annotated[Mapping[str, float], "Variable name to value."]
    responses: Annotated[
        tuple[CaseResponse, ...], "The frequency responses behind the numbers, in the order of the cases."
    ]
    rows: Annotated[tuple[CriterionRow, ...], "Empty unless every response covered its whole range."]

    @property
    def good(self) -> bool:
        """Whether every number is known."""
        return bool(self.rows) and all(math.isfinite(row.value) for row in self.rows)

    @property
    def open(self) -> bool:
        """Whether a row may be worse than it says."""
        return any(MEAN_STRESS_OPEN in row.flags for row in self.rows)

    def of(self, quantity: Criterion) -> tuple[CriterionRow, ...]:
        """Return the rows of one quantity, largest first."""
        return tuple(sorted((r for r in self.rows if r.quantity is quantity), key=lambda row: -row.value))

    def highest(self, within: float) -> list[CriterionRow]:
        """Return, of every quantity that is minimised, the rows as high as its highest but for a share."""
        found: list[CriterionRow] = []
        for quantity in dict.fromkeys(row.quantity for row in self.rows):
            rows = [row for row in self.of(quantity) if row.weight > 0.0]
            top = max((row.weight * row.value for row in rows), default=0.0)
            found += [row for row in rows if row.weight * row.value >= top * (1.0 - within)]
        return found

    @property
    def peaks(self) -> tuple[CriterionRow, ...]:
        """The peaks that compete, highest first."""
        return self.of(PEAK)

    @property
    def band(self) -> CriterionRow | None:
        """The widest resonance band."""
        return next(iter(self.of(BAND)), None)

    @property
    def objective(self) -> float:
        """What is minimised, as a search counts it: for each quantity the largest weighted row, summed."""
        return self._summed(lambda row: row.value)

    @property
    def objective_told(self) -> float:
        """The same as results say it: inf where there is no end to it."""
        return self._summed(lambda row: row.told)

    def _summed(self, of: Callable[[CriterionRow], float]) -> float:
        total = 0.0
        for quantity in dict.fromkeys(row.quantity for row in self.rows):
            weighted = [row.weight * of(row) for row in self.of(quantity) if row.weight > 0.0]
            total += max(weighted, default=0.0)
        return total if self.rows else math.inf

    @property
    def harmonics(self) -> int:
        """Of the balances behind it; 0 without a response."""
        return max((one.branch.balance.n_harmonics for one in self.responses), default=0)

    @property
    def computed(self) -> int:
        """How many responses were computed for it."""
        return sum(not one.shared for one in self.responses)

    @property
    def branch(self) -> Branch:
        """The response of the first case."""
        return self.responses[0].branch

    @property
    def over_bands(self) -> dict[str, Branch]:
        """Of each case the response over its band, which is its first."""
        first: dict[str, Branch] = {}
        for response in self.responses:
            first.setdefault(response.case, response.branch)
        return first

    @property
    def known_parts(self) -> list[tuple[str, Known]]:
        """The name of each case with how well the peak of its response over its band is known."""
        return [(case, branch.known) for case, branch in self.over_bands.items() if branch.peak is not None]

    def with_errors(self, limit: float | None = None) -> DesignEvaluation:
        """Return it with low peaks, bands above `limit` [m] and errors, where a search left these out."""
        return replace(self, responses=tuple(one.whole(limit) for one in self.responses))

    def violation(self, scales: Mapping[Criterion, float]) -> float:
        """Return the largest relative excess over a bound; −inf without bounds."""
        return max((row.excess(scales[row.quantity]) for row in self.rows), default=math.inf)

    def to_json(self) -> dict[str, object]:
        """Return its rows, its peaks, its bands, and how well each is known."""
        bands = {case: branch.band for case, branch in self.over_bands.items()}
        return {
            "peaks": [{"value": peak.value, "at": peak.at_hz, "case": peak.case} for peak in self.peaks],
            "bands": [
                {
                    "case": case, "limit": band.limit, "width_hz": band.width,
                    "intervals_hz": [list(interval) for interval in band.intervals],
                }
                for case, band in bands.items()
                if band is not None
            ],
            "objective": json_number(self.objective_told) if self.rows else None,
            "rows": [row.to_json() for row in self.rows],
            "errors": [
                {"case": case, "peak": known.value, **known.to_json()} for case, known in self.known_parts
            ],
        }  # fmt: skip


def nearest(row: CriterionRow, rows: Sequence[CriterionRow]) -> int | None:
    """Return which of some rows of another design measures the same: quantity, case, part, frequency."""
    same = [i for i, r in enumerate(rows) if (r.quantity, r.case) == (row.quantity, row.case)]
    same = [i for i in same if math.isnan(row.at_hz) == math.isnan(rows[i].at_hz)]
    if math.isnan(row.at_hz):
        return next((i for i in same if rows[i].what == row.what), same[0] if same else None)
    # Of several contacts or recovered rows at one frequency it is the one of that name.
    of = row.what.partition(" at ")[0]
    named = [i for i in same if rows[i].what.partition(" at ")[0] == of]
    return min(named or same, key=lambda i: abs(rows[i].at_hz - row.at_hz), default=None)
