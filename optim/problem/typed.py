"""Load cases and limits of a design problem with types: for editors and checkers, beside plain tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

from optim.criteria.criterion_registry import limit_keys
from optim.errors import DesignError
from solver.wording import nearest

_MOST = "max_"


@dataclass(frozen=True, kw_only=True, eq=False)
class Case(Mapping[str, object]):
    """One load case of a design problem; what is left out is the scene's own.

    It is the table that ``cases`` takes, so both can stand in one list.

    Attributes
    ----------
    name : str or None
        How results call it.
    set : mapping or None
        Values of this case alone, parameter path to value; no variable.
    band : (low, high) or None
        Frequencies [Hz].
    observe : str or list of str or None
        DOF whose amplitude counts, or several.
    engine_order : int or None
        Of every excitation; cyclic scenes only.
    order : int or None
        Excitations a revolution; the engine order, else 1.
    weight : float or None
        By which its peaks count in what is minimised; 1.
    """

    name: str | None = None
    set: Mapping[str, float] | None = None
    band: tuple[float, float] | None = None
    observe: str | Sequence[str] | None = None
    engine_order: int | None = None
    order: int | None = None
    weight: float | None = None

    def __getitem__(self, key: str) -> object:
        value = getattr(self, key) if key in {one.name for one in fields(self)} else None
        if value is None:
            raise KeyError(key)
        return value

    def __iter__(self) -> Iterator[str]:
        return iter([one.name for one in fields(self) if getattr(self, one.name) is not None])

    def __len__(self) -> int:
        return len(list(iter(self)))


@dataclass(frozen=True, slots=True)
class Limit:
    """An upper bound that a design must keep.

    Attributes
    ----------
    what : str
        `peak` [m], `band_hz` [Hz], `friction_work` [J], or of what another criterion has a key ``max_…``.
    at_most : float
        The bound.
    contact : str or None
        The contact that it holds for, of what is a limit for each contact.
    """

    what: str
    at_most: float
    contact: str | None = None


def with_limits(problem: Mapping[str, object], limits: Sequence[Limit]) -> dict[str, object]:
    """Return the keys of a problem with limits among them.

    Raises
    ------
    DesignError
        A limit of what is not known, or one that is given twice.
    """
    found = dict(problem)
    known = [key.name for key in limit_keys() if key.name.startswith(_MOST)]
    for i, one in enumerate(limits):
        if not isinstance(one, Limit):
            raise DesignError(("limits", i), one, 'must be a Limit, such as Limit("peak", 1e-4)')
        key = f"{_MOST}{one.what}"
        if key not in known:
            words = [name.removeprefix(_MOST) for name in known]
            wanted = f"is not known; there are limits of {', '.join(words)}{nearest(str(one.what), words)}"
            raise DesignError(("limits", i, "what"), one.what, wanted)
        before = found.get(key)
        if one.contact is None and before is None:
            found[key] = one.at_most
        elif one.contact is not None and (before is None or isinstance(before, Mapping)):
            if before is not None and one.contact in before:
                raise DesignError(("limits", i), one.what, f"is given twice for {one.contact!r}")
            found[key] = {**(before or {}), one.contact: one.at_most}
        else:
            raise DesignError(("limits", i), one.what, "is given twice")
    return found
