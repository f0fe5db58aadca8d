"""What the shell offers behind a half-written word: scenes, parameter paths, and the words of options."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from solver.errors import SolverError

if TYPE_CHECKING:
    from solver.scene.scene import Scene


SCENE_FILES = (".toml", ".json")


def scenes(incomplete: str) -> list[str]:
    """Shipped scenes, scene files, and the folders on the way to them."""
    from solver.scene.toml import shipped_scenes

    beside = Path(incomplete + "x").parent
    found = sorted(beside.iterdir()) if beside.is_dir() else []
    start = incomplete[: len(incomplete) - len(Path(incomplete + "x").name) + 1]
    named = [start + path.name + "/" * path.is_dir() for path in found if not path.name.startswith(".")]
    files = [name for name in named if name.endswith((*SCENE_FILES, "/"))]
    return [name for name in (*shipped_scenes(), *files) if name.startswith(incomplete)]


def words(*known: str) -> Callable[[str], list[str]]:
    """Offer these words."""

    def found(incomplete: str) -> list[str]:
        return [word for word in known if word.startswith(incomplete)]

    return found


def offered(known: tuple[str, ...], *, paths: bool) -> Callable[..., list[str]] | None:
    """Offer these words, with the parameter paths of the scene written before."""
    if not paths:
        return words(*known) if known else None

    def found(ctx: typer.Context, incomplete: str) -> list[str]:
        return [word for word in (*known, *_paths(ctx)) if word.startswith(incomplete)]

    return found


def paths(ctx: typer.Context, incomplete: str) -> list[str]:
    """The parameter paths of the scene written before."""
    return [path for path in _paths(ctx) if path.startswith(incomplete)]


def settings(ctx: typer.Context, incomplete: str) -> list[str]:
    """The same, as they are set to a value."""
    return [f"{path}=" for path in paths(ctx, incomplete)]


def contacts(ctx: typer.Context, incomplete: str) -> list[str]:
    """The contacts of the scene written before."""
    scene = _scene(ctx)
    names = [] if scene is None else [contact.name for contact in scene.contacts]
    return [name for name in names if name.startswith(incomplete)]


def _paths(ctx: typer.Context) -> tuple[str, ...]:
    from solver.scene.parameter_paths import parameter_paths

    scene = _scene(ctx)
    return () if scene is None else parameter_paths(scene)


def _scene(ctx: typer.Context) -> Scene | None:
    """The scene of a half-written command line; None if it names none that can be read."""
    # Where the last option waits for its value, the words before it are not yet told apart.
    name = ctx.params.get("name") or next(iter(ctx.args), None)
    if name is None:
        return None
    from solver.scene.scene import load_scene

    try:
        return load_scene(name)
    except SolverError:
        return None  # that it is wrong is said when the command runs
