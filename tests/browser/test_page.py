import re

import pytest
from playwright.sync_api import Locator, Page, expect

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


def test_keys_are_listed_and_do_what_the_list_says(page: Page) -> None:
    open_page(page)
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog", name="Help and keys")
    expect(dialog).to_be_visible()
    expect(dialog).to_contain_text("play or pause the light")
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    choose_from(page, PAGE_MENU, "Help and keys (?)")
    expect(dialog).to_be_visible()
    dialog.get_by_label("Search").fill("histogram")
    expect(dialog.locator("dt")).to_have_text(["Maps"])
    dialog.get_by_role("button", name="Close").click()
    expect(dialog).to_have_count(0)
    # a tour passes the panels, whatever is shown, and ends
    page.keyboard.press("f")
    choose_from(page, PAGE_MENU, "Tour of one minute")
    for panel in ("transient", "map", "response", "sequence"):
        toured = page.locator(f"[data-toured={panel}] .panel-{panel}")
        expect(toured).to_have_css("outline-width", "2px")
        page.get_by_role("button", name="Next").click()
    page.get_by_role("button", name="Done").click()
    expect(page.locator("[data-toured]")).to_have_count(0)
    # a wall has the pictures and the light's switch, and a link says so
    page.goto("/#kiosk=on")
    expect(page.get_by_role("button", name="Light off")).to_be_visible()
    expect(page.get_by_role("button", name="Hold")).to_have_count(0)
    page.keyboard.press("k")
    page.get_by_role("combobox", name="Search a command").fill("wall")
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Hold")).to_be_visible()
    # keys choose maps, layouts and one panel
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
    # all commands are found by words, and done by Enter
    page.keyboard.press("Control+k")
    search = page.get_by_role("combobox", name="Search a command")
    expect(search).to_be_focused()
    search.fill("maps two")
    commands = page.get_by_role("listbox", name="Commands").get_by_role("option")
    expect(commands).to_have_text(["Layout: Two maps"])
    page.keyboard.press("Enter")
    expect(search).to_have_count(0)
    page.locator(".panel-second-map canvas[data-product=indirect][data-frame]").wait_for()
    # a layout is kept under a name, and changes are undone
    choose_from(page, PAGE_MENU, "Save or remove a layout…")
    page.get_by_label("Name of the present layout").fill("pair")
    page.get_by_role("button", name="Save").click()
    page.locator(".panel-second-map .panel-title").drag_to(page.locator(".panel-plots"))
    shown = page.locator("[data-view]")
    assert views_of(shown) == ["map", "plots", "second-map", "response"]
    page.keyboard.press("z")
    expect(shown.nth(1)).to_have_attribute("data-view", "second-map")
    page.keyboard.press("z")
    expect(shown).to_have_count(6)
    choose_from(page, PAGE_MENU, "pair")
    assert views_of(shown) == ["map", "second-map", "plots", "response"]


def views_of(panels: Locator) -> list[str]:
    """The names of views, in their order."""
    names: list[str] = panels.evaluate_all("(all) => all.map((each) => each.dataset.view)")
    return names


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


def test_nothing_hangs_over_the_edge_controls_have_names_and_type_three_sizes(page: Page) -> None:
    open_page(page)
    sizes_px: set[float] = set()
    layouts = ("Overview", "Six views", "Two maps", "Projector", "One pixel")
    for layout in layouts:
        choose_from(page, PAGE_MENU, layout)
        page.locator(".panel-map, .panel-streak").first.wait_for()
        if layout == "Overview":
            page.get_by_role("button", name="Edit").click()
        for width in (320, 3840, 1280):
            page.set_viewport_size({"width": width, "height": 800})
            page.evaluate(_PAINTED)
            assert page.evaluate("document.documentElement.scrollWidth") <= width, layout
            assert page.evaluate(_CUT_BUTTONS) == [], (layout, width)
        unnamed = page.evaluate(
            """() => [...document.querySelectorAll("button, select, input, [role=application]")]
                 .filter((it) => !(it.ariaLabel || it.textContent.trim() || it.labels?.length))
                 .map((it) => it.outerHTML)"""
        )
        assert unnamed == [], layout
        sizes_px |= set(page.evaluate(_SIZES_OF_TYPE_PX))
    assert sizes_px == {12, 13, 20}


# whose words do not fit into them, or that stand over the edge of their panel; tabs are scrolled
_CUT_BUTTONS = """
() => [...document.querySelectorAll("button:not(.tabs *)")]
    .filter((each) => each.checkVisibility())
    .filter((each) => {
      const edge = each.closest(".panel")?.getBoundingClientRect().right ?? innerWidth;
      return each.scrollHeight > each.clientHeight + 1 || each.getBoundingClientRect().right > edge;
    })
    .map((each) => each.outerHTML)
"""
_SIZES_OF_TYPE_PX = """
() => [...document.querySelectorAll("body *:not(svg *, noscript, script)")]
    .filter((each) => [...each.childNodes].some((it) => it.nodeType === 3 && it.data.trim()))
    .map((each) => parseFloat(getComputedStyle(each).fontSize))
"""
_PAINTED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1920, 1080), (1280, 800)])
def test_the_light_takes_most_of_the_page_in_a_stage_of_its_own_shape(
    page: Page, width: int, height: int
) -> None:
    page.set_viewport_size({"width": width, "height": height})
    open_page(page)
    page.evaluate(_PAINTED)

    def size_of(selector: str) -> tuple[float, float]:
        box = page.locator(f".panel-transient{selector}").bounding_box()
        assert box is not None
        return box["width"], box["height"]

    assert size_of("")[0] > 0.6 * width
    picture_px, picture_height_px = size_of(" .stage-picture")
    assert picture_px > 0.55 * width
    assert picture_px / picture_height_px == pytest.approx(163 / 120, rel=0.01)
    # the black stage holds the picture, the colour bar and 12 px between and beside them
    stage_px, stage_height_px = size_of(" .picture")
    assert stage_px == pytest.approx(picture_px + size_of(" .colour-bar")[0] + 12, abs=1.5)
    assert stage_height_px == pytest.approx(picture_height_px, abs=1.5)
    assert size_of(" .timeline")[1] >= 96
    assert page.evaluate("document.documentElement.scrollHeight") <= height
