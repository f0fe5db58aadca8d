"""Tests of the lab run as all others do."""

pytest_plugins = ("tests.tiers", "tests.shared")
