import io
import re
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch, put
from tests.browser.dashboard import (
    LIVE,
    choose,
    choose_from,
    drop,
    map_canvas,
    map_colours,
    map_pixels,
    open_page,
    point_at,
    shows_frame,
)
from tests.serving import Served

PANEL = ".panel-recordings"

# a camera no two frames of which are alike
pytestmark = pytest.mark.shared_daemon("sim:mirrors?seed=11")


def show(page: Page) -> None:
    open_page(page)
    choose(page, "response", "Recordings")


def recordings(served: Served) -> list[dict[str, Any]]:
    listed: list[dict[str, Any]] = httpx.get(f"{served.url}/api/v1/recordings").json()["recordings"]
    return listed


def record(served: Served, *, frames: int, name: str = "corner") -> str:
    """A finished recording, made by another client than the page."""
    url = f"{served.url}/api/v1/recordings"
    started = httpx.post(url, json={"name": name, "frames": frames}).raise_for_status().json()
    recording: str = started["id"]
    while httpx.get(f"{url}/{recording}").json()["state"] != "complete":
        httpx.get(f"{served.url}/api/v1/frames/latest", params={"wait_s": 0.2, "after": 10**9})
    return recording


def recorded(served: Served, recording: str, frame: int, product: str) -> NDArray[Any]:
    url = f"{served.url}/api/v1/recordings/{recording}/frames/{frame}/{product}.npy"
    array: NDArray[Any] = np.load(io.BytesIO(httpx.get(url, timeout=60).raise_for_status().content))
    return array


def shows_recorded(page: Page, frame: int) -> None:
    expect(page.locator(".replay")).to_have_attribute("data-frame", str(frame))


def test_now_is_compared_with_a_recording_by_two_clicks_and_with_a_kept_frame(
    page: Page, served: Served
) -> None:
    recording = record(served, frames=2, name="yesterday")
    open_page(page)
    put(served, "acquisition", {"running": False})
    number: int = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    shows_frame(page, number)
    page.keyboard.press("h")  # its errors are of this very frame then
    panel, canvas = page.locator(".panel-map"), map_canvas(page)
    panel.get_by_role("button", name="Compare the map").click()
    panel.get_by_role("button", name="yesterday").click()
    page.locator("canvas[data-product=range-difference]").wait_for()
    expect(panel.locator("[data-field=beyond]")).to_contain_text("%")
    point_at(page, "map", 80, 60, click=True)

    def numbers(frame: str, product: str) -> NDArray[Any]:
        url = f"{served.url}/api/v1{frame.replace('?', f'/{product}.npy?')}"
        answer = httpx.get(url, timeout=60).raise_for_status()
        array: NDArray[Any] = np.load(io.BytesIO(answer.content))
        return array

    now, then = f"/frames/{number}?", f"/recordings/{recording}/frames/1?reconstruction=current"
    (a, b), (error_a, error_b), (trust_a, trust_b) = (
        [numbers(frame, product) for frame in (now, then)]
        for product in ("range", "range_error", "trust")
    )
    difference = a - b
    low, high = (float(canvas.get_attribute(f"data-{end}") or "") for end in ("low", "high"))
    assert low == -high
    trusted = (trust_a == 0) & (trust_b == 0)
    meant = trusted & (np.abs(difference) > np.hypot(error_a, error_b))
    expected = map_colours(difference, low, high, "coolwarm")
    expected[~meant & np.isfinite(difference)] = (0x7D, 0x7D, 0x7D, 255)
    np.testing.assert_allclose(map_pixels(page).astype(int), expected, atol=6)
    share = meant.sum() / (trusted & np.isfinite(difference + error_a + error_b)).sum()
    expect(panel.locator("[data-field=beyond]")).to_contain_text(f"{100 * share:.0f}\u202f% of")
    expect(panel.locator("[data-field=b]")).to_have_text(f"B {b[60, 80]:.3f}\u202fm")

    # both under the limits of both
    panel.get_by_role("tab", name="B", exact=True).click()
    page.locator("canvas[data-product=range]").wait_for()
    low, high = (float(canvas.get_attribute(f"data-{end}") or "") for end in ("low", "high"))
    expected = map_colours(b, low, high, "viridis")
    np.testing.assert_allclose(map_pixels(page).astype(int), expected, atol=6)
    panel.get_by_role("tab", name="Wipe").click()
    page.locator(f".panel-map canvas[data-frame='{number}']").wait_for()
    point_at(page, "map", 80, 60)
    expected = map_colours(np.where(np.arange(163) < 80, a, b), low, high, "viridis")
    np.testing.assert_allclose(map_pixels(page).astype(int), expected, atol=6)
    panel.get_by_label("Frame of B").press("End")
    expect(panel.locator("[data-field=source]")).to_contain_text("yesterday, frame 2")

    # a frame that is kept outlives the page
    panel.get_by_role("button", name="Compare the map").click()
    panel.get_by_label("Name").fill("before lunch")
    panel.get_by_role("button", name="Keep this frame").click()
    expect(panel.locator("[data-field=source]")).to_contain_text("before lunch")
    open_page(page)
    panel.get_by_role("button", name="Compare the map").click()
    panel.get_by_role("button", name="before lunch", exact=True).click()
    point_at(page, "map", 80, 60)
    expect(panel.locator("[data-field=difference]")).to_have_text(
        re.compile("^A \u2212 B 0\u202fm")
    )
    panel.get_by_role("button", name="Compare the map").click()
    panel.get_by_role("button", name="Remove before lunch").click()
    expect(panel.get_by_role("button", name="before lunch")).to_have_count(0)


def test_a_recording_is_started_watched_and_stopped(page: Page, served: Served) -> None:
    show(page)
    panel = page.locator(PANEL)
    expect(panel).to_contain_text("Nothing was recorded yet.")
    panel.get_by_label("Name", exact=True).fill("corner at 3 m")
    panel.get_by_label("Duration").fill("no")
    expect(panel.get_by_role("button", name="Record", exact=True)).to_be_disabled()
    panel.get_by_label("Duration").fill("600")
    panel.get_by_role("button", name="Record", exact=True).click()
    expect(panel.locator("[data-field=recording-duration]")).to_contain_text("of 10:00")
    expect(page.locator("[data-field=recording-sign]")).to_be_visible()
    expect(panel.locator("[data-field=recording-frames]")).to_have_text(re.compile(r"^[1-9]"))
    assert recordings(served)[0]["limits"]["duration_s"] == 600
    panel.get_by_role("button", name="Stop recording").click()
    row = panel.locator("[data-recording]")
    expect(row).to_contain_text("corner at 3 m")
    expect(page.locator("[data-field=recording-sign]")).to_have_count(0)
    reported = recordings(served)[0]
    assert (reported["state"], reported["reason"]) == ("complete", "stopped")
    expect(row.locator("[data-field=frames]")).to_have_text(f"{reported['frames']} frames")
    expect(row.locator("[data-field=size]")).to_have_text(re.compile(r"^\d+(\.\d+)?\u202f[kM]B$"))
    expect(page.locator(".toast", has_text="The recording stopped.")).to_be_visible()


def test_what_just_happened_is_saved(page: Page, served: Served) -> None:
    show(page)
    page.get_by_role("button", name="Save the last 10 s").click()
    expect(page.locator(f"{PANEL} [data-recording]")).to_have_count(1)
    saved = recordings(served)[0]
    assert saved["state"] == "complete"
    listed = httpx.get(f"{served.url}/api/v1/recordings/{saved['id']}/frames").json()
    assert listed["host_time_s"] < saved["started_s"]


def test_a_recording_is_annotated_downloaded_and_deleted(
    page: Page, served: Served, watch: Watch
) -> None:
    recording = record(served, frames=2)
    url = f"{served.url}/api/v1/recordings/{recording}"
    show(page)
    row = page.locator(f"{PANEL} [data-recording]")
    choose_from(row, "More of corner", "Notes…")
    dialog = page.get_by_role("dialog", name="Notes on corner")
    dialog.get_by_label("Name of line 1").fill("sample")
    dialog.get_by_label("Text of line 1").fill("white paint")
    dialog.get_by_role("button", name="Add a line").click()
    dialog.get_by_label("Name of line 2").fill("distance_m")
    dialog.get_by_label("Text of line 2").fill("3.5")
    dialog.get_by_role("button", name="Save").click()
    expect(row).to_contain_text("sample: white paint · distance_m: 3.5")
    assert httpx.get(url).json()["annotations"] == {"sample": "white paint", "distance_m": 3.5}
    with page.expect_download() as download:
        row.get_by_role("button", name="Download corner").click()
    assert download.value.suggested_filename == f"corner-{recording}.h5"
    assert Path(download.value.path()).read_bytes() == httpx.get(f"{url}/file").content
    # the file that was downloaded, dropped on the page, is found among the recordings
    drop(page, f"corner-{recording} (1).h5", b"")
    expect(page.locator("[data-field=state]")).to_have_text("Replay")
    watch.refusals_expected = True
    drop(page, "other.h5", b"no HDF5")
    expect(page.locator(".toast", has_text="It is no whole recording")).to_be_visible()
    choose_from(row, "More of corner", "Delete…")
    confirm = page.get_by_role("dialog", name="Delete this recording?")
    confirm.get_by_role("button", name="Keep").click()
    assert httpx.get(url).status_code == 200
    choose_from(row, "More of corner", "Delete…")
    confirm.get_by_role("button", name="Delete").click()
    expect(row).to_have_count(0)
    assert httpx.get(url).status_code == 404
    # as one of elsewhere it is sent, kept under its id, and shown
    drop(page, "theirs.h5", Path(download.value.path()).read_bytes())
    expect(row).to_have_count(1)
    shows_recorded(page, 2)
    wanted = recorded(served, recording, 2, "range")
    page.wait_for_function(
        "([at, value]) => Math.abs(transientcam.store.frames.of('range').peek().values[at] - value)"
        " < 1e-6",
        arg=[163 * 60 + 80, float(wanted[60, 80])],
    )


def test_all_views_show_the_frame_that_is_scrubbed_to(page: Page, served: Served) -> None:
    recording = record(served, frames=6)
    open_page(page)
    choose(page, "sequence", "Recordings")
    # the pictures beside it have their size then
    page.get_by_role("button", name="Play corner").wait_for()
    point_at(page, "map", 40, 50, click=True)
    page.get_by_role("button", name="Play corner").click()
    expect(page.locator("[data-field=state]")).to_have_text("Replay")
    shows_recorded(page, 6)
    expect(page.get_by_role("button", name="Play the recording")).to_be_visible()
    slider = page.get_by_label("Frame of the recording")
    slider.focus()
    page.keyboard.press("Home")
    shows_recorded(page, 1)
    for frame in (2, 3, 4):
        page.keyboard.press("ArrowRight")
        shows_recorded(page, frame)
        canvas = map_canvas(page)
        low, high = (float(str(canvas.get_attribute(f"data-{end}"))) for end in ("low", "high"))
        expected = map_colours(recorded(served, recording, frame, "range"), low, high, "viridis")
        np.testing.assert_allclose(map_pixels(page).astype(int), expected, atol=6)
    expect(page.locator("[data-field=replay-frame]")).to_have_text("4")
    expect(page.locator("[data-field=subject]")).to_contain_text("recording ")
    # what the views show of light and of the pixel is of this frame, too
    coefficients = page.evaluate(
        "() => [...transientcam.store.frames.of('coefficients').peek().values.slice(0, 500)]"
    )
    np.testing.assert_allclose(
        coefficients, recorded(served, recording, 4, "coefficients").ravel()[:500]
    )
    url = f"{served.url}/api/v1/recordings/{recording}/frames/4/pixel"
    reported = httpx.get(url, params={"x": 40, "y": 50, "bins": 1}).json()
    page.wait_for_function(
        "([range, brightness]) => { const document = transientcam.store.details.document.peek();"
        " return document?.range_m === range && document.brightness === brightness; }",
        arg=[reported["range_m"], reported["brightness"]],
    )
    page.get_by_role("button", name="Back to live").click()
    expect(page.locator(".replay")).to_have_count(0)
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    expect(page.locator("[data-field=subject]")).to_contain_text("simulated ")
    newest = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    page.wait_for_function(
        "(newest) => document.querySelector('.panel-map .stage canvas').dataset.frame > newest",
        arg=newest,
    )


def test_a_recording_plays_by_itself_to_its_end(page: Page, served: Served) -> None:
    record(served, frames=6)
    show(page)
    page.get_by_role("button", name="Play corner").click()
    shows_recorded(page, 6)
    expect(page.get_by_role("button", name="Play the recording")).to_be_visible()
    page.keyboard.press("[")
    shows_recorded(page, 5)
    page.get_by_role("button", name="One frame on").click()
    shows_recorded(page, 6)


def test_a_recorded_frame_is_computed_with_the_present_settings(page: Page, served: Served) -> None:
    recording = record(served, frames=2)
    show(page)
    page.get_by_role("button", name="Play corner").click()
    shows_recorded(page, 2)
    expect(page.get_by_role("button", name="Play the recording")).to_be_visible()
    page.get_by_label("Frame of the recording").focus()
    page.keyboard.press("Home")
    shows_recorded(page, 1)
    page.get_by_label("Computed with").select_option(label="present settings")
    httpx.put(
        f"{served.url}/api/v1/reconstruction", json={"estimator": "single-frequency"}
    ).raise_for_status()
    url = f"{served.url}/api/v1/recordings/{recording}/frames/1/range.npy"
    answer = httpx.get(url, params={"reconstruction": "current"}).raise_for_status()
    wanted = np.load(io.BytesIO(answer.content))
    assert not np.array_equal(wanted, recorded(served, recording, 1, "range"), equal_nan=True)
    page.wait_for_function(
        "([at, value]) => Math.abs(transientcam.store.frames.of('range').peek().values[at] - value)"
        " < 1e-6",
        arg=[163 * 60 + 80, float(wanted[60, 80])],
    )


def test_an_address_shows_a_recorded_frame(page: Page, served: Served, watch: Watch) -> None:
    recording = record(served, frames=4)
    page.goto(f"/?debug#map=direct&recording={recording}&frame=3")
    shows_recorded(page, 3)
    page.get_by_role("button", name="One frame on").click()
    expect(page).to_have_url(
        re.compile(rf"#map=direct&pixel=\d+,\d+&time_ns=[\d.]+&recording={recording}&frame=4$")
    )
    page.get_by_role("button", name="Back to live").click()
    expect(page).to_have_url(re.compile(r"#map=direct&pixel=\d+,\d+&time_ns=[\d.]+$"))
    watch.refusals_expected = True
    page.evaluate("() => { location.hash = '#recording=gone'; }")
    expect(page.locator("[data-banner=message]")).to_contain_text("cannot be shown")


def test_a_recording_is_watched_while_it_grows(page: Page, served: Served) -> None:
    show(page)
    page.get_by_role("button", name="Record", exact=True).click()
    page.locator("[data-field=recording-frames]").get_by_text(re.compile(r"^[1-9]")).wait_for()
    page.get_by_role("button", name="Watch from its start").click()
    shows_recorded(page, 1)
    count = page.evaluate("() => transientcam.store.replay.timeline.peek().count")
    page.wait_for_function(
        "(count) => transientcam.store.replay.timeline.peek().count > count", arg=count
    )
    page.get_by_role("button", name="Stop recording").click()
    expect(page.locator(f"{PANEL} [data-recording]")).to_have_count(1)
    shows_recorded(page, 1)
