"""One test of many cases, which lists all that are wrong."""

import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def each(
    names: str | tuple[str, ...], cases: Iterable[Any] | Callable[[], Iterable[Any]]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """As `pytest.mark.parametrize`, in one test: of cheap cases every one is looked at in every run.

    Fixtures are shared by the cases. Cases that take time to find are given by a function, which the test
    calls: every process collects.
    """
    named = names.replace(",", " ").split() if isinstance(names, str) else names
    given = cases if inspect.isfunction(cases) else list(cases)  # type: ignore[arg-type]

    def decorated(check: Callable[..., None]) -> Callable[..., None]:
        def test(**others: Any) -> None:
            wrong, count = [], 0
            for case in given() if callable(given) else given:
                count += 1
                values = dict(zip(named, case if len(named) > 1 else (case,), strict=True))
                try:
                    check(**values, **others)
                except (AssertionError, pytest.fail.Exception) as error:
                    wrong.append(f"{case}: {error}")
                except Exception as error:
                    error.add_note(f"of the case {case}")
                    raise
            assert count, "there is no case"
            assert not wrong, "\n\n".join(wrong)

        vars(test).update(vars(check))
        test.__name__, test.__doc__, test.__module__ = check.__name__, check.__doc__, check.__module__
        found = inspect.signature(check)
        left = [one for name, one in found.parameters.items() if name not in named]
        test.__signature__ = found.replace(parameters=left)  # type: ignore[attr-defined]
        return test

    return decorated
