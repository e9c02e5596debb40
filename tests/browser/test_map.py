import io
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from tests.browser.dashboard import (
    look_at,
    map_canvas,
    map_colours,
    map_pixels,
    open_page,
    point_at,
    read_at,
    shows_frame,
)
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon

NAMES = {"viridis": "viridis", "cividis": "cividis", "grey": "gray", "coolwarm": "coolwarm"}
# The page's maps are straight lines between every fifteenth colour of matplotlib's.
TOLERANCE = {"viridis": 6, "cividis": 12, "grey": 1, "coolwarm": 6}
# as they are written below a map
SHORT = ("–", "", "–", "", "0, 0", "no value")
LONG = (
    *("7.345\u202fm", "±\u202f123\u202fmm", "1234\u202fDN", "±\u202f123\u202fDN", "163, 120"),
    "noise 123\u202fmm, bias 123\u202fmm; not trusted: what is nearer hides this from the lamp",
)
# the map's place once it is laid out: the same in ten pictures of the page in a row
BOX_AT_REST = """async () => {
    const canvas = document.querySelector(".panel-map .stage canvas[data-product]");
    for (let before = "", same = 0; same < 10; ) {
        await new Promise(requestAnimationFrame);
        const now = JSON.stringify(canvas.getBoundingClientRect());
        [before, same] = [now, now === before ? same + 1 : 0];
    }
    const { x, y, width, height } = canvas.getBoundingClientRect();
    return { x, y, width, height };
}"""


def stop(served: Served) -> int:
    """Stop the camera; the number of its last frame."""
    httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False}).raise_for_status()
    number: int = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    return number


def product(served: Served, name: str) -> NDArray[Any]:
    answer = httpx.get(f"{served.url}/api/v1/frames/latest/{name}.npy").raise_for_status()
    array: NDArray[Any] = np.load(io.BytesIO(answer.content))
    return array


def test_each_map_has_the_colours_of_the_values_the_daemon_serves(
    page: Page, served: Served
) -> None:
    open_page(page)
    # a map that is chosen while the camera stands still shows its last frame
    number = stop(served)
    shows_frame(page, number)
    for name in ("Range", "Direct", "Indirect", "Brightness", "Validity"):
        page.get_by_role("tab", name=name, exact=True).click()
        shown = name.lower()
        page.locator(f".panel-map canvas[data-product={shown}][data-frame='{number}']").wait_for()
        canvas = map_canvas(page)
        low, high, chosen = (
            str(canvas.get_attribute(f"data-{key}")) for key in ("low", "high", "colours")
        )
        painted = map_pixels(page).astype(int)
        expected = map_colours(product(served, shown), float(low), float(high), NAMES[chosen])
        assert painted.shape == (120, 163, 4)
        np.testing.assert_allclose(painted, expected, atol=TOLERANCE[chosen], err_msg=name)
        assert len(np.unique(painted.reshape(-1, 4), axis=0)) > 20, "a picture, not a plane"
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")


def test_a_picture_keeps_its_size_whatever_is_read_below_it(page: Page, served: Served) -> None:
    open_page(page)
    stop(served)
    point_at(page, "map", 40, 50, click=True)
    figures = page.locator(".panel-map .readout [data-field]")
    for width in range(1100, 1500, 32):
        page.set_viewport_size({"width": width, "height": 800})
        sizes = []
        for texts in (SHORT, LONG):
            figures.evaluate_all(
                "(each, texts) => each.forEach((one, n) => (one.textContent = texts[n]))", texts
            )
            sizes.append(page.evaluate(BOX_AT_REST))
        assert sizes[0] == sizes[1], width


def test_the_scale_holds_nearly_all_values_and_the_pointer_reads_them(
    page: Page, served: Served
) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    low, high = (
        float(str(map_canvas(page).get_attribute(f"data-{key}"))) for key in ("low", "high")
    )
    values = product(served, "range")
    inside = np.mean((values >= low) & (values <= high))
    assert inside > 0.97
    assert high - low < 3 * (np.nanpercentile(values, 99) - np.nanpercentile(values, 1))
    bar = page.locator(".panel-map .colour-bar")
    expect(bar).to_have_attribute("aria-label", f"Colour scale from {low:.1f} to {high:.1f}\u202fm")
    ranges, brightness = values, product(served, "brightness")
    for x, y in ((40, 30), (100, 70), (0, 0), (162, 119), (125, 60)):
        value, amplitude = read_at(page, x, y, "value", "amplitude")
        assert value == f"{ranges[y, x]:.3f} m"
        assert amplitude == f"{brightness[y, x]:.0f} DN"


def test_limits_and_colours_that_were_set_stay_across_a_reload(page: Page, served: Served) -> None:
    open_page(page)
    look_at(page, "map")
    page.get_by_label("High end of the scale in m").fill("5")
    page.get_by_label("Low end of the scale in m").fill("1")
    page.get_by_label("Low end of the scale in m").press("Enter")
    page.locator(".panel-map").get_by_label("Colours").select_option("cividis")
    open_page(page)
    shows_frame(page, stop(served))
    expected = map_colours(product(served, "range"), 1.0, 5.0, "cividis")
    np.testing.assert_allclose(map_pixels(page).astype(int), expected, atol=TOLERANCE["cividis"])
