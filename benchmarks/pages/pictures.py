"""README's film and picture of the page, a notebook's, and pictures of all views.

The film is the page's own export, "Film of one pass (GIF)", in Chromium without a window, of the
simulated scene of mirrors with its noise; the picture is the page with the default sequence and its
front. The notebook is `notebooks/light_in_flight.py`, served by marimo.
"""

import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
from playwright.sync_api import Page, ViewportSize, sync_playwright

import transientcam_moments as tm
from benchmarks.common.records import ROOT
from tests.browser.dashboard import choose, open_page, point_at
from tests.serving import serving

FILM = "light-in-flight.gif"
PICTURE = "dashboard.png"
NOTEBOOK = "player.png"
# six harmonics make a thin front of light; eight takes, a quiet one
_FILMED: dict[str, Any] = {
    "base_frequency_hz": 20e6,
    "harmonics": 6,
    "zeroth": "estimated",
    "exposure_s": 0.0015,
    "takes": 8,
}
_LIVE: dict[str, Any] = {"harmonics": 4, "zeroth": "estimated", "exposure_s": 0.00192}
_SPEED_NS = "10"
_PATIENCE_MS = 300_000
_OF_THE_SEQUENCE = """
(m) => transientcam.store.frames.of("coefficients").peek()?.coefficients?.harmonics === m
"""
_NOTEBOOK = ROOT / "notebooks" / "light_in_flight.py"
_TURN = "0.25"
_PIXELS = ((62, 40), (110, 52))
_REGION = ((20, 20), (60, 70))
SIZES: tuple[ViewportSize, ...] = (
    {"width": 1440, "height": 900},
    {"width": 1920, "height": 1080},
    {"width": 390, "height": 844},
)


@contextmanager
def _page(sequence: dict[str, Any]) -> Iterator[Page]:
    """Give the page of a daemon of its own that measures with a sequence."""
    tm.kernels.compile([sequence["harmonics"]], ["float32"])  # "automatic" is as in a daemon then
    usual: dict[str, Any] = {"reconstruction": {"estimator": "automatic"}}
    executable = shutil.which("chromium")
    if executable is None:
        sys.exit("this needs Debian's chromium: apt-get install chromium")
    with (
        TemporaryDirectory() as recordings,
        serving("sim:mirrors", recordings={"directory": recordings}, **usual) as served,
        sync_playwright() as playwright,
    ):
        httpx.put(f"{served.url}/api/v1/sequence", json=sequence).raise_for_status()
        browser = playwright.chromium.launch(executable_path=executable)
        page = browser.new_page(viewport=SIZES[0], color_scheme="dark", reduced_motion="reduce")
        page.set_default_timeout(_PATIENCE_MS)
        # a laden machine is no thin link: pictures are of whole frames
        page.add_init_script("localStorage['transientcam.link.adapts'] = 'false'")
        open_page(page, f"{served.url}/?debug")
        page.wait_for_function(_OF_THE_SEQUENCE, arg=sequence["harmonics"])
        yield page
        browser.close()


def film(page: Page, path: Path) -> None:
    """Save the page's film of one pass of light."""
    page.get_by_role("tab", name="Last 1 ns").click()
    page.locator("canvas[data-play=gate]").wait_for()
    page.locator(".panel-transient").get_by_label("Speed").select_option(_SPEED_NS)
    with page.expect_download(timeout=_PATIENCE_MS) as download:
        choose(page, "transient", "Film of one pass (GIF)")
    download.value.save_as(path)


def predict(page: Page) -> None:
    """Have the front predicted, and show all panels again."""
    page.locator(".performance").click()
    page.locator(".accuracy[data-predicted=true]").wait_for()
    page.locator("[data-field=accuracy-status]:not(:has(progress))").wait_for()
    page.locator(".performance").click()
    page.mouse.move(0, 0)  # off the button


def picture(page: Page, path: Path) -> None:
    """Save the page itself, as it opens, once deviations of the pixel are known."""
    predict(page)
    page.locator(".returns [data-found=true] td:first-child small:not(:empty)").first.wait_for()
    page.screenshot(path=path)


def notebook(dashboard: Page, path: Path) -> None:
    """Save the player's cell of a notebook that marimo serves, beside a page of its camera."""
    browser = dashboard.context.browser
    assert browser is not None
    camera_url = dashboard.url.partition("/?")[0]
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "marimo", "run", "--headless", "--no-token"]
    command += ["--port", str(port), str(_NOTEBOOK), "--", "--url", camera_url]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as marimo:
        try:
            assert marimo.stdout is not None
            next(line for line in marimo.stdout if str(port) in line)
            page = browser.new_page(viewport=SIZES[0], color_scheme="light")
            page.set_default_timeout(_PATIENCE_MS)
            page.goto(f"http://127.0.0.1:{port}")
            page.locator("canvas[data-frame]").wait_for()
            page.get_by_role("slider", name="Time of flight").fill(_TURN)
            page.locator(".transientcam-player").screenshot(path=path)
        finally:
            marimo.terminate()
            marimo.communicate()  # it still prints


def views(page: Page, to: Path) -> None:
    """Save every layout and every view alone, with pins, a region and the front."""
    page.keyboard.down("Shift")
    for x, y in _PIXELS:
        point_at(page, "map", x, y, click=True)
    point_at(page, "map", *_REGION[0])
    page.mouse.down()
    point_at(page, "map", *_REGION[1])
    page.mouse.up()
    page.keyboard.up("Shift")
    predict(page)
    shown: list[dict[str, str]] = page.evaluate(
        "() => [...transientcam.layouts.map((layout) => ({ layout, view: '' })),"
        " ...transientcam.views.map((view) => ({ layout: 'Overview', view }))]"
    )
    for size, scheme, each in product(SIZES, ("light", "dark"), shown):
        page.set_viewport_size(size)
        page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
        page.evaluate("({ layout, view }) => transientcam.arrange(layout, view)", each)
        page.wait_for_function(_DRAWN)
        name = each["view"] or each["layout"].lower().replace(" ", "-")
        page.screenshot(path=to / f"{size['width']}x{size['height']}-{scheme}-{name}.png")


# every picture has its frame, and nothing waits for one
_DRAWN = """
() => [
    ...document.querySelectorAll(".stage [data-product], .streak-picture canvas, .points canvas"),
  ]
    .every((each) => "frame" in each.dataset)
  && ![...document.querySelectorAll(".stage-empty")]
    .some((each) => /Waiting|Loading/.test(each.textContent))
  && new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))
"""


def draw(figures: Path, *, to: Path | None = None) -> None:
    """Write the film and the pictures to docs/figures, or to a folder."""
    folder = to or figures
    folder.mkdir(parents=True, exist_ok=True)
    with _page(_FILMED) as page:
        film(page, folder / FILM)
    with _page(_LIVE) as page:
        picture(page, folder / PICTURE)
        notebook(page, folder / NOTEBOOK)


def draw_views(*, to: Path) -> None:
    """Write pictures of every layout and view, light and dark, on three sizes of screens."""
    to.mkdir(parents=True, exist_ok=True)
    with _page(_LIVE) as page:
        views(page, to)
