"""The table of the keys of a design problem in docs/design.md."""

from __future__ import annotations

from pydantic.fields import FieldInfo

from optim.criteria.key import Option
from optim.criteria.registry import limit_keys
from optim.problem.keys import CaseRequest, options
from service.jobs.common.problem import ABOUT_THE_JOB
from service.jobs.kinds.design import DesignRequest
from service.jobs.kinds.pareto import ParetoRequest

_WRITTEN = {"scene": "`SCENE`", "set": "`--set PATH=VALUE`"}


def problem_table() -> str:
    """Every key but those that limit a criterion, as a table of Markdown."""
    fields = {**DesignRequest.model_fields, **ParetoRequest.model_fields}
    keys = options(DesignRequest) | options(ParetoRequest)
    apart = {*ABOUT_THE_JOB, *(key.name for key in limit_keys())}
    rows = ["| key | meaning | option of the command |", "|---|---|---|"]
    rows += [
        f"| `{name}` | {_meaning(name, field)} | {_WRITTEN.get(name) or _option(keys.get(name))} |"
        for name, field in fields.items()
        if name not in apart
    ]
    return "\n".join(rows) + "\n"


def _meaning(name: str, field: FieldInfo) -> str:
    if name != "cases":
        return str(field.description)
    cases = (f"`{key}`: {one.description}" for key, one in CaseRequest.model_fields.items())
    return f"{field.description} A list of tables with any of<br>{'<br>'.join(cases)}"


def _option(option: Option | None) -> str:
    return "" if option is None else f"`{option.flag} {option.metavar}`".replace("|", "\\|")
