pytest_plugins = ("tests.tiers", "tests.shared")
