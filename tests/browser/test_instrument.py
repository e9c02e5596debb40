"""What people reach for with pointer and keys: menus, zoom, limits, regions, pins, links."""

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

from tests.browser.dashboard import (
    canvas_pixels,
    choose,
    choose_from,
    look_at,
    map_canvas,
    map_colours,
    open_page,
    point_at,
    shows_frame,
    text,
)
from tests.browser.test_map import product, stop
from tests.serving import Served
from tests.waiting import wait_until

pytestmark = pytest.mark.shared_daemon


def test_keys_never_do_what_was_not_asked_for(page: Page) -> None:
    open_page(page)
    downloads: list[str] = []
    page.on("download", lambda each: downloads.append(each.suggested_filename))
    menu = page.locator(".panel-map .actions-button")
    # arrow keys open a menu and move in it; Escape leaves it, and nothing has run
    menu.focus()
    page.keyboard.press("ArrowDown")
    entries = page.locator(".panel-map [role=menuitem]")
    expect(entries.first).to_be_focused()
    page.keyboard.press("ArrowDown")
    expect(entries.nth(1)).to_be_focused()
    page.keyboard.press("Escape")
    expect(entries.first).to_be_hidden()
    expect(menu).to_be_focused()
    # another map leaves the focus in the picture
    picture = page.locator(".panel-map .stage-picture")
    picture.focus()
    for key, shown in (("2", "direct"), ("5", "validity"), ("1", "range")):
        page.keyboard.press(key)
        page.locator(f".panel-map canvas[data-product={shown}]").wait_for()
        expect(picture).to_be_focused()
    # the space bar plays, whatever was clicked last; a button that was reached by keys it presses
    page.get_by_role("tab", name="Density").click()
    logarithmic = page.get_by_role("button", name="log")
    logarithmic.click()
    page.keyboard.press("Space")
    expect(logarithmic).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.keyboard.press("Tab")
    page.keyboard.press("Shift+Tab")
    expect(logarithmic).to_be_focused()
    page.keyboard.press("Space")
    expect(logarithmic).to_have_attribute("aria-pressed", "false")
    assert downloads == []


def test_the_page_opens_with_a_pixel_of_several_returns(page: Page) -> None:
    open_page(page)
    expect(page.locator(".panel-response h2")).to_have_text(
        re.compile(r"Impulse response of pixel \d+, \d+")
    )
    expect(page.locator(".response-plot[data-aspect=bounds][data-empty=false]")).to_be_visible()
    rows = page.locator(".returns tbody tr")
    expect(rows.and_(page.locator("[data-found=true]")).nth(1)).to_be_visible()
    expect(rows).to_have_count(4)  # however many returns there are
    expect(page.locator(".key")).to_contain_text("truth")


def test_all_pictures_are_zoomed_and_moved_together(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    ranges = product(served, "range")
    point_at(page, "transient", 40, 30)
    page.mouse.wheel(0, -500)  # 2.7 times
    for panel in ("map", "transient"):
        expect(page.locator(f".panel-{panel} .stage-zoom")).to_have_attribute(
            "style", re.compile("scale")
        )
    # the pixel under the pointer is the one it was, and is read as such
    expect(page.locator(".panel-map [data-field=pixel]")).to_have_text("40, 30")
    # the box of the canvas is zoomed as it looks, so that `point_at` finds pixels in it
    point_at(page, "map", 42, 33)
    expect(page.locator(".panel-map [data-field=pixel]")).to_have_text("42, 33")
    assert text(page, ".panel-map", "value") == f"{ranges[33, 42]:.3f} m"
    # dragging moves the picture by what the pointer moves, and selects nothing
    selected = page.evaluate("() => JSON.stringify(transientcam.store.selected.peek())")
    page.mouse.down()
    box = page.locator(".panel-map .stage-picture").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"], steps=4)
    expect(page.locator(".panel-map [data-field=pixel]")).to_have_text("42, 33")
    page.mouse.up()
    assert page.evaluate("() => JSON.stringify(transientcam.store.selected.peek())") == selected
    page.locator(".panel-transient .stage-picture").dblclick(position={"x": 90, "y": 90})
    for panel in ("map", "transient"):
        assert not page.locator(f".panel-{panel} .stage-zoom").get_attribute("style")


def test_limits_are_drawn_typed_refused_and_shared(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    canvas = map_canvas(page)
    before = float(str(canvas.get_attribute("data-high")))
    # a reversed pair is refused in words, and nothing changes
    look_at(page, "map")
    low = page.get_by_label("Low end of the scale in m")
    low.fill("9")
    low.press("Enter")
    expect(page.locator("[data-field=limits-refusal]")).to_contain_text("does not lie below")
    expect(low).to_have_attribute("aria-invalid", "true")
    assert float(str(canvas.get_attribute("data-high"))) == before
    page.keyboard.press("Escape")
    # the upper handle, drawn down by a third of the bar
    handle = page.locator(".panel-map .colour-bar-high")
    bar = page.locator(".panel-map .colour-bar-body").bounding_box()
    grip = handle.bounding_box()
    assert bar is not None
    assert grip is not None
    middle = grip["y"] + grip["height"] / 2
    page.mouse.move(grip["x"] + grip["width"] / 2, middle)
    page.mouse.down()
    page.mouse.move(grip["x"] + 5, middle + bar["height"] / 3, steps=3)
    page.mouse.up()
    low_m, high_m = (float(str(canvas.get_attribute(f"data-{end}"))) for end in ("low", "high"))
    assert high_m == pytest.approx(before - 0.4 * (before - low_m), rel=0.05)
    ranges = product(served, "range")
    assert np.mean(ranges > high_m) > 0.01, "some lie above, which are marked"
    expected = map_colours(ranges, low_m, high_m, "viridis")
    np.testing.assert_allclose(canvas_pixels(canvas).astype(int), expected, atol=6)
    # the points are coloured on the same scale
    choose_from(page.locator(".panel-sequence"), "Panel sequence", "Points in space")
    points = page.locator("canvas[data-product=points][data-frame]")
    points.wait_for()
    for end, value in (("low", low_m), ("high", high_m)):
        assert float(str(points.get_attribute(f"data-{end}"))) == pytest.approx(value)
    # a double click on the bar lets the limits follow the data again
    page.locator(".panel-map .colour-bar-body").dblclick(position={"x": 40, "y": 10})
    expect(canvas).to_have_attribute("data-high", str(before).removesuffix(".0"))


def test_pins_and_regions_measure_what_the_daemon_serves(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    ranges = product(served, "range").astype(np.float64)
    lens = httpx.get(f"{served.url}/api/v1/camera").json()["intrinsics"]
    page.keyboard.down("Shift")
    places = []
    for pin, (x, y) in zip("AB", ((30, 40), (120, 70)), strict=True):
        point_at(page, "map", x, y, click=True)
        shown = page.locator(f"[data-pin={pin}]")
        expect(shown).to_contain_text(f"{ranges[y, x]:.3f}")
        expect(page.locator(".panel-transient .mark-pin", has_text=pin)).to_be_visible()
        places.append(points_of(ranges[y, x], x, y, lens))
    apart_m = float(np.linalg.norm(places[0] - places[1]))
    expect(page.locator("[data-distance=AB]")).to_contain_text(f"{apart_m:.3f}")
    # dragging with Shift marks a region
    point_at(page, "map", 50, 40)
    page.mouse.down()
    point_at(page, "map", 69, 54)
    page.mouse.up()
    page.keyboard.up("Shift")
    inside = ranges[40:55, 50:70]
    expect(page.locator("[data-field=region-count]")).to_have_text(str(np.isfinite(inside).sum()))
    assert text(page, ".panel-map", "region-mean") == f"{np.nanmean(inside):.3f} m"
    assert text(page, ".panel-map", "region-std") == f"{np.nanstd(inside, ddof=1):.3f} m"
    assert text(page, ".panel-map", "region-filled") == f"{100 * np.isfinite(inside).mean():.0f} %"
    y, x = np.mgrid[: ranges.shape[0], : ranges.shape[1]]
    plane_is_shown(page, ranges, lens, (x >= 50) & (x <= 69) & (y >= 40) & (y <= 54))
    note = "edge, 1/2 <b>&amp;"
    page.get_by_label("Note at B").fill(note)
    expect(page.locator(".panel-transient .mark-note")).to_have_text(note)
    with page.expect_download() as download:
        choose(page, "map", "Figure (SVG)")
    figure = ElementTree.fromstring(Path(download.value.path()).read_text())
    assert any(f"B (120, 70): {note}" in (each.text or "") for each in figure.iter())
    # the map along the line between the pins, and all of them in one frame of the last seconds
    choose(page, "sequence", "Values")
    series = page.locator(".plots-place")
    expect(series).to_have_count(4)  # the selected pixel, A, B and the region
    expect(page.locator("[data-place=B]")).to_contain_text(f"{ranges[70, 120]:.3f}")
    expect(page.locator("[data-place=region]")).to_contain_text(f"{np.nanmean(inside):.3f}")
    page.get_by_role("tab", name="Line A to B").click()
    page.locator(".line-chart canvas").wait_for()
    with page.expect_download() as download:
        choose(page, "plots", "Values (CSV)")
    rows = Path(download.value.path()).read_text().splitlines()[1:]
    line = np.array([[float(each or "nan") for each in row.split(",")] for row in rows])
    steps = np.arange(91) / 90  # from column 30 to column 120
    along = ranges[np.floor(40 + 30 * steps + 0.5).astype(int), 30 + np.arange(91)]
    np.testing.assert_allclose(line[:, 0], steps * np.hypot(90, 30), rtol=1e-6)
    np.testing.assert_allclose(line[:, 1], along, rtol=1e-6)
    # clicks with Ctrl set corners of a polygon: a triangle, y >= 20, x - y >= 10, x + y <= 110
    for corner in ((30, 20), (90, 20), (60, 50)):
        page.keyboard.down("Control")
        point_at(page, "transient", *corner, click=True)
        page.keyboard.up("Control")
    triangle = (y >= 20) & (x - y >= 10) & (x + y <= 110)
    values = ranges[triangle]
    expect(page.locator("[data-field=region-count]")).to_have_text(str(np.isfinite(values).sum()))
    assert text(page, ".panel-map", "region-mean") == f"{np.nanmean(values):.3f} m"
    assert text(page, ".panel-map", "region-std") == f"{np.nanstd(values, ddof=1):.3f} m"
    plane_is_shown(page, ranges, lens, triangle)
    expect(page.locator(".panel-map .mark-corner")).to_have_count(3)
    page.get_by_role("button", name="Remove region").click()
    page.get_by_role("button", name="Remove pins").click()
    expect(page.locator(".mark-region, .mark-polygon, .mark-pin")).to_have_count(0)


def plane_is_shown(
    page: Page, ranges: NDArray[np.float64], lens: dict[str, float], inside: NDArray[np.bool_]
) -> None:
    """Compare the plane that is shown with that of the pixels inside."""
    residual_m, tilt_deg = plane_of(ranges, lens, inside)
    figure, unit = text(page, ".panel-map", "plane-residual").split()
    shown_m = float(figure) * {"m": 1, "mm": 1e-3, "µm": 1e-6}[unit]
    assert shown_m == pytest.approx(residual_m, rel=0.06)  # two digits
    assert text(page, ".panel-map", "plane-tilt") == f"{tilt_deg:.1f} °"


def points_of(range_m: Any, x: Any, y: Any, lens: dict[str, float]) -> NDArray[np.float64]:
    """Points on the rays of pixels to which the light's path is twice the range, by bisection."""
    rays = np.stack(
        [(x - lens["cx"]) / lens["fx"], (y - lens["cy"]) / lens["fy"], np.ones_like(range_m)]
    )
    rays /= np.linalg.norm(rays, axis=0)
    light_m = np.array([lens[f"light_{axis}_m"] for axis in "xyz"])
    nearer_m, farther_m = np.zeros_like(range_m), np.asarray(range_m) + np.linalg.norm(light_m)
    for _ in range(60):
        middle_m = (nearer_m + farther_m) / 2
        back_m = np.linalg.norm((middle_m * rays).T - light_m, axis=-1).T
        longer = middle_m + back_m > 2 * range_m
        nearer_m, farther_m = (
            np.where(longer, nearer_m, middle_m),
            np.where(longer, middle_m, farther_m),
        )
    return np.asarray(nearer_m * rays)


def plane_of(
    ranges: NDArray[np.float64], lens: dict[str, float], inside: NDArray[np.bool_]
) -> tuple[float, float]:
    """Deviation from the nearest plane in m and its tilt in degrees, by singular values."""
    y, x = np.nonzero(inside & np.isfinite(ranges))
    found = points_of(ranges[y, x], x, y, lens).T
    _, singular, axes = np.linalg.svd(found - found.mean(axis=0), full_matrices=False)
    tilt = np.degrees(np.arccos(abs(axes[2, 2])))
    return float(singular[2] / np.sqrt(len(found) - 3)), float(tilt)


def test_a_shared_link_opens_the_very_frame_for_another_user(
    page: Page, served: Served, browser: Browser
) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    open_page(page)
    page.get_by_role("button", name="Share").click()
    read = "() => navigator.clipboard.readText()"
    wait_until(lambda: "recording=" in page.evaluate(read))
    link = page.evaluate(read)
    context = browser.new_context()
    other = context.new_page()
    other.goto(link)
    other.locator(".replay[data-frame='1']").wait_for()
    other.locator(".panel-map canvas[data-frame]").wait_for()
    ranges = "() => JSON.stringify([...transientcam.store.frames.of('range').value.values])"
    other.wait_for_function(
        f"([of]) => 'transientcam' in window && ({ranges})() === of", arg=[page.evaluate(ranges)]
    )
    context.close()


def test_a_copied_link_shows_the_same_page_to_another_user(
    page: Page, served: Served, browser: Browser
) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    open_page(page)
    choose_from(page, "Page: layout, colours, help", "One pixel")
    choose_from(page.locator(".panel-streak"), "Panel streak", "Maps")
    look_at(page, "map")
    page.get_by_label("High end of the scale in m").fill("3,5")
    page.get_by_label("High end of the scale in m").press("Enter")
    page.locator(".panel-map").get_by_label("Colours").select_option("cividis")
    page.get_by_role("tab", name="Last 1 ns").click()
    page.get_by_role("tab", name="Cumulative").click()
    page.keyboard.down("Shift")
    point_at(page, "map", 30, 40, click=True)
    page.keyboard.up("Shift")
    page.mouse.wheel(0, -500)
    choose_from(page, "Page: layout, colours, help", "Copy a link to what is shown")
    toast = page.locator(".toast", has_text="The link was copied")
    expect(toast).to_be_visible()
    # it is announced where nothing can be pressed
    covered = toast.evaluate(
        """(toast) => { const box = toast.getBoundingClientRect();
             return [...document.querySelectorAll("button, select, input")].filter((each) => {
               const at = each.getBoundingClientRect();
               return at.width > 0 && at.left < box.right && at.right > box.left
                 && at.top < box.bottom && at.bottom > box.top; }).length; }"""
    )
    assert covered == 0
    link = page.evaluate("() => navigator.clipboard.readText()")
    context = browser.new_context(reduced_motion="reduce")
    other = context.new_page()
    other.goto(link)
    other.locator(".panel-map canvas[data-frame]").wait_for()
    views = "(all) => JSON.stringify(all.map((each) => each.dataset.view))"
    shown = other.locator("[data-view]").evaluate_all(views)
    assert json.loads(shown) == ["transient", "map", "response"]
    expect(map_canvas(other)).to_have_attribute("data-high", "3.5")
    expect(map_canvas(other)).to_have_attribute("data-colours", "cividis")
    other.locator("canvas[data-play=gate]").wait_for()
    expect(other.locator(".response-plot[data-aspect=cumulative]")).to_be_visible()
    expect(other.locator("[data-pin=A]")).to_be_visible()
    zooms = [
        re.findall(r"-?[0-9.]+", str(each.locator(".panel-map .stage-zoom").get_attribute("style")))
        for each in (page, other)
    ]
    assert float(zooms[0][0]) > 1
    assert [float(each) for each in zooms[1]] == pytest.approx(
        [float(each) for each in zooms[0]], rel=1e-3
    )
    context.close()


def test_a_phone_shows_pictures_rather_than_the_header(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    open_page(page)
    header = page.locator(".bar").bounding_box()
    assert header is not None
    assert header["height"] <= 0.07 * 844
    choose_from(page.locator(".panel-sequence"), "Panel sequence", "Simulated scene")
    why = page.locator(".effect-why").first
    why.wait_for()
    box = why.bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
