"""Measure the page: pictures a second, processor time, memory. ``python -m benchmarks.dashboard``.

The light plays, first with the camera stopped and then while frames stream, in Chromium's software
renderer; daemon, simulation and page share the machine. ``--hours 1`` lets it play for as many
frames as the video setting gives in that time, as fast as the camera can, and follows its memory.
``--write`` writes docs/dashboard.md.
"""

import argparse
import os
import shutil
import sys
import time
from pathlib import Path

import httpx
import numpy as np
from playwright.sync_api import Page, sync_playwright

from benchmarks.machine import machine
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
PAGE = Path(__file__).parents[1] / "docs" / "dashboard.md"
_VIDEO_HZ = 18.6  # the paper's video setting
_LOOK_EVERY_MS = 15_000
_PATIENCE_S = 120.0  # a laden machine answers in its own time
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
    """Return the memory of the page's scripts after a garbage collection."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")
    session.detach()
    return float(used["usedSize"] + used.get("backingStorageSize", 0)) / 1e6


def _run(url: str, *, running: bool) -> None:
    """Start or stop the camera."""
    httpx.put(
        f"{url}/api/v1/acquisition", json={"running": running}, timeout=_PATIENCE_S
    ).raise_for_status()


def measure(page: Page, url: str, *, harmonics: int, span_s: float) -> str:
    """Return the row of the table for one order."""
    document = httpx.get(f"{url}/api/v1/sequence", timeout=_PATIENCE_S).json()
    known = ("takes", "sub_phases")
    wanted = {name: document[name] for name in known} | {
        "harmonics": harmonics,
        "exposure_s": 0.0005,
        "zeroth": "estimated",
        "base_frequency_hz": 15e6,  # eight times more would be beyond the device
    }
    httpx.put(f"{url}/api/v1/sequence", json=wanted, timeout=_PATIENCE_S).raise_for_status()
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


def endurance(page: Page, url: str, *, frames: int) -> list[str]:
    """Return a table of the page's memory over so many frames."""
    quickest = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0001}
    answer = httpx.put(f"{url}/api/v1/sequence", json=quickest, timeout=_PATIENCE_S)
    applied = answer.raise_for_status().json()
    open_page(page, f"{url}/?debug")
    page.evaluate("() => { transientcam.store.player.playing.value = true; }")
    first, begin_s = page.evaluate(_NEWEST), time.monotonic()
    seen: list[tuple[int, float]] = []
    while not seen or seen[-1][0] < frames:
        page.wait_for_timeout(_LOOK_EVERY_MS)
        seen.append((page.evaluate(_NEWEST) - first, _heap_mb(page)))
        print(f"{seen[-1][0]} frames, {seen[-1][1]:.1f} MB", flush=True)
    settled = np.array(seen[len(seen) // 4 :])  # caches fill at first
    slope_mb, _ = np.polyfit(settled[:, 0], settled[:, 1], 1)
    marks = [seen[round(share * (len(seen) - 1))] for share in (0, 0.25, 0.5, 0.75, 1)]
    rate_hz = seen[-1][0] / (time.monotonic() - begin_s)
    return [
        "| after frames | " + " | ".join(str(count) for count, _ in marks) + " |",
        "|---|" + "---:|" * len(marks),
        "| heap after collecting | " + " | ".join(f"{mb:.2f} MB" for _, mb in marks) + " |",
        "",
        f"{seen[-1][0]} frames, of which an hour has {_VIDEO_HZ * 3600:.0f} at the video setting, "
        f"captured at {applied['frame_rate_hz']:.1f} Hz and shown from a stream of {rate_hz:.1f} "
        f"Hz. Slope over the last three quarters: {1e3 * slope_mb * _VIDEO_HZ * 3.6:+.3f} MB "
        "in as many frames as an hour has.",
    ]


def main() -> None:
    """Measure every size and order, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--span-s", type=float, default=8.0, help="length of each measurement")
    parser.add_argument("--hours", type=float, default=0.0, help="of video, to follow the memory")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name} anew")
    arguments = parser.parse_args()
    lines = [
        "| sensor | m | pictures/s, still | streaming | frames/s | cores of the browser | heap |",
        "|---|---|---|---|---|---|---|",
    ]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(1e3 * _PATIENCE_S)
        for width, height in ((163, 120), (640, 480)):
            with serving(f"sim:mirrors?width={width}&height={height}") as served:
                for harmonics in (3, 4, 8):
                    row = measure(page, served.url, harmonics=harmonics, span_s=arguments.span_s)
                    lines.append(row)
                    print(row, flush=True)
                page.goto("about:blank")
        if arguments.hours:
            with serving("sim:mirrors") as served:
                frames = round(arguments.hours * _VIDEO_HZ * 3600)
                lines += ["", "## Memory", "", *endurance(page, served.url, frames=frames)]
                page.goto("about:blank")
        chromium.close()
    print("\n".join(lines))
    if arguments.write:
        command = " ".join(["python -m benchmarks.dashboard", *sys.argv[1:]])
        PAGE.write_text("\n".join([*_head(command), *lines, ""]), encoding="utf-8")


def _head(command: str) -> list[str]:
    return [
        "# What the dashboard takes",
        "",
        f"Written by `{command}` on: {machine()}.",
        "",
        "Light in flight plays in Chromium's software renderer (no GPU), first with the camera",
        "stopped, then while frames of 12, 16 or 32 images stream; daemon, simulation and page",
        "share the machine. The heap is that of the page's scripts after collecting.",
        "",
    ]


if __name__ == "__main__":
    main()
