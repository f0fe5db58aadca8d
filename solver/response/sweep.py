"""`sweep` for every scene: by continuation of a balance, or over exact orbits where contacts are rigid."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

from solver.continuation.branch import AnyBranch, Branch
from solver.continuation.branches.sweep import sweep as by_continuation
from solver.scene.scene import Scene

_Given = ParamSpec("_Given")


def _exactly_where_rigid(continued: Callable[_Given, Branch]) -> Callable[_Given, AnyBranch]:
    """Give rigid contacts, for which there is no balance, to `solver.response.exact.sweep`."""

    @wraps(continued)
    def sweep(*args: _Given.args, **options: _Given.kwargs) -> AnyBranch:
        scene = args[0] if args else options.get("scene")
        if isinstance(scene, Scene) and scene.rigid_contact is not None:
            from solver.response.exact.sweep import sweep_exactly  # loaded where it is asked for

            return sweep_exactly(*args, **options)  # type: ignore[arg-type]
        return continued(*args, **options)

    return sweep


sweep = _exactly_where_rigid(by_continuation)
