"""What people read of posteriors, model choices and populations, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from solver.results import units
from solver.results.told import Block, ResultTable, Summary

_HEADS = ("parameter", "mean", "± sd", "90 % interval")


def told(found: Mapping[str, Any]) -> Iterator[Block]:
    """That of the three which it is."""
    of = _population if "assemblies" in found else _model_choice if "models" in found else _posterior
    return of(found)


def _posterior(found: Mapping[str, Any]) -> Iterator[Block]:
    """Mean, deviation and interval of each unknown, and how the samples were got."""
    yield ResultTable(f"{found['scene']}, posterior", _HEADS, _rows(found["marginals"]))
    if found["sampler"]:
        worth = f"worth {_number(found['effective'], '.0f')} draws, {found['evaluations']} evaluations"
        yield Summary("", [("sampler", f"{found['sampler']}, {worth}"), ("ln evidence", _evidence(found))])
    if found["misfit"]:
        yield Summary("", [("warning", found["misfit"])])


def _population(found: Mapping[str, Any]) -> Iterator[Block]:
    """Medians over the assemblies, and the spread of what varies."""
    title = f"{found['scene']}, {len(found['assemblies'])} assemblies: medians"
    yield ResultTable(title, _HEADS, _rows(found["middles"]))
    yield ResultTable("spread over assemblies", _HEADS, _rows(found["spreads"]))


def _model_choice(found: Mapping[str, Any]) -> Iterator[Block]:
    """Probability and evidence of each model."""
    rows = []
    for one in found["models"]:
        of = one["posterior"]
        rows.append((
            one["name"], _number(one["probability"], ".3g"), _number(one["probability_error"], ".1g"),
            _evidence(of), "" if of["noise"] is None else f"{units.number(100.0 * of['noise'], 3)} %",
            "does not describe the data" if of["misfit"] else "",
        ))  # fmt: skip
    yield ResultTable("models", ("model", "probability", "± error", "ln evidence", "noise", ""), rows)


def _rows(marginals: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for one in marginals:
        if one["mean"] is None:
            rows.append((one["name"], "not told", "", ""))
            continue
        low, high = one["interval"]
        mean = units.quantity(one["mean"], one["unit"])
        rows.append(
            (one["name"], mean, units.number(one["sd"], 2), f"{units.number(low)} to {units.number(high)}")
        )
    return rows


def _evidence(found: Mapping[str, Any]) -> str:
    if found["log_evidence"] is None:
        return "not known"
    return f"{units.number(found['log_evidence'])} ± {_number(found['log_evidence_error'], '.2g')}"


def _number(value: float | None, form: str) -> str:
    return "not known" if value is None else format(value, form)
