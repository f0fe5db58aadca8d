"""`stickslip posterior`: what is known of parameters after measurements."""

from __future__ import annotations

from typing import Any

from service.cli.commands.design_commands import Columns, Data, Uncertain, computed, write_problem
from service.cli.options import inputs
from service.cli.study_command import Keys, Outputs, give
from stickslip.lab.posterior.study import PosteriorStudy


def _posterior(
    name: str, data: list[str], column: list[str] | None, values: list[str] | None,
    without: list[str] | None, plot: str | None, out: str | None, uncertain: str | None, as_json: bool,
    **given: Any,
) -> None:  # fmt: skip
    outputs = Outputs.asked(plot, out)
    problem = inputs.output_path("--uncertain", uncertain, (".toml",))
    scene = inputs.scene(name, values, without)
    answer = computed(_OF_POSTERIOR, scene, {"data": data, **_OF_POSTERIOR.read(given, scene)}, column)
    kept = getattr(answer.result, "uncertain", None)
    if problem is not None and kept:
        write_problem(problem, name, inputs.settings(values), kept)
    give(PosteriorStudy, answer, outputs, scene, as_json=as_json)


_OF_POSTERIOR = Keys.of(PosteriorStudy, "data")
posterior = _OF_POSTERIOR.command(
    _posterior, {"data": Data}, {"column": Columns, "uncertain": Uncertain}, doc=PosteriorStudy.__doc__
)
