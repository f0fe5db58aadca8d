"""The tools for language models, asked by their protocol of a process, as programs with a model ask them."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from service_helpers import ServedClient

import solver

if TYPE_CHECKING:
    from mcp import Client

Ask = Callable[..., Awaitable[dict[str, Any]]]


def asked(service: ServedClient, conversation: Callable[[Client, Ask], Awaitable[None]]) -> None:
    """Hold a conversation with `stickslip mcp` in front of a service."""
    from mcp import Client, StdioServerParameters  # a second for every process that collects tests

    command = StdioServerParameters(
        command=str(Path(sys.executable).parent / "stickslip"), args=["mcp", "--url", str(service.base_url)],
        env=dict(os.environ),
    )  # fmt: skip

    async def hold() -> None:
        async with Client(command) as model:

            async def ask(tool: str, **given: Any) -> dict[str, Any]:
                answer = await model.call_tool(tool, given)
                assert not answer.is_error, answer.content
                assert isinstance(answer.structured_content, dict)
                return answer.structured_content

            await conversation(model, ask)

    asyncio.run(hold())


async def refused(model: Client, tool: str, **given: Any) -> str:
    answer = await model.call_tool(tool, given)
    assert answer.is_error
    text: str = answer.content[0].text
    return text


def test_a_model_finds_a_scene_computes_and_designs(shipped: ServedClient, tmp_path: Path) -> None:
    async def conversation(model: Client, ask: Ask) -> None:
        listed = await model.list_tools()
        assert [tool.name for tool in listed.tools] == [
            "scenes", "scene", "plan", "solve", "sweep", "design", "describe", "study", "explain", "report",
        ]  # fmt: skip
        for tool in listed.tools:
            assert tool.description
            assert all("description" in one for one in tool.input_schema["properties"].values()), tool.name
        assert {"name": "two-dof", "shipped": True} in (await ask("scenes"))["scenes"]
        shown = await ask("scene", name="two-dof", set={"damper.N0": 120.0})
        load = next(one for one in shown["parameters"] if one["path"] == "damper.N0")
        assert (load["value"], load["unit"]) == (120.0, "N")
        assert "condensation" in str((await ask("plan", scene="two-dof"))["effects"])

        scene = solver.load_scene("two-dof")
        solved = await ask("solve", scene="two-dof", frequency_hz=1.05)
        found = solver.solve(scene, frequency_hz=1.05)
        assert solved["result"]["max_abs"] == pytest.approx(found.max_abs, rel=1e-9)
        branch = solver.sweep(scene.with_values({"damper.N0": 150.0}), harmonics=5)
        swept = await ask("sweep", scene=shown["scene"], set={"damper.N0": 150.0}, harmonics=5)
        assert swept["result"]["peak"]["value"] == pytest.approx(branch.peak.value, rel=1e-9)
        assert "a list of" in swept["result"]["amplitude"]

        design = await ask(
            "design", scene="two-dof", variables={"damper.N0": [20.0, 900.0]}, more={"basins": 1}
        )
        assert design["result"]["reached"]
        assert 20.0 < design["result"]["optimum"]["damper.N0"] < 900.0
        assert (await ask("explain", job=design["job"]))["result"] == design["result"]
        report = await ask("report", job=design["job"], file=str(tmp_path / "damper.html"))
        assert (tmp_path / "damper.html").stat().st_size == report["bytes"]
        assert "there is" in await refused(model, "report", job=design["job"], file=report["file"])
        assert "campbell" in (await ask("describe"))["kinds"]
        assert "frequency_hz" in (await ask("describe", kind="solve"))["body"]["properties"]
        studied = await ask("study", kind="sensitivities", body={"scene": "two-dof", "harmonics": 3})
        assert studied["state"] == "successful"

    asked(shipped, conversation)


@pytest.mark.long
def test_what_is_wrong_is_said_so_that_a_model_can_mend_it(shipped: ServedClient) -> None:
    async def conversation(model: Client, ask: Ask) -> None:
        assert "two-dog" in await refused(model, "plan", scene="two-dog")
        assert "damper.N9" in await refused(model, "sweep", scene="two-dof", set={"damper.N9": 1.0})
        assert "frequency_hz" in await refused(model, "solve", scene="two-dof")
        assert ".pdf or .html" in await refused(model, "report", job="x", file="damper.txt")
        assert "campbell" in await refused(model, "describe", kind="cambell")
        assert await refused(model, "explain", job="nothing")
        later = await ask(
            "study", kind="mistuning", body={"scene": "bladed-disk", "of": "tip_middle"}, wait=0.0
        )
        assert later["state"] in ("accepted", "running")

    asked(shipped, conversation)
