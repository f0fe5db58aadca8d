"""The registry of criteria: what designs can be judged by, and the words of problem files they bring.

To add a criterion, write a module with `CRITERION` and name it in `SHIPPED`; one from outside the package is
named by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from optim.criteria.criterion import Criterion
from optim.criteria.key import Key
from solver.extensions import extensions

SHIPPED = (
    "optim.criteria.peak",
    "optim.criteria.band",
    "optim.criteria.forbidden",
    "optim.criteria.friction_work",
    "optim.criteria.separation",
)
_added: list[Criterion] = []


def criteria() -> tuple[Criterion, ...]:
    """Every criterion: those that come with the package, then those from outside."""
    return (*_shipped(), *extensions(Criterion), *_added)


@cache
def _shipped() -> tuple[Criterion, ...]:
    return tuple(import_module(module).CRITERION for module in SHIPPED)


def register(criterion: Criterion) -> Criterion:
    """Add a criterion in this process; bodies and options that were made before do not know its words.

    The command and the service with its workers need extensions.

    Raises
    ------
    ValueError
        One of its words is taken.
    """
    taken = {word for other in criteria() for word in _words(other)}
    twice = sorted(taken & _words(criterion))
    if twice:
        raise ValueError(f"the criterion {criterion.name!r} has words of another one: {', '.join(twice)}")
    _added.append(criterion)
    return criterion


def unregister(criterion: Criterion) -> None:
    """Take back what `register` added."""
    _added.remove(criterion)


def _words(criterion: Criterion) -> set[str]:
    flags = {key.flag for key in criterion.keys}
    weights = {f"weights.{criterion.weight}"} if criterion.weight else set()
    return {criterion.name, *(key.name for key in criterion.keys), *flags, *weights}


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
