"""The tools that the service has for language models, by the Model Context Protocol over its REST API.

Few tools, each with what it takes and gives in words; whatever else the service can compute goes through
`study`, whose bodies `describe` explains. Answers hold figures and sentences: a long list is said by its
length, for it stays with the job.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from service.errors import InputError, ServiceError, ServiceProblem

if TYPE_CHECKING:
    from mcp.server import MCPServer

    from service.client.client import Client

WAIT_SECONDS = 60.0
_LONGEST = 12  # items of a list that is told whole

INSTRUCTIONS = """\
stickslip computes the periodic vibration of structures with dry friction, and designs friction dampers.
Begin with `scenes`, look at one with `scene`, see with `plan` which effects it calls for; then `sweep` gives
peak and resonance band, `solve` one frequency, `design` the best normal load or any other parameter.
All quantities are in SI units (m, N, kg, s), frequencies in Hz. Quote amplitudes with `error_estimate`.
An answer whose `converged`, `completed` or `reached` is false is no result: its `status` says why."""

Scene = Annotated[
    str | dict[str, Any], Field(description="Name of a scene, or its tables as `scene` gives them.")
]
Values = Annotated[
    dict[str, float] | None,
    Field(description='Parameters that differ from the scene, by path: {"damper.N0": 150.0}.'),
]
Harmonics = Annotated[int | None, Field(description="Highest harmonic kept; more is more exact and slower.")]
Job = Annotated[str, Field(description="Id of a job, as `job` of an answer.")]
Wait = Annotated[
    float, Field(description="Wait for the result so long [s]; then `explain` tells it.", ge=0.0)
]


class Tools:
    """What a model may ask of a service; each method is a tool."""

    def __init__(self, client: Client) -> None:
        self._client = client

    def scenes(self) -> dict[str, Any]:
        """List the scenes there are: shipped ones, which everybody has, and those that were stored."""
        listed = self._client.scenes()
        return {"scenes": [{"name": one.name, "shipped": one.shipped} for one in listed]}

    def scene(
        self, name: Annotated[str, Field(description="Name of a scene.")], set: Values = None
    ) -> dict[str, Any]:
        """Show a scene: its tables, and every parameter with unit, value and the range worth designing."""
        tables = self._client.scene(name).scene
        listed = self._client.scene_parameters(_body(scene=tables, set=set))["items"]
        shown = ("path", "symbol", "unit", "words", "value", "bounds")
        return {"scene": _brief(tables), "parameters": [{key: one[key] for key in shown} for one in listed]}

    def plan(self, scene: Scene, set: Values = None) -> dict[str, Any]:
        """Say which physical effects a scene calls for and why, and what a solution would cost."""
        told: dict[str, Any] = _brief(self._client.plan(_body(scene=scene, set=set)))
        return told

    def solve(
        self,
        scene: Scene,
        frequency_hz: Annotated[float, Field(description="Frequency of the excitation [Hz].")],
        set: Values = None,
        harmonics: Harmonics = None,
        wait: Wait = WAIT_SECONDS,
    ) -> dict[str, Any]:
        """Compute the periodic response at one frequency: amplitude, harmonics, states, stability."""
        asked = _body(scene=scene, frequency_hz=frequency_hz, set=set, harmonics=harmonics)
        return self._computed("solve", asked, wait)

    def sweep(
        self,
        scene: Scene,
        set: Values = None,
        parameter: Annotated[
            str | None, Field(description="Path of what is swept over; the frequency if left out.")
        ] = None,
        start: Annotated[float | None, Field(description="Where it begins; by the scene.")] = None,
        stop: Annotated[float | None, Field(description="Where it ends; by the scene.")] = None,
        frequency_hz: Annotated[
            float | None, Field(description="Frequency [Hz], where another parameter is swept over.")
        ] = None,
        harmonics: Harmonics = None,
        wait: Wait = WAIT_SECONDS,
    ) -> dict[str, Any]:
        """Follow the response over the frequency, or a parameter: peaks, resonance band, folds, stability."""
        asked = _body(
            scene=scene, set=set, parameter=parameter, start=start, stop=stop, frequency_hz=frequency_hz,
            harmonics=harmonics,
        )  # fmt: skip
        return self._computed("sweep", asked, wait)

    def design(
        self,
        scene: Scene,
        variables: Annotated[
            dict[str, list[float]] | None,
            Field(
                description='Parameters to choose, with bounds: {"damper.N0": [20, 3000]}; if left out, the '
                "mass of the first damper or the normal load of the contact whose load varies. "
                "`bounds` of `scene` proposes some."
            ),
        ] = None,
        set: Values = None,
        max_band_hz: Annotated[float | None, Field(description="Widest resonance band allowed [Hz].")] = None,
        max_peak: Annotated[float | None, Field(description="Largest amplitude allowed [m].")] = None,
        harmonics: Harmonics = None,
        more: Annotated[
            dict[str, Any] | None,
            Field(description='Further keys of the problem, as `describe("design")` explains them.'),
        ] = None,
        wait: Wait = WAIT_SECONDS,
    ) -> dict[str, Any]:
        """Find the damper with the lowest peak: values, peak, band, what holds it, and how sure it is."""
        asked = _body(
            scene=scene, variables=variables, set=set, max_band_hz=max_band_hz, max_peak=max_peak,
            harmonics=harmonics, more=more,
        )  # fmt: skip
        return self._computed("design", asked, wait)

    def describe(
        self,
        kind: Annotated[str | None, Field(description="A kind of study; if left out, all in a line each.")]
        = None,
    ) -> dict[str, Any]:  # fmt: skip
        """Say which studies there are (modes, disks, data of rigs, …), or what one takes as JSON Schema."""
        kinds = {one.name: one for one in self._client.kinds()}
        if kind is None:
            return {"kinds": {name: one.summary for name, one in kinds.items()}}
        if kind not in kinds:
            raise InputError(f"`kind` must be one of {', '.join(kinds)}, got {kind!r}")
        return {"kind": kind, "summary": kinds[kind].summary, "body": kinds[kind].body}

    def study(
        self,
        kind: Annotated[str, Field(description="A kind of study, as `describe` lists them.")],
        body: Annotated[dict[str, Any], Field(description="What it takes, as `describe(kind)` explains.")],
        wait: Wait = WAIT_SECONDS,
    ) -> dict[str, Any]:
        """Compute a study of any kind."""
        return self._computed(kind, body, wait)

    def explain(self, job: Job, wait: Wait = 0.0) -> dict[str, Any]:
        """Say how a job stands: its result in sentences and figures, or why there is none."""
        return self._standing(self._client.wait(job, timeout=wait).id if wait else job)

    def report(
        self,
        job: Job,
        file: Annotated[str, Field(description="A new file, ending in .pdf or .html.")],
    ) -> dict[str, Any]:
        """Write the report of a design or an identification, with pictures, to a file."""
        path = Path(file)
        forms: Mapping[str, Literal["pdf", "html"]] = {".pdf": "pdf", ".html": "html"}
        if path.suffix not in forms:
            raise InputError(f"`file` must end in .pdf or .html, got {file!r}")
        if path.exists():
            raise InputError(f"`file` must be new, and there is a {file!r}")
        data = self._client.job_report(job, forms[path.suffix])
        with path.open("xb") as opened:
            opened.write(data)
        return {"file": str(path.resolve()), "bytes": len(data)}

    def _computed(self, kind: str, body: Mapping[str, Any], wait: float) -> dict[str, Any]:
        return self._standing(self._client.submit({**body, "kind": kind}, wait=wait or None).id)

    def _standing(self, job: str) -> dict[str, Any]:
        """How a job stands, with its result where it has ended well."""
        found = self._client.job(job)
        told: dict[str, Any] = {"job": found.id, "kind": found.kind, "state": found.status.value}
        if found.status.value == "successful":
            told["result"] = _brief(self._client.results(job).result)
        elif found.error is not None:
            told["error"] = found.error
        else:
            told["progress"] = found.progress
        return told


def server(client: Client) -> MCPServer:
    """The server with all tools, which ask a service through a client."""
    from importlib.metadata import version

    from mcp.server import MCPServer

    made = MCPServer(
        "stickslip", instructions=INSTRUCTIONS, version=version("stickslip"), log_level="WARNING"
    )
    tools = Tools(client)
    for name, tool in vars(Tools).items():
        if not name.startswith("_"):
            made.add_tool(_refusing(tool.__get__(tools)))
    return made


def _refusing(tool: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """The tool; what the service refuses, or nobody can be asked, is said to the model, which may mend it."""
    from mcp.server.mcpserver.exceptions import ToolError

    @functools.wraps(tool)
    def asked(**given: Any) -> dict[str, Any]:
        try:
            return tool(**given)
        except (ServiceError, InputError) as error:
            raise ToolError(_said(error)) from error

    return asked


def _said(error: Exception) -> str:
    """What is wrong, with every field of a problem document that its first sentence leaves out."""
    fields: Any = error.problem.get("errors", ()) if isinstance(error, ServiceProblem) else ()
    further = [field["detail"] for field in fields if field["detail"] not in str(error)]
    return "; ".join([str(error), *further])


def _body(*, more: Mapping[str, Any] | None = None, **keys: Any) -> dict[str, Any]:
    """The keys that are given."""
    return {**{key: value for key, value in keys.items() if value is not None}, **(more or {})}


def _brief(told: Any) -> Any:
    """What is told, with long lists said by their length."""
    if isinstance(told, Mapping):
        return {key: _brief(value) for key, value in told.items()}
    if isinstance(told, list):
        return (
            [_brief(one) for one in told] if len(told) <= _LONGEST else f"a list of {len(told)}, with the job"
        )
    return told
