import csv
import io
import re
from pathlib import Path
from xml.etree import ElementTree

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

import transientcam_moments as tm
from tests.browser.conftest import Watch
from tests.browser.dashboard import choose, open_page, point_at, shows_frame, text
from tests.browser.test_transient import stop
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon

F_HZ = 23e6
PIXEL = (81, 20)
WORDS = {"biased": "Biased in", "saturated": "Saturated in", "no_signal": "No signal in"}
# returns with a smaller share of the light are listed together
WEAK_SHARE = 0.02


def pixel_of(served: Served) -> dict[str, object]:
    answer = httpx.get(
        f"{served.url}/api/v1/frames/latest/pixel", params={"x": 81, "y": 20, "bins": 1}
    ).raise_for_status()
    document: dict[str, object] = answer.json()
    return document


def select(page: Page, served: Served) -> None:
    """A pixel of a frame that stays."""
    open_page(page)
    shows_frame(page, stop(served))
    point_at(page, "map", *PIXEL, click=True)
    expect(page.locator(".panel-response h2")).to_contain_text("of pixel 81, 20")
    page.locator(".returns [data-true=true]").first.wait_for()


def curves(page: Page, aspect: str) -> dict[str, NDArray[np.float64]]:
    """The curves of the selected pixel, as the page hands them out."""
    with page.expect_download() as download:
        choose(page, "response", f"{aspect} (CSV)")
    rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def moments_of(served: Served, pixel: tuple[int, int] = PIXEL) -> NDArray[np.complex64]:
    answer = httpx.get(f"{served.url}/api/v1/frames/latest/moments.npy").raise_for_status()
    moments: NDArray[np.complex64] = np.load(io.BytesIO(answer.content))
    return moments[:, pixel[1], pixel[0], np.newaxis]


def test_the_curves_are_those_of_the_moments_package(page: Page, served: Served) -> None:
    select(page, served)
    bounds_are_drawn(page, served)
    cumulative_light_is_drawn(page, served)
    # and every aspect is drawn on the screen
    for aspect in ("Bounds", "Cumulative"):
        page.get_by_role("tab", name=aspect).click()
        page.locator(f".response-plot[data-aspect={aspect.lower()}] canvas").wait_for()
        ink = page.locator(".response-plot canvas").evaluate(
            """(canvas) => new Promise((done) => requestAnimationFrame(() => done(
                 new Set(new Uint32Array(canvas.getContext('2d')
                   .getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size)))"""
        )
        assert ink > 30, "an empty plot has but its axes' few colours"
    # the moments stand on their plane where they are
    page.get_by_role("tab", name="Moments").click()
    moments = moments_of(served)[:, 0]
    for j in range(1, len(moments)):
        point = page.locator(f"[data-moment='{j}'] circle")
        expected = moments[j] / moments[0].real
        assert float(str(point.get_attribute("cx"))) == pytest.approx(expected.real, abs=1e-3)
        assert -float(str(point.get_attribute("cy"))) == pytest.approx(expected.imag, abs=1e-3)


def test_pinned_pixels_are_drawn_beside_the_selected_one(page: Page, served: Served) -> None:
    select(page, served)
    page.get_by_role("tab", name="Cumulative").click()
    page.locator(".response-plot[data-aspect=cumulative] canvas").wait_for()
    pins = {"A": (30, 40), "B": (135, 60)}
    colours = {"A": (0xE6, 0x9F, 0x00), "B": (0x56, 0xB4, 0xE9)}
    assert not any(drawn_in(page, colour) for colour in colours.values())
    for x, y in pins.values():
        page.keyboard.down("Shift")
        point_at(page, "map", x, y, click=True)
        page.keyboard.up("Shift")
    expect(page.locator(".key .key-pin")).to_have_text(["A", "B"])
    drawn = curves(page, "Cumulative")
    phase_rad = 2 * np.pi * F_HZ * drawn["time_ns"] * 1e-9
    for name, pixel in pins.items():
        moments = moments_of(served, pixel)
        expected = np.asarray(tm.cumulative(tm.levinson(moments), phase_rad))[:, 0]
        shown = drawn[f"pin_{name.lower()}_cumulative_dn"]
        np.testing.assert_allclose(shown, expected, atol=2e-3 * float(moments[0, 0].real))
        assert drawn_in(page, colours[name])


def drawn_in(page: Page, colour: tuple[int, int, int]) -> bool:
    """Whether the plot has ink of a colour, once it is drawn."""
    found: bool = page.locator(".response-plot canvas").evaluate(
        """(canvas, [red, green, blue]) => new Promise((done) => requestAnimationFrame(() => {
             const { data } = canvas.getContext('2d')
               .getImageData(0, 0, canvas.width, canvas.height);
             const like = (at) => data[at] === red && data[at + 1] === green
               && data[at + 2] === blue && data[at + 3] === 255;
             let count = 0;
             for (let at = 0; at < data.length; at += 4) count += like(at);
             done(count > 0); }))""",
        list(colour),
    )
    return found


def bounds_are_drawn(page: Page, served: Served) -> None:
    """Sharp bounds, the smoothed estimate between them, and the truth."""
    drawn = curves(page, "Bounds")
    phase_rad = 2 * np.pi * F_HZ * drawn["time_ns"] * 1e-9
    per_ns = 2 * np.pi * F_HZ * 1e-9
    lower, upper = tm.bounds(moments_of(served), phase_rad)
    scale = float(np.max(upper)) * per_ns
    for name, expected in (("lower", lower), ("upper", upper)):
        difference = drawn[f"{name}_dn_per_ns"] - per_ns * np.asarray(expected)[:, 0]
        assert np.max(np.abs(difference)) < 2e-3 * scale
    smoothed = tm.smoothed_density(tm.levinson(moments_of(served)), phase_rad)
    difference = drawn["smoothed_dn_per_ns"] - per_ns * np.asarray(smoothed)[:, 0]
    assert np.max(np.abs(difference)) < 2e-3 * scale
    assert drawn["truth_smoothed_dn_per_ns"].max() > 0


def cumulative_light_is_drawn(page: Page, served: Served) -> None:
    """The light up to each time, beside the truth."""
    drawn = curves(page, "Cumulative")
    phase_rad = 2 * np.pi * F_HZ * drawn["time_ns"] * 1e-9
    moments = moments_of(served)
    expected = np.asarray(tm.cumulative(tm.levinson(moments), phase_rad))[:, 0]
    brightness = float(moments[0, 0].real)
    np.testing.assert_allclose(drawn["cumulative_dn"], expected, atol=2e-3 * brightness)
    # the truth beside it ends where all of its light has come
    truth = pixel_of(served)["truth"]
    assert isinstance(truth, dict)
    np.testing.assert_allclose(drawn["truth_cumulative_dn"][-1], truth["brightness"], rtol=1e-6)


def strong(returns: object) -> list[dict[str, float]]:
    """Those worth a line, by time."""
    assert isinstance(returns, list)
    least = WEAK_SHARE * sum(each["weight"] for each in returns)
    return sorted(
        (each for each in returns if each["weight"] >= least), key=lambda each: each["time_s"]
    )


def test_a_figure_has_the_stems_where_the_returns_are(page: Page, served: Served) -> None:
    select(page, served)
    with page.expect_download() as download:
        choose(page, "response", "Figure (SVG)")
    figure = ElementTree.fromstring(Path(download.value.path()).read_text())
    words = [each for each in figure.iterfind(".//{*}text[@text-anchor='middle']") if each.text]
    below = max(float(each.attrib["y"]) for each in words)
    marks = {
        float(str(each.text).split()[0]): float(each.attrib["x"])
        for each in words
        if float(each.attrib["y"]) == below
    }
    per_px, at_0_ns = np.polyfit([*marks.values()], [*marks], 1)
    drawn = [each.attrib["d"] for each in figure.iterfind(".//{*}g[@fill='none']/{*}path")]
    ends = [re.fullmatch(r"M(\S+) \S+L(\S+) \S+", each) for each in drawn]
    stems_ns = [
        per_px * float(each[1]) + at_0_ns
        for each in ends
        if each is not None and each[1] == each[2]
    ]

    reported = pixel_of(served)
    truth = reported["truth"]
    assert isinstance(truth, dict)
    for returns in (reported["returns"], truth["returns"]):
        for each in strong(returns):
            assert min(abs(1e9 * each["time_s"] - at_ns) for at_ns in stems_ns) < 2 * per_px
    assert len(stems_ns) >= len(strong(reported["returns"])) + len(strong(truth["returns"]))


def test_returns_truth_and_flags_are_listed(page: Page, served: Served) -> None:
    select(page, served)
    reported = pixel_of(served)
    truth = reported["truth"]
    assert isinstance(truth, dict)
    returns, true = (strong(each) for each in (reported["returns"], truth["returns"]))
    rows = page.locator(".returns tbody tr")
    shown = rows.evaluate_all(
        "(rows) => rows.map((row) => [...row.cells].map((each) => parseFloat("
        "(each.firstChild?.textContent ?? '').replace(/\\u202f(?=\\d)/g, ''))))"
    )
    found = [row for row in shown if not np.isnan(row[0])]
    assert len(shown) == 4, "as many lines, however many returns there are"
    for (time_ns, range_m, weight, *_), each in zip(found, returns, strict=True):
        assert time_ns == pytest.approx(1e9 * each["time_s"], abs=0.006)
        assert range_m == pytest.approx(299_792_458 * each["time_s"] / 2, abs=0.006)
        assert weight == pytest.approx(each["weight"], abs=0.6)
    for row, each in zip([row for row in shown if not np.isnan(row[3])], true, strict=True):
        assert row[3] == pytest.approx(299_792_458 * each["time_s"] / 2, abs=0.006)
    flags = text(page, ".panel-response", "flags")
    assert isinstance(reported["flags"], list)
    expected = [WORDS[flag] for flag in reported["flags"]] or ["Nothing was wrong"]
    assert all(words in flags for words in expected)


def hold(page: Page, served: Served) -> str:
    """Hold a frame until there is another, and return its number."""
    open_page(page)
    page.keyboard.press("h")
    expect(page.locator("[data-field=state]")).to_have_text("Held")
    held = str(page.locator("canvas[data-product=transient]").get_attribute("data-frame"))
    newer = f"{served.url}/api/v1/frames/latest?after={held}&wait_s=10"
    httpx.get(newer).raise_for_status()
    return held


def test_values_beside_a_held_frame_are_of_that_frame(page: Page, served: Served) -> None:
    held = hold(page, served)
    with page.expect_response(lambda answer: f"/frames/{held}/pixel?" in answer.url):
        point_at(page, "map", *PIXEL, click=True)
    expect(page.locator(".response-side [data-field=returns]")).to_be_visible()
    expect(page.locator(".response-side")).not_to_contain_text("the curves are of frame")


def test_of_a_held_frame_that_is_not_kept_any_more_it_is_said(
    page: Page, served: Served, watch: Watch
) -> None:
    watch.refusals_expected = True
    held = hold(page, served)
    gone = {"type": "/problems/frame-gone", "title": "Gone", "status": 410}
    page.route(f"**/frames/{held}/pixel?*", lambda route: route.fulfill(status=410, json=gone))
    point_at(page, "map", *PIXEL, click=True)
    expect(page.locator(".response-side")).to_contain_text(f"the curves are of frame {held}")


def test_only_the_time_with_light_is_plotted_where_that_is_wanted_and_a_link_says_so(
    page: Page, served: Served, browser: Browser
) -> None:
    select(page, served)
    light = page.evaluate(
        "() => [...transientcam.store.frames.of('coefficients').peek().light.arrivals]"
    )
    bright = np.flatnonzero(np.array(light) > 0.05 * max(light)) / len(light)
    turn = float(bright.mean())
    page.evaluate("(turn) => transientcam.store.player.seek(turn)", turn)
    head = page.locator(".response-head")
    place = "(each) => parseFloat(each.style.left)"
    assert head.evaluate(place) == pytest.approx(100 * turn, abs=0.01)
    button = page.locator(".panel-response").get_by_role("button", name="lit")
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")
    # two hundredths of the period stay dark at either end
    first = max(0.0, bright[0] - 0.02)
    last = min(1.0, bright[-1] + 1 / len(light) + 0.02)
    assert last - first < 0.9
    assert head.evaluate(place) == pytest.approx(100 * (turn - first) / (last - first), abs=0.01)
    link = page.evaluate("() => transientcam.store.settings.hash(true)")
    context = browser.new_context(reduced_motion="reduce", base_url=served.url)
    other = context.new_page()
    other.goto(f"/?debug{link}")
    opened = other.locator(".panel-response").get_by_role("button", name="lit")
    expect(opened).to_have_attribute("aria-pressed", "true")
    context.close()
