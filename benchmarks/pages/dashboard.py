"""The page in a browser: pictures a second, processor time, memory.

The light plays, first with the camera stopped and then while frames stream, and is moved along the
timeline by hand, in Chromium without a graphics processor; daemon, simulation and page share the
machine.
"""

import contextlib
import shutil
import time
from collections.abc import Iterator

import httpx
import numpy as np
import psutil
from playwright.sync_api import Page, sync_playwright

import transientcam_moments as tm
from benchmarks.common.tables import Cell, Column, Table, heads
from tests.browser.dashboard import open_page
from tests.serving import serving

# Pictures of the light and frames that the page drew, both a second.
_COUNT_PICTURES = """
(span_s) => new Promise((done) => {
  const { store } = transientcam;
  const read = () => [store.player.turn.peek(), store.frames.of("coefficients").peek().meta.frame];
  const start = performance.now();
  let [pictures, frames, [turn, frame]] = [0, 0, read()];
  const count = (now) => {
    const [nextTurn, nextFrame] = read();
    if (nextTurn !== turn) pictures += 1;
    if (nextFrame !== frame) frames += 1;
    [turn, frame] = [nextTurn, nextFrame];
    if (now - start < 1000 * span_s) requestAnimationFrame(count);
    else done([pictures, frames].map((each) => (1000 * each) / (now - start)));
  };
  requestAnimationFrame(count);
})
"""
# The timeline is held, and moved to another place before each refresh of the screen, until it is
# let go.
_HOLD_TIMELINE = """
() => {
  const slider = document.querySelector(".timeline input");
  const tell = (kind) => slider.dispatchEvent(new PointerEvent(kind, { bubbles: true }));
  let held = true;
  tell("pointerdown");
  const move = () => {
    slider.valueAsNumber = (slider.valueAsNumber + 0.003) % 1;
    slider.dispatchEvent(new InputEvent("input", { bubbles: true }));
    if (held) requestAnimationFrame(move);
  };
  requestAnimationFrame(move);
  window.letGo = () => { held = false; tell("pointerup"); };
}
"""
_VIDEO_HZ = 18.6  # the paper's video setting
_LOOK_EVERY_MS = 15_000
_ORDERS = (3, 4, 8)
_SENSORS = ("163x120", "640x480")
_SETTLING_MS = 15_000  # the page finds out within it how many frames it can take
_PATIENCE_S = 120.0  # a laden machine answers in its own time


def _browser_s() -> float:
    """Return the processor time of the browser, without the compilers and drivers beside it."""
    total = 0.0
    for process in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):  # it ended meanwhile
            if process.name() == "chromium":
                times = process.cpu_times()
                total += times.user + times.system
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


def measure(page: Page, url: str, *, harmonics: int, span_s: float) -> tuple[Cell, ...]:
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
    page.wait_for_function("() => transientcam.store.status.running.peek() === false")
    still_hz, _ = page.evaluate(_COUNT_PICTURES, span_s)
    _run(url, running=True)
    page.wait_for_function("() => transientcam.store.status.running.peek() === true")
    page.wait_for_timeout(_SETTLING_MS)
    before_s, begin_s, first = _browser_s(), time.monotonic(), page.evaluate(_NEWEST)
    streaming_hz, drawn_hz = page.evaluate(_COUNT_PICTURES, span_s)
    took_s = time.monotonic() - begin_s  # a laden page begins and answers late
    used_s, frames = _browser_s() - before_s, page.evaluate(_NEWEST) - first
    asked_for, heap_mb = _asked_for(page), _heap_mb(page)
    page.evaluate(_HOLD_TIMELINE)
    page.wait_for_timeout(_SETTLING_MS)
    by_hand_hz, _ = page.evaluate(_COUNT_PICTURES, span_s)
    page.evaluate("() => letGo()")
    size = page.locator("canvas[data-product=transient]").evaluate(
        "(canvas) => `${canvas.width} x ${canvas.height}`"
    )
    drawn = f"{drawn_hz:.1f} of {frames / took_s:.1f}"
    cores = used_s / took_s
    return size, harmonics, still_hz, streaming_hz, by_hand_hz, drawn, asked_for, cores, heap_mb


def _asked_for(page: Page) -> str:
    """Return the header's words for what the page asks for."""
    sign = page.locator("[data-field=link]")
    return (sign.text_content() or "").replace("\u202f", " ") if sign.count() else "all"


_NEWEST = "() => transientcam.store.status.newest.peek().frame"


def endurance(page: Page, url: str, *, frames: int) -> Table:
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
    note = (
        f"{seen[-1][0]} frames, of which an hour has {_VIDEO_HZ * 3600:.0f} at the video setting, "
        f"captured at {applied['frame_rate_hz']:.1f} Hz and shown from a stream of {rate_hz:.1f} "
        f"Hz. Slope over the last three quarters: {1e3 * slope_mb * _VIDEO_HZ * 3.6:+.3f} MB "
        "in as many frames as an hour has."
    )
    heads = ("after frames", *(Column(str(count), ".2f") for count, _ in marks))
    return Table("Memory", heads, [("heap after collecting, MB", *(mb for _, mb in marks))], [note])


def tables(
    *,
    span_s: float = 8.0,
    sensors: tuple[str, ...] = _SENSORS,
    harmonics: tuple[int, ...] = _ORDERS,
    hours: float = 0.1,
) -> Iterator[Table]:
    """Measure sizes and orders, each for so long; follow the memory over so many hours of video."""
    columns = heads(
        "sensor | m | pictures/s, still:.1f | streaming:.1f | by hand:.1f | frames/s drawn | "
        "asked for | cores of the browser:.2f | heap, MB:.1f"
    )
    table = Table("", columns)
    tm.kernels.compile(harmonics, ["float32"])  # not beside what is measured
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(1e3 * _PATIENCE_S)
        for sensor in sensors:
            width, height = sensor.split("x")
            with serving(f"sim:mirrors?width={width}&height={height}") as served:
                for m in harmonics:
                    table.rows.append(measure(page, served.url, harmonics=m, span_s=span_s))
                    print(*table.rows[-1], flush=True)
                page.goto("about:blank")
        yield table
        if hours:
            with serving("sim:mirrors") as served:
                yield endurance(page, served.url, frames=round(hours * _VIDEO_HZ * 3600))
                page.goto("about:blank")
        chromium.close()
