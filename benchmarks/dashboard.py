"""Measure the page: pictures a second, processor time, memory. ``python -m benchmarks.dashboard``.

The light plays, first with the camera stopped and then while frames stream, in Chromium's software
renderer; daemon, simulation and page share the machine. Prints a Markdown table.
"""

import argparse
import os
import shutil
from pathlib import Path

import httpx
from playwright.sync_api import Page, sync_playwright

from tests.browser.dashboard import open_page
from tests.serving import serving

_COUNT_PICTURES = """
(span_s) => new Promise((done) => {
  const start = performance.now();
  let [pictures, last] = [0, transientcam.store.player.turn.peek()];
  const count = (now) => {
    const turn = transientcam.store.player.turn.peek();
    if (turn !== last) [pictures, last] = [pictures + 1, turn];
    if (now - start < 1000 * span_s) requestAnimationFrame(count);
    else done((1000 * pictures) / (now - start));
  };
  requestAnimationFrame(count);
})
"""
_TICKS_S = os.sysconf("SC_CLK_TCK")


def _descendants(pid: int) -> set[int]:
    """Return the processes below ``pid``."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        parents[int(stat.parent.name)] = int(fields[1])
    found: set[int] = set()
    new = {pid}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return found


def _processor_s(pids: set[int]) -> float:
    """Return the processor time that processes have used."""
    total = 0.0
    for pid in pids:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / _TICKS_S
    return total


def _heap_mb(page: Page) -> float:
    """Return the memory of the page's scripts after collecting what nobody holds."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")
    session.detach()
    return float(used["usedSize"] + used.get("backingStorageSize", 0)) / 1e6


def _run(url: str, *, running: bool) -> None:
    """Start or stop the camera."""
    httpx.put(f"{url}/api/v1/acquisition", json={"running": running}).raise_for_status()


def measure(page: Page, url: str, *, harmonics: int, span_s: float) -> str:
    """Return the row of the table for one order."""
    document = httpx.get(f"{url}/api/v1/sequence").json()
    known = ("takes", "sub_phases")
    wanted = {name: document[name] for name in known} | {
        "harmonics": harmonics,
        "exposure_s": 0.0005,
        "zeroth": "estimated",
        "base_frequency_hz": 15e6,  # eight times more would be beyond the device
    }
    httpx.put(f"{url}/api/v1/sequence", json=wanted).raise_for_status()
    _run(url, running=True)
    open_page(page, f"{url}/?debug")
    page.wait_for_function(
        "(m) => transientcam.store.frames.of('coefficients').peek()?.coefficients?.harmonics === m",
        arg=harmonics,
    )
    page.evaluate("() => { transientcam.store.player.playing.value = true; }")
    _run(url, running=False)
    still_hz = page.evaluate(_COUNT_PICTURES, span_s)
    _run(url, running=True)
    page.wait_for_function("() => transientcam.store.status.running.peek() === true")
    browser = _descendants(os.getpid())
    before_s = _processor_s(browser)
    first = page.evaluate(_NEWEST)
    streaming_hz = page.evaluate(_COUNT_PICTURES, span_s)
    used_s = _processor_s(browser) - before_s
    frames = page.evaluate(_NEWEST) - first
    width, height = page.locator("canvas[data-product=transient]").evaluate(
        "(canvas) => [canvas.width, canvas.height]"
    )
    return (
        f"| {width} x {height} | {harmonics} | {still_hz:.1f} | {streaming_hz:.1f} "
        f"| {frames / span_s:.1f} | {used_s / span_s:.2f} | {_heap_mb(page):.1f} MB |"
    )


_NEWEST = "() => transientcam.store.status.newest.peek().frame"


def main() -> None:
    """Measure every size and order, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--span-s", type=float, default=8.0, help="length of each measurement")
    span_s = parser.parse_args().span_s
    print("| sensor | m | pictures/s, still | streaming | frames/s | cores of the browser | heap |")
    print("|---|---|---|---|---|---|---|")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        for width, height in ((163, 120), (640, 480)):
            with serving(f"sim:mirrors?width={width}&height={height}") as served:
                for harmonics in (3, 4, 8):
                    print(measure(page, served.url, harmonics=harmonics, span_s=span_s), flush=True)
                page.goto("about:blank")
        chromium.close()


if __name__ == "__main__":
    main()
