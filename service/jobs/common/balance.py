"""Keys of studies that solve the balance itself: what it pays for, and how accurate it is to be."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.scenes import check
from service.jobs.common.sizes import balance_issues
from service.jobs.registry import Flag
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene

AUTO = "auto"
WORDS = (AUTO, "all", "even-harmonics", "every-contact", "every-port", "every-sector", "whole-matrices")
EffectsWord = Annotated[
    str,
    Field(
        max_length=200,
        description=f"What to pay for though the scene does not call for it: {', '.join(WORDS[2:])}.",
    ),
    Flag(metavar="auto|all|NAME,…", words=WORDS),
]
Accuracy = Annotated[
    Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] | None,
    Field(description="Estimated error relative to the amplitude; chooses the harmonics itself."),
    Flag(metavar="E"),
]
_FIRST_TRIES = 23  # harmonics; with more unknowns than a few nobody adds any to reach an accuracy


def effects_issues(effects: str) -> list[Issue]:
    """Return what is wrong with the word of effects."""
    # Loaded here, as below: the help of a command needs the keys alone.
    from solver.balance.simplifications import Effects

    return check(partial(Effects.read, effects), "effects")


def with_effects(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the effects that their word stands for."""
    from solver.balance.simplifications import Effects

    return {**asked, "effects": Effects.read(asked.get("effects", AUTO))}


def solved_issues(
    key: str, scene: Scene, harmonics: int, effects: str, *, accuracy: float | None = None, points: int = 1
) -> list[Issue]:
    """Refuse responses whose balance is too large, or too many of them, as `balance_issues`."""
    every_sector = with_effects({"effects": effects})["effects"].every_sector
    highest = harmonics if accuracy is None else max(harmonics, _FIRST_TRIES)
    return balance_issues(key, scene, highest, points, every_sector=every_sector)
