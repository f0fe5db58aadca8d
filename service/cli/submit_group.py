"""The group `submit` of the command, which knows the kinds of job when it is asked for one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand, TyperGroup

if TYPE_CHECKING:
    from service.jobs.registry import Registry


class SubmitGroup(TyperGroup):
    """The group `submit`: a command for every kind of job there is, made when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of the kinds."""
        self._fill()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Name and summary of a kind; None if there is none of this name."""
        self._fill()
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx: Any, args: Any) -> Any:
        """The name of the kind asked for, its command, and the arguments left."""
        name, _, rest = super().resolve_command(ctx, args)
        if name is None:
            return name, None, rest
        # Loaded here: `stickslip --help` needs no kinds.
        from service.cli.commands.client.submit import command_of

        return name, command_of(registry()[name]), rest

    def _fill(self) -> None:
        if not self.commands:
            for kind in registry():
                self.add_command(TyperCommand(kind.name, help=kind.summary, rich_markup_mode=None))


def registry() -> Registry:
    """Return the kinds there are."""
    from service.settings.kinds import registry_here

    return registry_here()
