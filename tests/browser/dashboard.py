"""The page as a test sees it: its pictures as arrays, its figures as text."""

import base64
import io
import re
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Locator, Page

# The words of a camera whose frames come; on a laden machine they may come slowly.
LIVE = re.compile("^Live")

# A canvas by way of a 2D copy: one of WebGL can be read only in the task that drew it.
_READ_CANVAS = """
(canvas) => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  copy.getContext("2d").drawImage(canvas, 0, 0);
  return copy.toDataURL("image/png").split(",")[1];
}
"""


def _image(png: str) -> NDArray[np.uint8]:
    with Image.open(io.BytesIO(base64.b64decode(png))) as image:
        return np.array(image.convert("RGBA"))


def map_canvas(page: Page) -> Locator:
    """The canvas of the map view."""
    return page.locator(".panel-map .stage canvas[data-product]")


def transient_canvas(page: Page) -> Locator:
    """The canvas of the light in flight."""
    return page.locator("canvas[data-product=transient]")


def open_page(page: Page, path: str = "/?debug") -> None:
    """Open the dashboard and wait until both pictures show a frame."""
    page.goto(path)
    page.locator(".panel-map canvas[data-frame]").wait_for()
    page.locator("canvas[data-product=transient][data-frame]").wait_for()
    if "debug" in path:
        page.wait_for_function("() => 'transientcam' in window")


def shows_frame(page: Page, frame: int) -> None:
    """Wait until both pictures show this frame."""
    page.wait_for_function(
        """(frame) => [".panel-map .stage canvas[data-product]", "canvas[data-product=transient]"]
             .every((each) => document.querySelector(each)?.dataset.frame === String(frame))""",
        arg=frame,
    )


def map_pixels(page: Page) -> NDArray[np.uint8]:
    """RGBA of the map as it is drawn, (H, W, 4)."""
    return canvas_pixels(map_canvas(page))


def canvas_pixels(canvas: Locator) -> NDArray[np.uint8]:
    """RGBA of a canvas as it is drawn, (H, W, 4)."""
    return _image(canvas.evaluate(_READ_CANVAS))


def transient_pixels(page: Page, turn: float) -> NDArray[np.uint8]:
    """RGBA of the light after a share of the period, (H, W, 4)."""
    return _image(
        transient_canvas(page).evaluate(
            "(canvas, turn) => { transientcam.store.player.seek(turn === 0.5 ? 0.4 : 0.5);"
            f"transientcam.store.player.seek(turn); return ({_READ_CANVAS})(canvas); }}",
            turn,
        )
    )


def shown_density(page: Page, phase_rad: float) -> tuple[str, NDArray[np.float64]]:
    """The renderer and the numbers behind its picture: b_0 units per second, flat."""
    reading = page.evaluate("(phase) => transientcam.shownDensity(phase)", phase_rad)
    return reading["renderer"], _numbers(reading["values"])


def density_of(page: Page, body: bytes, phase_rad: float) -> tuple[str, NDArray[np.float64]]:
    """The same for a frame message of coefficients."""
    reading = page.evaluate(
        "([text, phase]) => transientcam.density("
        "Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer, phase)",
        [base64.b64encode(body).decode(), phase_rad],
    )
    return reading["renderer"], _numbers(reading["values"])


def _numbers(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values])


def point_at(page: Page, picture: str, x: int, y: int, *, click: bool = False) -> None:
    """Move the pointer to the middle of a pixel of a view's picture.

    The pointer follows where the page is laid out anew meanwhile.
    """
    canvas = page.locator(f".panel-{picture} .stage canvas[data-product]")
    before = None
    while (box := canvas.bounding_box()) != before:
        assert box is not None
        width, height = canvas.evaluate("(each) => [each.width, each.height]")
        at = (
            box["x"] + (x + 0.5) / width * box["width"],
            box["y"] + (y + 0.5) / height * box["height"],
        )
        page.mouse.move(*at)
        before = box
    if click:
        page.mouse.click(*at)


def read_at(page: Page, x: int, y: int, *names: str) -> list[str]:
    """Point at a pixel of the map until it is read, and return figures of the same moment.

    What moves under the pointer takes the pixel away.
    """
    readout = page.locator(".panel-map")
    while True:
        point_at(page, "map", x, y)
        pixel, *figures = readout.evaluate(
            "(map, names) => names.map((n) => map.querySelector(`[data-field=${n}]`).textContent)",
            ["pixel", *names],
        )
        if pixel == f"{x}, {y}" and "–" not in figures:
            return [_plain(each) for each in figures]


def drop(page: Page, name: str, content: str | bytes) -> None:
    """Hold a file over the page and drop it there."""
    body = content.encode() if isinstance(content, str) else content
    carried = page.evaluate_handle(
        """([name, text]) => { const carried = new DataTransfer();
             carried.items.add(new File([Uint8Array.from(atob(text), (each) =>
               each.charCodeAt(0))], name)); return carried; }""",
        [name, base64.b64encode(body).decode()],
    )
    page.dispatch_event("body", "dragover", {"dataTransfer": carried})
    page.locator(".file-drop").wait_for()
    page.dispatch_event("body", "drop", {"dataTransfer": carried})


def text(page: Page, panel: str, name: str) -> str:
    """A figure of a view, without the thin spaces before its unit and between thousands."""
    shown = page.locator(f"{panel} [data-field={name}]").first.text_content()
    return _plain(shown or "")


def _plain(shown: str) -> str:
    return shown.replace("\u202f", " ").replace("\u2212", "-")


# what the page paints below and above a scale
BEYOND = {
    "viridis": ((0x1C, 0x00, 0x29), (0xFF, 0xFB, 0xD5)),
    "cividis": ((0x00, 0x09, 0x14), (0xFF, 0xFA, 0xC9)),
    "gray": ((0x0B, 0x2A, 0x55), (0xFF, 0xC9, 0xB0)),
    "coolwarm": ((0x1A, 0x23, 0x70), (0x6B, 0x00, 0x19)),
}


def map_colours(values: NDArray[Any], low: float, high: float, name: str) -> NDArray[np.uint8]:
    """RGBA of a map, (..., 4): as `colours`, with colours of their own beyond the limits."""
    painted = colours(values, low, high, name)
    under, over = BEYOND[name]
    painted[values.astype(np.float64) < low] = (*under, 255)
    painted[values.astype(np.float64) > high] = (*over, 255)
    return painted


def colours(values: NDArray[Any], low: float, high: float, name: str) -> NDArray[np.uint8]:
    """RGBA that matplotlib gives the values, (..., 4); clear where there is no value."""
    places = np.clip((values.astype(np.float64) - low) / (high - low), 0.0, 1.0)
    # matplotlib's maps have 256 colours, each for as much of the scale
    table = np.round(matplotlib.colormaps[name](np.arange(256)) * 255).astype(np.uint8)
    levels = np.minimum(np.nan_to_num(places * 256), 255).astype(int)
    painted: NDArray[np.uint8] = np.where(np.isnan(places)[..., None], 0, table[levels])
    return painted


def choose_from(place: Page | Locator, menu: str, action: str) -> None:
    """Choose an entry of a menu by the menu's name and its own."""
    place.get_by_role("button", name=menu).click()
    place.get_by_role("menuitem", name=action, exact=True).click()


def look_at(page: Page, panel: str) -> None:
    """Open what there is to choose of a picture's look."""
    page.get_by_role("button", name=f"Look of the {panel}", exact=True).click()


def choose(page: Page, panel: str, action: str) -> None:
    """Choose from the menu of a panel."""
    choose_from(page.locator(f".panel-{panel}"), f"Panel {panel}", action)
