import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.dashboard import choose_from, open_page, point_at
from tests.browser.test_transient import F_HZ

pytestmark = pytest.mark.shared_daemon

PAGE_MENU = "Page: layout, colours, help"


def test_an_address_shows_what_it_says(page: Page) -> None:
    page.goto("/?debug#map=direct&pixel=81,20&time_ns=11.74&view=response")
    expect(page.locator("[data-view]")).to_have_count(1)
    expect(page.locator(".panel-response h2")).to_have_text("Impulse response of pixel 81, 20")
    choose_from(page, "Panel response", "Show all panels")
    expect(page.locator(".panel-transient [data-field=time]")).to_have_text("11.74\u202fns")
    expect(page.get_by_role("tab", name="Direct", exact=True)).to_have_attribute(
        "aria-selected", "true"
    )


def test_the_address_follows_what_is_shown(page: Page) -> None:
    open_page(page)
    point_at(page, "map", 40, 30, click=True)
    page.get_by_role("tab", name="Indirect", exact=True).click()
    page.evaluate("() => transientcam.store.player.seek(0.25)")
    time_ns = round(0.25e9 / F_HZ, 3)
    expect(page).to_have_url(re.compile(rf"#map=indirect&pixel=40,30&time_ns={time_ns}$"))
    page.evaluate("() => { location.hash = '#map=range&pixel=7,8'; }")
    expect(page.locator(".panel-response h2")).to_have_text("Impulse response of pixel 7, 8")


def test_the_list_of_keys_opens_and_closes(page: Page) -> None:
    open_page(page)
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog", name="Keys")
    expect(dialog).to_be_visible()
    expect(dialog).to_contain_text("play or pause the light")
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    choose_from(page, PAGE_MENU, "Keys (?)")
    expect(dialog).to_be_visible()
    dialog.get_by_role("button", name="Close").click()
    expect(dialog).to_have_count(0)


def test_keys_choose_maps_layouts_and_one_panel(page: Page) -> None:
    open_page(page)
    page.keyboard.press("4")
    expect(page.get_by_role("tab", name="Brightness", exact=True)).to_have_attribute(
        "aria-selected", "true"
    )
    point_at(page, "transient", 40, 30)
    page.keyboard.press("f")
    expect(page.locator("[data-view]")).to_have_count(1)
    expect(page.locator(".panel-transient")).to_be_visible()
    page.keyboard.press("f")
    expect(page.locator("[data-view]")).to_have_count(4)
    page.keyboard.press("l")
    expect(page.locator("[data-view]")).to_have_count(6)


def test_light_and_dark_are_chosen_and_stay(page: Page) -> None:
    open_page(page)
    root, ground = page.locator("html"), "getComputedStyle(document.body).backgroundColor"
    expect(root).to_have_attribute("data-theme", "light")
    light = page.evaluate(ground)
    choose_from(page, PAGE_MENU, "Dark")
    expect(root).to_have_attribute("data-theme", "dark")
    dark = page.evaluate(ground)
    assert dark != light
    page.reload()
    expect(root).to_have_attribute("data-theme", "dark")
    choose_from(page, PAGE_MENU, "As the system")
    expect(root).to_have_attribute("data-theme", "light")
    page.emulate_media(color_scheme="dark", reduced_motion="reduce")
    expect(root).to_have_attribute("data-theme", "dark")


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("layout", ["Six views", "Projector", "One pixel"])
def test_no_layout_hangs_over_the_edge(page: Page, layout: str, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    open_page(page)
    choose_from(page, PAGE_MENU, layout)
    page.locator(".panel-transient").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, select, input, [role=application]")]
             .filter((each) => !(each.ariaLabel || each.textContent.trim() || each.labels?.length))
             .map((each) => each.outerHTML)"""
    )
    assert unnamed == []
