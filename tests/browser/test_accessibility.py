"""Every view, light and dark, on a desk and on a phone, held to the rules of WCAG by axe-core."""

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.dashboard import choose, open_page
from tests.browser.test_transient import stop
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon

_ROOT = Path(__file__).resolve().parents[2]
_AXE = _ROOT / "client" / "dashboard" / "node_modules" / "axe-core" / "axe.min.js"
_RULES = {
    "runOnly": {
        "type": "tag",
        "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    }
}
VIEWS = (
    "Validity",
    "Recordings",
    "Reconstruction",
    "Calibration",
    "Simulated scene",
    "What happened",
    "Points in space",
    "Streak",
    "Values",
)


def offences_of(page: Page, *, within: str = "html", rules: dict[str, Any] = _RULES) -> list[str]:
    """What a page, or a part of it, offends against, in words."""
    # the page's own content security policy lets no script in but its own: evaluated, not linked
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(_AXE.read_text(encoding="utf-8"))
    found: dict[str, Any] = page.evaluate(
        "([within, rules]) => axe.run(within, rules)", [within, rules]
    )
    return [
        f"{each['id']} ({each['impact']}): {node['html'][:160]}: {node.get('failureSummary', '')}"
        for each in found["violations"]
        for node in each["nodes"]
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_view_offends_a_rule(page: Page, served: Served, scheme: str) -> None:
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    open_page(page)
    page.locator(".panel-response .returns").wait_for()
    stop(served)  # new frames alter no rule
    assert offences_of(page) == []
    shown = "sequence"
    offences: dict[str, list[str]] = {}
    for title in VIEWS:
        choose(page, shown, title)
        panel = page.locator("[data-view]", has=page.get_by_role("heading", name=title))
        shown = str(panel.get_attribute("data-view"))
        # what is beside the panel is held to all rules above; the scheme changes colours alone
        rules = _RULES if scheme == "light" else {"runOnly": ["color-contrast"]}
        if found := offences_of(page, within=f".panel-{shown}", rules=rules):
            offences[title] = found
    assert offences == {}


def test_the_page_on_a_phone_and_its_dialogs_offend_no_rule(page: Page, served: Served) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    open_page(page)
    page.locator(".panel-response .returns").wait_for()
    stop(served)
    assert offences_of(page) == []
    look = page.get_by_role("button", name="Look of the light")
    look.click()
    assert offences_of(page, within=".look") == []
    page.keyboard.press("Escape")
    for key in ("?", "k"):
        page.keyboard.press(key)
        page.locator("dialog[open]").wait_for()
        assert offences_of(page, within="dialog[open]") == []
        page.keyboard.press("Escape")
        expect(page.locator("dialog[open]")).to_have_count(0)
