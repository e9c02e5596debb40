import re
from urllib.parse import urlsplit

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import MIRRORS, SlowClock, Watch, put
from tests.browser.dashboard import LIVE, open_page, text
from tests.serving import Served, serving

pytestmark = pytest.mark.shared_daemon


def fault(served: Served, name: str) -> None:
    url = f"{served.url}/api/v1/simulation/faults"
    httpx.post(url, json={"fault": name}).raise_for_status()


def frame_period_s(served: Served) -> float:
    """The time between two frames that follow each other, by the clock of the device."""
    address = f"{served.url}/api/v1/frames/latest"
    first = httpx.get(address).raise_for_status().json()
    last = httpx.get(address, params={"after": first["frame"] + 4, "wait_s": 10}).json()
    span_s = float(last["device_time_s"] - first["device_time_s"])
    return span_s / int(last["frame"] - first["frame"])


def test_a_live_camera_says_so_with_its_figures(page: Page, served: Served) -> None:
    open_page(page)
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    rate = page.locator("[data-field=rate]")
    expect(rate).to_have_text(re.compile(r"^\d+\.\d\s?Hz$"))
    sequence = httpx.get(f"{served.url}/api/v1/sequence").json()
    assert text(page, ".panel-sequence", "harmonics") == str(sequence["harmonics"])
    assert text(page, ".panel-sequence", "images") == str(sequence["images"])
    assert text(page, ".panel-sequence", "base_frequency_hz") == "23.00 MHz"
    assert text(page, ".panel-sequence", "unambiguous_range_m") == "6.52 m"
    # what a client measures: the time from one frame to the next
    assert text(page, ".panel-sequence", "capture_s") == f"{1e3 * sequence['capture_s']:.1f} ms"
    assert sequence["capture_s"] * sequence["frame_rate_hz"] == pytest.approx(1, rel=1e-3)
    while (period_s := frame_period_s(served)) > 1.02 * sequence["capture_s"]:
        pass  # a laden machine leaves out images now and then
    assert period_s > 0.98 * sequence["capture_s"]
    # a page that shows few of the frames there are is not well
    page.evaluate(
        "() => { const { sequence } = transientcam.store;"
        " sequence.value = { ...sequence.peek(), frame_rate_hz: 1e4 }; }"
    )
    state = page.locator("[data-field=state]")
    expect(state).to_have_text("Live, slow")
    expect(state).to_have_attribute("title", re.compile("of 10000.0 frames a second are shown"))


def test_a_lost_camera_and_a_lost_image_are_said_at_once(page: Page, served: Served) -> None:
    open_page(page)
    banner = page.locator("[data-banner=camera]")
    expect(banner).to_have_count(0)
    fault(served, "unplug")
    expect(banner).to_be_visible()
    expect(banner).to_have_attribute("role", "alert")
    toast = page.locator(".toast", has_text="was lost")
    expect(toast).to_be_visible()
    assert str(toast.text_content()).count("lost") == 1
    expect(page.locator("[data-field=state]")).to_have_text("Camera lost")
    last = int(text(page, ".bar", "frame").replace(" ", ""))
    fault(served, "replug")
    expect(banner).to_have_count(0)
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    page.wait_for_function(
        "(last) => document.querySelector('.panel-map .stage canvas').dataset.frame > last",
        arg=last,
    )
    # images that do not arrive intact are counted
    before = page.evaluate("() => transientcam.store.status.lostImages.peek()")
    fault(served, "corrupt-image")
    page.wait_for_function(
        "(before) => transientcam.store.status.lostImages.peek() > before", arg=before
    )
    expect(page.locator("[data-field=lost]")).not_to_have_text("0")
    expect(page.locator(".toast", has_text="did not arrive intact")).to_be_visible()


def test_a_page_opened_while_the_camera_is_away_says_so(page: Page, served: Served) -> None:
    httpx.get(f"{served.url}/api/v1/frames/latest", params={"wait_s": 10}).raise_for_status()
    fault(served, "unplug")
    page.goto("/")
    expect(page.locator("[data-banner=camera]")).to_be_visible()
    fault(served, "replug")
    expect(page.locator("[data-banner=camera]")).to_have_count(0)


def test_the_camera_stops_and_starts_again(page: Page, served: Served) -> None:
    open_page(page)
    page.get_by_role("button", name="Stop").click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    assert httpx.get(f"{served.url}/api/v1/acquisition").json()["running"] is False
    page.get_by_role("button", name="Start").click()
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    # and is followed where another client stops and starts it
    acquisition = f"{served.url}/api/v1/acquisition"
    for running, state in ((False, "Stopped"), (True, LIVE)):
        httpx.put(acquisition, json={"running": running}).raise_for_status()
        expect(page.locator("[data-field=state]")).to_have_text(state)


def test_a_held_page_keeps_its_frame_while_the_camera_goes_on(page: Page, served: Served) -> None:
    open_page(page)
    page.keyboard.press("h")
    expect(page.locator("[data-field=state]")).to_have_text("Held")
    canvas = page.locator(".panel-map .stage canvas[data-product]")
    held = int(str(canvas.get_attribute("data-frame")))
    after = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    httpx.get(f"{served.url}/api/v1/frames/latest", params={"after": after + 2, "wait_s": 10})
    assert int(str(canvas.get_attribute("data-frame"))) == held
    page.keyboard.press("h")
    page.wait_for_function(
        "(held) => document.querySelector('.panel-map .stage canvas').dataset.frame > held + 2",
        arg=held,
    )


def test_the_sequence_is_judged_as_it_is_typed_and_set(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    watch.refusals_expected = True
    page.get_by_role("button", name="Edit").click()
    harmonics = page.get_by_label("Harmonics m")
    harmonics.fill("99")
    expect(page.locator(".refusal")).to_have_text("Harmonics m must be an integer from 1 to 32.")
    expect(harmonics).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_role("button", name="Apply")).to_be_disabled()
    harmonics.fill("")
    expect(page.locator(".refusal")).to_have_text("Harmonics m needs a number.")
    harmonics.fill("4")
    page.get_by_role("textbox", name="Exposure").fill("0.5")
    expect(page.locator(".verdict [data-field=images]")).to_have_text("20")
    page.get_by_role("button", name="Apply").click()
    expect(page.locator(".panel-sequence [data-field=exposure_s]")).to_have_text("500\u202fµs")
    applied = httpx.get(f"{served.url}/api/v1/sequence").json()
    assert (applied["harmonics"], applied["exposure_s"]) == (4, 0.0005)
    page.wait_for_function(
        "() => transientcam.store.frames.of('coefficients').value?.coefficients?.harmonics === 4"
    )


def test_one_click_shortens_the_exposure_until_hardly_a_pixel_is_saturated(
    page: Page, served: Served
) -> None:
    open_page(page)
    put(served, "sequence", {"harmonics": 4, "zeroth": "estimated", "exposure_s": 8e-3})
    page.locator("[data-field=exposure] button").click()
    page.wait_for_function(
        """() => {
          const { pixels, exposure_s } = transientcam.store.status.newest.peek();
          return exposure_s < 0.003 && pixels !== null && pixels.saturated <= 0.01 * pixels.total;
        }"""
    )
    expect(page.locator("[data-field=exposure]")).to_have_count(0)


def test_a_sequence_that_another_client_sets_is_shown(page: Page, served: Served) -> None:
    open_page(page)
    document = httpx.get(f"{served.url}/api/v1/sequence").json() | {"base_frequency_hz": 46e6}
    for derived in (
        "sequence_id",
        "images",
        "capture_s",
        "frame_rate_hz",
        "unambiguous_range_m",
        "data_rate_bytes_s",
    ):
        document.pop(derived)
    httpx.put(f"{served.url}/api/v1/sequence", json=document).raise_for_status()
    expect(page.locator("[data-field=base_frequency_hz]")).to_have_text("46.00\u202fMHz")
    expect(page.locator(".timeline-ticks span").last).to_have_text("20\u202fns")


def test_a_page_outlives_its_daemon(browser: Browser) -> None:
    with serving(MIRRORS, clock=SlowClock()) as first:
        context = browser.new_context(base_url=first.url, reduced_motion="reduce")
        page = context.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        open_page(page)
    banner = page.locator("[data-banner=connection]")
    expect(banner).to_contain_text("No connection to the service.")
    expect(page.locator("[data-field=state]")).to_have_text(re.compile("Reconnecting|Connecting"))
    with serving(MIRRORS, clock=SlowClock(), port=urlsplit(first.url).port):
        expect(banner).to_have_count(0)
        expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    context.close()
    assert errors == []
