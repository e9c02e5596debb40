"""Make README's film and picture of the page. ``python -m benchmarks.pictures``.

They are written to docs/figures. The film is the page's own export, "Film of one pass (GIF)", in
Chromium without a window, of the simulated scene of mirrors with its noise; the picture is the page
after it.
"""

import argparse
import shutil
import sys
from pathlib import Path
from typing import Any

import httpx
from playwright.sync_api import Page, ViewportSize, sync_playwright

from tests.browser.dashboard import choose, open_page
from tests.serving import serving

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
FILM = "light-in-flight.gif"
PICTURE = "dashboard.png"
# six harmonics make a thin front of light; eight takes, a quiet one
_SEQUENCE: dict[str, Any] = {
    "base_frequency_hz": 20e6,
    "harmonics": 6,
    "zeroth": "estimated",
    "exposure_s": 0.0015,
    "takes": 8,
}
_SPEED_NS = "10"
_PATIENCE_MS = 300_000
_OF_THE_SEQUENCE = """
(m) => transientcam.store.frames.of("coefficients").peek()?.coefficients?.harmonics === m
"""
_SIZE: ViewportSize = {"width": 1440, "height": 900}


def film(page: Page, path: Path) -> None:
    """Save the page's film of one pass of light."""
    page.get_by_role("tab", name="Last 1 ns").click()
    page.locator("canvas[data-play=gate]").wait_for()
    page.locator(".panel-transient").get_by_label("Speed").select_option(_SPEED_NS)
    with page.expect_download(timeout=_PATIENCE_MS) as download:
        choose(page, "transient", "Film of one pass (GIF)")
    download.value.save_as(path)


def picture(page: Page, path: Path) -> None:
    """Save the page itself, at an arrival of light, once deviations of the pixel are known."""
    page.keyboard.press("n")
    page.locator(".returns [data-found=true] td:first-child small:not(:empty)").first.wait_for()
    page.screenshot(path=path)


def main(arguments: list[str] | None = None) -> None:
    """Write both."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pictures", description=__doc__)
    parser.add_argument("--to", type=Path, default=FIGURES, help="directory of the pictures")
    to: Path = parser.parse_args(arguments).to
    executable = shutil.which("chromium")
    if executable is None:
        sys.exit("this needs Debian's chromium: apt-get install chromium")
    to.mkdir(parents=True, exist_ok=True)
    with serving("sim:mirrors") as served, sync_playwright() as playwright:
        httpx.put(f"{served.url}/api/v1/sequence", json=_SEQUENCE).raise_for_status()
        browser = playwright.chromium.launch(executable_path=executable)
        page = browser.new_page(viewport=_SIZE, color_scheme="dark", reduced_motion="reduce")
        page.set_default_timeout(_PATIENCE_MS)
        open_page(page, f"{served.url}/?debug")
        page.wait_for_function(_OF_THE_SEQUENCE, arg=_SEQUENCE["harmonics"])
        film(page, to / FILM)
        picture(page, to / PICTURE)
        browser.close()


if __name__ == "__main__":
    main()
