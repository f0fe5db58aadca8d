"""One test of many names, which lists all that are wrong."""

from collections.abc import Callable, Iterable
from typing import TypeVar

Case = TypeVar("Case")


def each(cases: Iterable[Case]) -> Callable[[Callable[[Case], None]], Callable[[], None]]:
    """Make a check of one case a test of all: cheap ones of which every one is looked at in every run."""

    def decorated(check: Callable[[Case], None]) -> Callable[[], None]:
        def test() -> None:
            wrong, count = [], 0
            for case in cases:
                count += 1
                try:
                    check(case)
                except AssertionError as error:
                    wrong.append(f"{case}: {error}")
            assert count, "there is no case"
            assert not wrong, "\n\n".join(wrong)

        test.__name__, test.__doc__, test.__module__ = check.__name__, check.__doc__, check.__module__
        return test

    return decorated
