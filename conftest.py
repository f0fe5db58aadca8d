"""What all tests share, those in `tests/` and those of the lab."""

pytest_plugins = ("tests.tiers", "tests.shared")
