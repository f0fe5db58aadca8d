"""Logging in on the page: from a page that wants a key, by the organisation's account, to one that works."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from launch import free_port
from oidc import provider
from service_helpers import serving

from service.jobs.kinds import SHIPPED

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect
for name in ("authlib", "oidc_provider_mock"):
    if importlib.util.find_spec(name) is None:
        pytest.skip(f"{name} is not installed", allow_module_level=True)

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A service that wants keys, and lets in those whose address is verified."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    with (
        provider() as issuer,
        serving(
            tmp_path_factory.mktemp("locked"), SHIPPED, port=port, public_url=url, require_keys=True,
            max_body_bytes=4_000_000, preview_seconds=60.0, oidc_issuer=issuer,
            oidc_client_id="stickslip", oidc_client_secret="a secret",
        ),
    ):  # fmt: skip
        yield url


@pytest.mark.long
def test_a_person_logs_in(browser: Browser, locked: str) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{locked}/?scene=two-dof")
        expect(page.locator("#key-form")).to_be_visible()
        page.get_by_role("link", name="Log in with your account").click()
        page.locator("input[name=sub]").fill("bob")
        page.locator("input[name=sub]").press("Enter")
        expect(page.locator("#banner")).to_contain_text("Your account may not use this service")
        page.get_by_role("link", name="Log in with your account").click()
        page.get_by_role("button", name="ann").click()
        page.wait_for_url(f"{locked}/**")
        expect(page.locator("#live-status")).to_contain_text("peak")
        expect(page.locator("#key-form")).to_be_hidden()
        assert "login" not in page.url
        kept = [cookie["name"] for cookie in context.cookies() if cookie["value"]]
        assert [name for name in kept if name.startswith("stickslip")] == []
