"""The registry of criteria: what designs can be judged by, and the words of problem files they bring.

To add a criterion, write a module with `CRITERION` and name it in `SHIPPED`; one from outside the package is
named by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

from optim.criteria.criterion import Criterion
from optim.criteria.key import Key
from solver.extensions import Kinds

SHIPPED = (
    "optim.criteria.peak_criterion",
    "optim.criteria.band",
    "optim.criteria.stress",
    "optim.criteria.utilisation",
    "optim.criteria.forbidden",
    "optim.criteria.running_speeds",
    "optim.criteria.friction_work",
    "optim.criteria.wear_rate",
    "stickslip.lab.wear_life.worn_peak",
    "optim.criteria.damping",
    "optim.criteria.quality",
    "optim.criteria.mass",
    "optim.criteria.separation",
)


def _words(criterion: Criterion) -> tuple[str, ...]:
    flags = [word for key in criterion.keys for word in (key.name, key.flag)]
    return (criterion.name, *flags, *([f"weights.{criterion.weight}"] if criterion.weight else []))


CRITERIA: Kinds[Criterion] = Kinds(Criterion, "criterion", _words, SHIPPED, "CRITERION")
criteria, register, unregister = CRITERIA.every, CRITERIA.register, CRITERIA.unregister


def limit_keys(*, of_fronts: bool | None = None) -> tuple[Key, ...]:
    """The keys of limits, in order.

    Parameters
    ----------
    of_fronts : only those that a front takes, or only those that it does not.
    """
    return tuple(
        key for one in criteria() if of_fronts is None or one.on_a_front is of_fronts for key in one.keys
    )


def weight_words() -> tuple[str, ...]:
    """The words of `weights`, in order."""
    return tuple(one.weight for one in criteria() if one.weight)


def by_weight(word: str) -> Criterion | None:
    """The criterion of a word of `weights`."""
    return next((one for one in criteria() if one.weight == word), None)
