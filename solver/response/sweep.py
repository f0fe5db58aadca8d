"""`sweep` for every scene: by continuation of a balance, or over exact orbits where contacts are rigid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import wraps
from typing import Any, ParamSpec

from solver.continuation.branch import AnyBranch, Branch
from solver.continuation.branches.sweep import sweep as by_continuation
from solver.continuation.stretches import Course
from solver.continuation.walk import ContinuationSettings
from solver.lab import from_lab
from solver.scene.scene import Scene

_IN_A_RECORD = {
    "settings": (ContinuationSettings, {"peaks", "errors"}),
    "course": (Course, {one.name for one in fields(Course)}),
}
_Given = ParamSpec("_Given")


def _gather(options: dict[str, Any]) -> None:
    """Put what was given by a keyword of its own, such as `errors` or `on_points`, into its record."""
    for name, (kind, words) in _IN_A_RECORD.items():
        given = {word: options.pop(word) for word in words & options.keys()}
        if given:
            options[name] = replace(options.get(name) or kind(), **given)


def _exactly_where_rigid(continued: Callable[_Given, Branch]) -> Callable[_Given, AnyBranch]:
    """Give rigid contacts, for which there is no balance, to `stickslip.lab.proofs.exact.exact_sweep`."""

    @wraps(continued)
    def sweep(*args: _Given.args, **options: _Given.kwargs) -> AnyBranch:
        _gather(options)
        scene = args[0] if args else options.get("scene")
        if isinstance(scene, Scene) and scene.rigid_contact is not None:
            found: AnyBranch = from_lab("proofs.exact.exact_sweep:sweep_exactly")(*args, **options)
            return found
        return continued(*args, **options)

    return sweep


sweep = _exactly_where_rigid(by_continuation)
