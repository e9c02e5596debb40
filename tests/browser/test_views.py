import base64
import io
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch
from tests.browser.dashboard import (
    canvas_pixels,
    choose,
    colours,
    look_at,
    map_colours,
    open_page,
    point_at,
    shows_frame,
)
from tests.browser.test_map import product, stop
from tests.serving import Served
from transientcam.wire._codec import pack_with_array

pytestmark = pytest.mark.shared_daemon

F_HZ = 23e6
BINS = 256
FLAG_COLOURS = {
    4: "e69f00",
    8: "cc79a7",
    2: "1b2a6b",
    64: "d55e00",
    128: "56b4e9",
    32: "f0e442",
    16: "009e73",
    1: "7f93a3",
}
NAMES = {1: "biased", 2: "no_signal", 4: "saturated", 8: "non_finite", 16: "degenerate"}
NAMES |= {64: "contradictory", 128: "unexplained"}


def show(page: Page, served: Served, title: str, canvas: str) -> None:
    """A view in the place of the sequence, of a frame that stays."""
    open_page(page)
    shows_frame(page, stop(served))
    choose(page, "sequence", title)
    page.locator(f"canvas[data-product={canvas}][data-frame]").wait_for()


def downloaded(page: Page, panel: str, action: str) -> bytes:
    with page.expect_download() as download:
        choose(page, panel, action)
    return Path(download.value.path()).read_bytes()


def numbers(page: Page, panel: str, action: str) -> NDArray[Any]:
    array: NDArray[Any] = np.load(io.BytesIO(downloaded(page, panel, action)))
    return array


def test_the_streak_holds_the_light_that_the_daemon_integrates(page: Page, served: Served) -> None:
    show(page, served, "Streak", "streak")
    point_at(page, "map", 81, 45, click=True)
    expect(page.locator("canvas[data-product=streak]")).to_have_attribute("data-row", "45")
    shown = numbers(page, "streak", "Density in DN/s (NPY)")
    edges_s = np.arange(BINS + 1) / (BINS * F_HZ)
    answer = httpx.get(
        f"{served.url}/api/v1/frames/latest/cumulative.npy",
        params=[("time_s", float(each)) for each in edges_s],
        timeout=60,
    ).raise_for_status()
    cumulative = np.load(io.BytesIO(answer.content))[:, 45, :]
    light = np.diff(cumulative, axis=0)
    assert shown.shape == light.shape == (BINS, 163)
    brightness = cumulative[-1]
    np.testing.assert_allclose(shown / (BINS * F_HZ) / brightness, light / brightness, atol=2e-3)
    # and is painted as its numbers say
    look_at(page, "streak")
    page.locator(".panel-streak").get_by_label("Tone").select_option("linear")
    page.locator(".panel-streak").get_by_label("Colours").select_option("viridis")
    canvas = page.locator("canvas[data-product=streak]")
    expect(canvas).to_have_attribute("data-colours", "viridis")
    white = float(str(canvas.get_attribute("data-white")))
    shown = numbers(page, "streak", "Density in DN/s (NPY)")
    expected = colours(shown, 0.0, white, "viridis")
    np.testing.assert_allclose(canvas_pixels(canvas).astype(int), expected, atol=6)
    # a click into it chooses time and column
    page.get_by_label("Scanline").fill("60")
    box = canvas.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    expect(page.locator(".panel-response h2")).to_have_text("Impulse response of pixel 40, 60")
    time_ns = float(page.locator(".panel-transient [data-field=time]").inner_text().split()[0])
    # a pointer hits whole pixels of the screen
    assert time_ns == pytest.approx(0.5e9 / F_HZ, abs=1e9 / F_HZ / box["height"])
    page.get_by_label("Scanline").fill("7")
    expect(page.locator(".panel-response h2")).to_have_text("Impulse response of pixel 40, 7")


def painted_flags(page: Page) -> NDArray[np.uint8]:
    return canvas_pixels(page.locator("canvas[data-product=flags]"))


def show_message(page: Page, name: str, array: NDArray[Any]) -> None:
    """A frame of one product on the page, as if it had been streamed."""
    meta = {"frame": 1, "base_frequency_hz": F_HZ}
    head = {"v": 1, "type": "frame", "product": name, "unit": "1", "axes": ["y", "x"]}
    body = pack_with_array({**head, "meta": meta, "encode_s": 0.0}, array)
    page.evaluate(
        "(text) => transientcam.show("
        "Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer)",
        base64.b64encode(body).decode(),
    )


def test_the_validity_map_says_what_is_wrong_where_and_how_often(
    page: Page, served: Served
) -> None:
    show(page, served, "Validity", "flags")
    assert np.all(painted_flags(page)[..., :3] == [127, 147, 163]), "without noise all are biased"
    # what is on screen is handed out in numbers
    np.testing.assert_array_equal(
        numbers(page, "map", "Range in m (NPY)"), product(served, "range")
    )
    np.testing.assert_array_equal(
        numbers(page, "validity", "Flags (NPY)"), product(served, "flags")
    )
    bits = np.array([0, 0, *FLAG_COLOURS, 1 | 4, 2 | 16, 8 | 1], np.uint8)
    flags = np.random.default_rng(7).choice(bits, (120, 163))
    show_message(page, "flags", flags)
    painted = painted_flags(page)
    for bit, colour in FLAG_COLOURS.items():
        graver = list(FLAG_COLOURS)[: list(FLAG_COLOURS).index(bit)]
        shown = (flags & bit != 0) & (flags & sum(graver) == 0)
        expected = np.array([int(colour[at : at + 2], 16) for at in (0, 2, 4)] + [255])
        assert np.all(painted[shown] == expected)
    valid = painted[flags == 0]
    assert np.all(valid[:, 0] == valid[:, 1]), "grey"

    def count(name: str) -> int:
        cell = page.locator(f".legend [data-flag={name}] td").first.text_content()
        return int(str(cell).replace("\u202f", ""))

    assert count("valid") == np.sum(flags == 0)
    for bit, name in NAMES.items():
        assert count(name) == np.sum(flags & bit != 0)


def test_points_stand_where_their_pixels_look(page: Page, served: Served, watch: Watch) -> None:
    open_page(page)
    assert not any("Scene" in each for each in watch.requests), "loaded where it is shown"
    shows_frame(page, stop(served))
    choose(page, "sequence", "Points in space")
    page.locator("canvas[data-product=points][data-frame]").wait_for()
    assert any("Scene" in each for each in watch.requests)
    canvas = page.locator("canvas[data-product=points]")
    ranges = product(served, "range")
    expect(canvas).to_have_attribute("data-points", str(np.isfinite(ranges).sum()))
    aside = canvas_pixels_of_scene(page)
    look_at(page, "points")
    page.locator(".panel-points").get_by_label("Size of a point").select_option("6")
    page.get_by_role("button", name="Camera's eye").click()
    assert np.any(aside != canvas_pixels_of_scene(page))
    page.get_by_role("button", name="Shading").click()
    page.get_by_role("button", name="Grid").click()
    eye = canvas_pixels_of_scene(page)
    # seen from the camera, the cloud is the camera's own picture
    low, high = (float(str(canvas.get_attribute(f"data-{key}"))) for key in ("low", "high"))
    expected = map_colours(ranges, low, high, "viridis").astype(int)
    rows, columns = eye.shape[:2]
    scale = min(columns / 163, rows / 120)
    found = []
    for y in range(5, 115, 5):
        for x in range(5, 160, 5):
            at_x = round(columns / 2 + (x + 0.5 - 81.5) * scale)
            at_y = round(rows / 2 + (y + 0.5 - 60) * scale)
            around = expected[y - 2 : y + 3, x - 2 : x + 3, :3].reshape(-1, 3)
            nearest = np.abs(around - eye[at_y, at_x, :3].astype(int)).max(axis=1).min()
            found.append(nearest <= 8)
    assert np.mean(found) > 0.97
    # and a point is its pixel in all views
    box = canvas.bounding_box()
    assert box is not None
    scale = min(box["width"] / 163, box["height"] / 120)
    x, y = smoothest(ranges)
    place = (
        box["x"] + box["width"] / 2 + (x + 0.5 - 81.5) * scale,
        box["y"] + box["height"] / 2 + (y + 0.5 - 60) * scale,
    )
    page.mouse.move(*place)
    for signal in ("pointed", "selected"):
        page.wait_for_function(
            """([signal, x, y]) => { const pixel = transientcam.store[signal].peek();
                 return pixel !== null && Math.hypot(pixel.x - x, pixel.y - y) < 2; }""",
            arg=[signal, x, y],
        )
        page.mouse.click(*place)
    expect(page.locator(".scene-mark-selected")).to_be_visible()
    page.keyboard.down("Shift")
    page.mouse.click(*place)
    page.keyboard.up("Shift")
    expect(page.locator(".panel-points [data-pin=A]")).to_be_visible()


def smoothest(ranges: NDArray[Any]) -> tuple[int, int]:
    """Column and row of a pixel around which no point strays: none stands before another there."""
    places = [(x, y) for x in range(20, 140, 5) for y in range(20, 100, 5)]
    spread = [float(np.ptp(ranges[y - 10 : y + 11, x - 10 : x + 11])) for x, y in places]
    return places[int(np.argmin(np.nan_to_num(spread, nan=np.inf)))]


def test_points_turn_and_change_their_colours(page: Page, served: Served) -> None:
    show(page, served, "Points in space", "points")
    canvas = page.locator("canvas[data-product=points]")
    seen = [canvas_pixels_of_scene(page)]
    canvas.focus()
    page.keyboard.press("ArrowLeft")
    seen.append(canvas_pixels_of_scene(page))
    box = canvas.bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 100, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 160, middle + 20, steps=3)
    page.mouse.up()
    seen.append(canvas_pixels_of_scene(page))
    for colouring, shows in (
        ("light", "brightness"),
        ("validity", "flags"),
        ("flight", "coefficients"),
    ):
        look_at(page, "points")
        page.get_by_label("Colour by").select_option(colouring)
        expect(canvas).to_have_attribute("data-colouring", colouring)
        page.wait_for_function(f"() => transientcam.store.frames.of('{shows}').value !== null")
        seen.append(canvas_pixels_of_scene(page))
    # the wave runs over the points: where light arrives, they are brighter than before it came
    page.get_by_role("button", name="Grid").click()
    page.evaluate("() => void (transientcam.store.player.playing.value = false)")
    page.evaluate("() => transientcam.store.player.seek(0.02)")
    early = canvas_pixels_of_scene(page)
    page.evaluate("() => transientcam.store.player.seek(0.27)")
    assert np.mean(canvas_pixels_of_scene(page)[..., :3]) > 1.5 * np.mean(early[..., :3])
    for before, after in pairwise(seen):
        # where the panel was laid out anew meanwhile, the picture has another size
        assert before.shape != after.shape or np.any(before != after)


def canvas_pixels_of_scene(page: Page) -> NDArray[np.uint8]:
    """The points as a file of the page's own: WebGL can be read only in the task that drew it."""
    from PIL import Image

    with Image.open(io.BytesIO(downloaded(page, "points", "Picture (PNG)"))) as image:
        return np.array(image.convert("RGBA"))


def test_panels_are_moved_added_closed_and_resized_and_stay_so(page: Page, served: Served) -> None:
    open_page(page)

    def shown() -> list[str]:
        views: list[str] = page.locator("[data-view]").evaluate_all(
            "(all) => all.map((each) => each.dataset.view)"
        )
        return views

    assert shown() == ["transient", "map", "response", "sequence"]
    choose(page, "map", "Sequence and accuracy")
    assert shown() == ["transient", "sequence", "response", "map"]
    choose(page, "map", "Close")
    choose(page, "response", "Streak →")
    choose(page, "transient", "Validity ↓")
    for panel in ("validity", "streak"):  # what draws them is loaded when they are first shown
        page.locator(f".panel-{panel}").wait_for()
    assert shown() == ["transient", "validity", "sequence", "response", "streak"]
    splitter = page.get_by_role("separator", name="Width of the panels").first
    before = page.locator(".panel-validity").bounding_box()
    box = splitter.bounding_box()
    assert before is not None
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] - 150, box["y"] + 40, steps=4)
    page.mouse.up()
    narrower = page.locator(".panel-validity").bounding_box()
    assert narrower is not None
    assert narrower["width"] < before["width"] - 100
    splitter.focus()
    page.keyboard.press("ArrowRight")
    wider = page.locator(".panel-validity").bounding_box()
    assert wider is not None
    assert wider["width"] > narrower["width"]
    page.reload()
    for panel in ("validity", "streak"):
        page.locator(f".panel-{panel}").wait_for()
    assert shown() == ["transient", "validity", "sequence", "response", "streak"]
    again = page.locator(".panel-validity").bounding_box()
    assert again is not None
    assert again["width"] == pytest.approx(wider["width"], abs=1)
    choose(page, "response", "Show alone")
    assert shown() == ["response"]
    choose(page, "response", "Show all panels")
    expect(page.locator("[data-view]")).to_have_count(5)
