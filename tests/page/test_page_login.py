"""Logging in on the page: from a page that wants a key, by the organisation's account, to one that works."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from oidc import provider
from page_site import Site

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect
for name in ("authlib", "oidc_provider_mock"):
    if importlib.util.find_spec(name) is None:
        pytest.skip(f"{name} is not installed", allow_module_level=True)

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A service that wants keys, and lets in those whose address is verified."""
    with provider() as issuer:
        site = Site(
            tmp_path_factory.mktemp("locked"), STICKSLIP_REQUIRE_KEYS="true", STICKSLIP_OIDC_ISSUER=issuer,
            STICKSLIP_OIDC_CLIENT_ID="stickslip", STICKSLIP_OIDC_CLIENT_SECRET="a secret",
        )  # fmt: skip
        site.set_environment(STICKSLIP_PUBLIC_URL=site.url)
        site.start()
        yield site
        site.stop()


def test_a_person_logs_in(browser: Browser, locked: Site) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{locked.url}/?scene=two-dof")
        expect(page.locator("#key-form")).to_be_visible()
        page.get_by_role("link", name="Log in with your account").click()
        page.locator("input[name=sub]").fill("bob")
        page.locator("input[name=sub]").press("Enter")
        expect(page.locator("#banner")).to_contain_text("Your account may not use this service")
        page.get_by_role("link", name="Log in with your account").click()
        page.get_by_role("button", name="ann").click()
        page.wait_for_url(f"{locked.url}/**")
        expect(page.locator("#live-status")).to_contain_text("peak")
        expect(page.locator("#key-form")).to_be_hidden()
        assert "login" not in page.url
        kept = [cookie["name"] for cookie in context.cookies() if cookie["value"]]
        assert [name for name in kept if name.startswith("stickslip")] == []
