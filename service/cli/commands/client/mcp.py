"""The command that lets language models use a running service."""

from __future__ import annotations

from service.cli.commands.client.jobs import client_of
from service.cli.options import shared as options
from solver.errors import MissingExtraError


def mcp(url: options.Url = options.DEFAULT_URL) -> None:
    """Let a language model use a running service.

    Reads requests of the Model Context Protocol from standard input and answers on standard output, as
    programs with a model in them expect; ends with its input.
    """
    from service.client.mcp_tools import server

    with client_of(url) as client:
        try:
            tools = server(client)
        except ModuleNotFoundError as error:
            raise MissingExtraError("mcp", "mcp") from error
        tools.run("stdio")
