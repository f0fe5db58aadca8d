"""The studies by name, in the order in which they are listed; a further one is one module and one entry here.

Nothing is imported to know them: help lists them.
"""

from __future__ import annotations

from solver.lab import LAB, is_there

NAMES = (
    "sweep", "map", "peaks", "design", "pareto", "margin", "solve", "march", "transient", "quasi-periodic",
    "wear", "accuracy", "campbell", "interference", "mistuning", "worst-mistuning", "identify", "posterior",
    "modes", "controlled", "sensitivities", "plan",
)  # fmt: skip
_IN_THE_LAB = {
    "quasi-periodic": "quasi_periodic", "wear": "wear_life", "accuracy": "accuracy",
    "worst-mistuning": "worst_mistuning", "posterior": "posterior", "controlled": "controlled",
}  # fmt: skip
"""Those whose module is `study` of a folder of the lab, by its name."""


def home_of(name: str) -> str:
    """The module of a study."""
    if name in _IN_THE_LAB:
        return f"{LAB}.{_IN_THE_LAB[name]}.study"
    return f"service.jobs.studies.{name.replace('-', '_')}_study"


def there() -> tuple[str, ...]:
    """The studies there are: those of a folder that was taken out are not."""
    return tuple(name for name in NAMES if is_there(home_of(name)))
