"""`stickslip mcp`: a service as tools of a language model."""

from __future__ import annotations

from service.client import Client
from solver.errors import MissingExtraError


def mcp(client: Client) -> None:
    """Let a language model use a running service.

    Reads requests of the Model Context Protocol from standard input and answers on standard output, as
    programs with a model in them expect; ends with its input.
    """
    from stickslip.lab.mcp.mcp_tools import server

    try:
        tools = server(client)
    except ModuleNotFoundError as error:
        raise MissingExtraError("mcp", "mcp") from error
    tools.run("stdio")
