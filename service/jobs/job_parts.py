"""Jobs that are divided into parts, which need nothing of each other.

A kind of job whose work can be divided has a `Division` beside its `run`. What the parts are depends on the
spec alone, never on how many workers there are: every executor computes the same parts through the same
function and joins them through the same function, so that the result is the same bit for bit, wherever and
in whatever order they were computed. What a part gives back is JSON and arrays, so that it can be kept as a
checkpoint; a part that is known already is not computed again. The worker of the job computes its parts, and
gives some of them to others that have nothing to do (`solver.results.spread`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from service.jobs.outputs import JobOutput, OnProgress, ShouldStop
from service.jobs.stored_figures import StoredArray
from solver.results.spread import in_turn, spreader


@dataclass(frozen=True, slots=True, kw_only=True)
class JobPart:
    """A part of a job; about 0.1 s of work or more, so that sending it somewhere is worth it.

    Attributes
    ----------
    spec : JSON; with the spec of the job, all that is needed to compute it.
    weight : its share of the work, relative to the other parts.
    """

    spec: dict[str, Any]
    weight: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PartOutput:
    """What a part gives back.

    Attributes
    ----------
    result : JSON with finite numbers; what may be NaN is an array.
    arrays : arrays by name, as they are stored.
    points : what it adds to the points of the job's progress.
    final : the result of the job needs this part alone: the others are left out.
    """

    result: dict[str, Any]
    arrays: Mapping[str, StoredArray] = field(default_factory=dict)
    points: int = 0
    final: bool = False


class PartStoppedError(Exception):
    """A part was told to stop: there is no output."""


PART_SECONDS = 0.1
"""What a part takes at least, about [s]."""

Split = Callable[[Mapping[str, Any]], Sequence[JobPart]]
RunPart = Callable[[Mapping[str, Any], Mapping[str, Any], OnProgress, ShouldStop], PartOutput]
Join = Callable[[Mapping[str, Any], Mapping[int, PartOutput]], JobOutput]
OnPart = Callable[[int, PartOutput], None]


def _not_kept(_index: int, _output: PartOutput) -> None:
    """For callers that keep no parts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Division:
    """How a kind of job is divided. All three are functions at the top level of a module, sent by name.

    Attributes
    ----------
    split : from spec to parts; the same ones for the same spec. A part is known by its place in them.
    run_part : from spec, the spec of a part, progress (share and points of the part) and should_stop to
        output. Raises PartStoppedError when it was told to stop, SolverError for what is wrong for good.
    join : from spec and the outputs by their place, all of them or a final one alone, to the job's output.
    """

    split: Split
    run_part: RunPart
    join: Join

    def run(
        self, spec: Mapping[str, Any], progress: OnProgress, should_stop: ShouldStop,
        known: Mapping[int, PartOutput] | None = None, on_part: OnPart = _not_kept,
    ) -> JobOutput:  # fmt: skip
        """Compute the parts, here and by who helps, and join them: the `run` of the kind.

        PartStoppedError if it was told to stop.

        Parameters
        ----------
        known : outputs of earlier attempts by their place, which are not computed again.
        on_part : called with the place and the output of every part computed.
        """
        parts = self.split(spec)
        outputs = dict(known or {})
        account = Account(parts, outputs, progress)
        left = [index for index in range(len(parts)) if index not in outputs]

        def here(number: int) -> PartOutput:
            index = left[number]
            return self.run_part(spec, parts[index].spec, account.of(index), should_stop)

        def done(number: int, output: PartOutput) -> bool:
            index = left[number]
            outputs[index] = output
            account.done(index, output)
            on_part(index, output)
            return output.final

        if not final_one(outputs):
            calls = [(parts[index].spec,) for index in left]
            spread = spreader() or in_turn
            spread(
                partial(run_apart, self.run_part, spec), calls, done, should_stop=should_stop, here=here,
                seconds=PART_SECONDS,
            )  # fmt: skip
        if len(outputs) < len(parts) and not final_one(outputs):
            raise PartStoppedError
        return self.joined(spec, outputs)

    def joined(self, spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
        """The output of the job from those of all parts, or from a final one."""
        return self.join(spec, final_one(outputs) or dict(sorted(outputs.items())))


def run_apart(
    run_part: RunPart, spec: Mapping[str, Any], part: Mapping[str, Any], *, should_stop: ShouldStop
) -> PartOutput:
    """Compute a part of another worker's job, whose progress is told when it is done."""
    return run_part(spec, part, lambda _share, _points: None, should_stop)


def final_one(outputs: Mapping[int, PartOutput]) -> dict[int, PartOutput]:
    """The first output that makes the others superfluous, by its place; empty if there is none."""
    return next(({index: output} for index, output in sorted(outputs.items()) if output.final), {})


class Account:
    """How far a job is from how far its parts are.

    Parameters
    ----------
    parts : all of them.
    outputs : of those that are known already.
    progress : told of the job's share and points.
    """

    def __init__(
        self, parts: Sequence[JobPart], outputs: Mapping[int, PartOutput], progress: OnProgress
    ) -> None:
        total = sum(part.weight for part in parts)
        self._weights = [part.weight / total for part in parts]
        self._shares = [0.0] * len(parts)
        self._points = [0] * len(parts)
        self._progress = progress
        for index, output in outputs.items():
            self._shares[index], self._points[index] = 1.0, output.points

    def of(self, index: int) -> OnProgress:
        """The `progress` of one part."""

        def progress(share: float, points: int) -> None:
            self._shares[index] = min(max(share, self._shares[index]), 1.0)
            self._points[index] = max(points, self._points[index])
            self._tell()

        return progress

    def done(self, index: int, output: PartOutput) -> None:
        """A part is known."""
        self._shares[index], self._points[index] = 1.0, output.points
        self._tell()

    def _tell(self) -> None:
        share = sum(w * s for w, s in zip(self._weights, self._shares, strict=True))
        self._progress(min(share, 1.0), sum(self._points))
