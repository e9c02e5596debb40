import io
import re
from itertools import pairwise
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence
from playwright.sync_api import Locator, Page, expect

import transientcam_moments as tm
from tests.browser.conftest import Watch
from tests.browser.dashboard import (
    canvas_pixels,
    choose,
    colours,
    density_of,
    map_canvas,
    open_page,
    point_at,
    shown_density,
    shows_frame,
    text,
    transient_canvas,
    transient_pixels,
)
from tests.serving import Served
from transientcam.wire._codec import pack_with_array

pytestmark = pytest.mark.shared_daemon

F_HZ = 23e6
LEAST_VALIDITY = 4e-3
PHASES_RAD = (0.0, 0.7, 1.9, 3.3, 4.4, 6.1)
# Chromium's software renderer under another name: what emulates WebGL, the page does not draw with.
WITH_GRAPHICS = """
const getParameter = WebGL2RenderingContext.prototype.getParameter;
const UNMASKED_RENDERER = 0x9246;
WebGL2RenderingContext.prototype.getParameter = function (name) {
  return name === UNMASKED_RENDERER ? "a graphics processor" : getParameter.call(this, name);
};
"""
WITHOUT_WEBGL = """
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : getContext.call(this, kind, ...rest);
};
"""


def stop(served: Served) -> int:
    """Stop the camera; the number of its last frame."""
    httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False}).raise_for_status()
    number: int = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    return number


def look(page: Page) -> Locator:
    """Open the popover of how the light looks."""
    panel = page.locator(".panel-transient")
    panel.get_by_role("button", name="Look of the light").click()
    return panel.get_by_role("dialog", name="Look of the light")


def toeplitz(moments: NDArray[Any]) -> NDArray[np.complex128]:
    """B[j, k] = b_(j-k) of every pixel, (N, m+1, m+1)."""
    m = moments.shape[0] - 1
    both = np.concatenate((moments[:0:-1].conj(), moments)).astype(np.complex128)
    matrices: NDArray[np.complex128] = np.stack(
        [np.stack([both[m + j - k] for k in range(m + 1)], axis=-1) for j in range(m + 1)], axis=-2
    )
    return matrices


def moments_of_returns(m: int, *, pixels: int, seed: int) -> NDArray[np.complex128]:
    """One to three returns a pixel, over as little even light as `LEAST_VALIDITY` allows."""
    random = np.random.default_rng(seed)
    phases = random.uniform(0, 2 * np.pi, (3, pixels))
    weights = random.uniform(50, 1000, (3, pixels)) * (
        np.arange(3)[:, None] <= np.arange(pixels) % 3
    )
    moments = np.stack([(weights * np.exp(1j * j * phases)).sum(axis=0) for j in range(m + 1)])
    least = np.linalg.eigvalsh(toeplitz(moments))[:, 0]
    # b_0 raised until the smallest eigenvalue is 1 to 10 times the share that must be met
    share = LEAST_VALIDITY * 10 ** random.uniform(0.001, 1, pixels)
    moments[0] += (share * moments[0].real - least) / (1 - share)
    return moments


def dense_coefficients(moments: NDArray[np.complex128]) -> NDArray[np.float32]:
    """[E, Re a_1, Im a_1, ...] with a / E the first column of the inverse (Theorem 1)."""
    column = np.linalg.solve(toeplitz(moments), np.eye(moments.shape[0])[:, :1])[..., 0].T
    energy = 1 / column[0].real
    a = column[1:] * energy
    planes = np.stack([energy, *(part for each in a for part in (each.real, each.imag))])
    return planes.astype(np.float32)


def dense_density(moments: NDArray[np.complex128], phase_rad: float) -> NDArray[np.float64]:
    """Density per second by the dense solve in double precision."""
    column = np.linalg.solve(toeplitz(moments), np.eye(moments.shape[0])[:, :1])[..., 0].T
    powers = np.exp(1j * phase_rad * np.arange(moments.shape[0]))[:, None]
    density: NDArray[np.float64] = (
        F_HZ * column[0].real / np.abs((column.conj() * powers).sum(0)) ** 2
    )
    return density


def frame_message(planes: NDArray[np.float32]) -> bytes:
    return pack_with_array(
        {
            "v": 1,
            "type": "frame",
            "product": "coefficients",
            "unit": "DN,1",
            "axes": ["coefficient", "y", "x"],
            "meta": {"frame": 1, "base_frequency_hz": F_HZ},
            "encode_s": 0.0,
        },
        planes,
    )


def test_the_shader_computes_equation_2(page: Page) -> None:
    page.add_init_script(WITH_GRAPHICS)
    open_page(page)
    for m in (3, 4, 8):
        the_dense_solution_is_computed(page, m)
        the_density_of_the_moments_package_is_computed(page, m)


def the_dense_solution_is_computed(page: Page, m: int) -> None:
    """Hard pixels, at even phases and where their densities are sharp."""
    shape = (30, 41)
    moments = moments_of_returns(m, pixels=30 * 41, seed=m)
    validity = np.linalg.eigvalsh(toeplitz(moments))[:, 0] / moments[0].real
    assert validity.min() >= LEAST_VALIDITY
    assert np.median(validity) < 5 * LEAST_VALIDITY, "most pixels should be hard ones"
    body = frame_message(dense_coefficients(moments).reshape(-1, *shape))

    tops = np.angle(moments[1])[:: 30 * 41 // 7] % (2 * np.pi)  # where densities are sharp
    for phase_rad in (*PHASES_RAD, *tops):
        renderer, density = density_of(page, body, float(phase_rad))
        assert renderer == "webgl2"
        np.testing.assert_allclose(density, dense_density(moments, float(phase_rad)), rtol=1e-3)


def the_density_of_the_moments_package_is_computed(page: Page, m: int) -> None:
    """Other pixels, of coefficients in single precision."""
    moments = moments_of_returns(m, pixels=30 * 41, seed=100 + m).reshape(m + 1, 30, 41)
    coefficients = tm.levinson(moments.astype(np.complex64))
    planes = [coefficients.error]
    for a in coefficients.polynomial[1:]:
        planes += [a.real, a.imag]
    body = frame_message(np.stack(planes).astype(np.float32))
    for phase_rad in PHASES_RAD:
        _, density = density_of(page, body, phase_rad)
        expected = 2 * np.pi * F_HZ * np.asarray(tm.density(coefficients, phase_rad))
        np.testing.assert_allclose(density, expected.reshape(-1), rtol=1e-3)


def test_both_renderers_draw_the_transient_that_the_daemon_computes(
    page: Page, served: Served
) -> None:
    page.add_init_script(WITH_GRAPHICS)
    open_page(page)
    number = stop(served)
    shows_frame(page, number)
    turns = (0.25, 0.28, 0.45)
    draws_what_the_daemon_computes(page, served, "webgl2")
    shaded = [transient_pixels(page, turn) for turn in turns]
    page.add_init_script(WITHOUT_WEBGL)
    open_page(page)
    shows_frame(page, number)
    draws_what_the_daemon_computes(page, served, "typed-array")
    computed = [transient_pixels(page, turn) for turn in turns]
    for ours, theirs in zip(shaded, computed, strict=True):
        difference = np.abs(ours.astype(int) - theirs.astype(int))
        assert np.mean(difference > 8) < 0.002, "one colour of the map here and there, no more"
        assert ours[..., :3].std() > 5


def test_emulated_graphics_are_left_alone(page: Page) -> None:
    open_page(page)
    assert page.evaluate("() => document.createElement('canvas').getContext('webgl2') !== null"), (
        "Chromium's software renderer grants WebGL2"
    )
    expect(transient_canvas(page)).to_have_attribute("data-renderer", "typed-array")


def draws_what_the_daemon_computes(page: Page, served: Served, expected_renderer: str) -> None:
    """The numbers behind the picture, at several times."""
    expect(transient_canvas(page)).to_have_attribute("data-renderer", expected_renderer)
    for phase_rad in PHASES_RAD:
        time_s = phase_rad / (2 * np.pi * F_HZ)
        answer = httpx.get(
            f"{served.url}/api/v1/frames/latest/transient.npy", params={"time_s": time_s}
        ).raise_for_status()
        expected = np.load(io.BytesIO(answer.content)).reshape(-1)
        renderer, density = shown_density(page, phase_rad)
        assert renderer == expected_renderer
        valid = np.isfinite(expected)
        assert valid.mean() > 0.9
        np.testing.assert_allclose(density[valid], expected[valid], rtol=2e-3)


def test_light_passes_the_pixels_when_their_range_says(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    ranges = np.load(io.BytesIO(httpx.get(f"{served.url}/api/v1/frames/latest/range.npy").content))
    look(page).get_by_label("Scene behind the light").uncheck()  # the light alone
    page.keyboard.press("Escape")
    steps_m = np.arange(1.4, 2.2, 0.04)
    pictures = np.stack(
        [
            transient_pixels(page, 2 * range_m * F_HZ / 299_792_458)[..., :3].sum(-1, dtype=int)
            for range_m in steps_m
        ]
    )
    inside = (ranges > steps_m[0]) & (ranges < steps_m[-1])
    brightest_m = steps_m[pictures.argmax(axis=0)]
    assert inside.mean() > 0.5
    assert np.median(np.abs(brightest_m - ranges)[inside]) < 0.04
    assert pictures.max() > 500


def test_light_is_scrubbed_without_a_request_and_plays(page: Page, watch: Watch) -> None:
    open_page(page)
    slider = page.get_by_label("Time of flight")
    slider.focus()
    page.keyboard.press("Home")
    seen = {transient_canvas(page).screenshot()}
    box = slider.bounding_box()
    assert box is not None
    before = len(watch.requests)
    for share in (0.255, 0.27, 0.285):
        page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
        seen.add(transient_canvas(page).screenshot())
    for _ in range(3):
        page.keyboard.press("Shift+ArrowRight")
        seen.add(transient_canvas(page).screenshot())
    assert len(seen) == 7
    # it is held until the pointer is let go, wherever
    scrubbed = "() => transientcam.store.player.scrubbed.peek()"
    page.mouse.down()
    assert page.evaluate(scrubbed)
    page.mouse.move(box["x"], box["y"] - 200)
    page.mouse.up()
    assert not page.evaluate(scrubbed)
    # the pixel that is looked at goes on with the live frames
    # what the range is worth is requested of some frames
    passing = ("/pixel?", "/range_", "/trust.")
    assert [each for each in watch.requests[before:] if not any(it in each for it in passing)] == []
    # it plays, pauses and shows its time
    time = page.locator(".panel-transient [data-field=time]")
    page.keyboard.press("Home")
    expect(time).to_have_text("0.00\u202fns")
    page.keyboard.press("ArrowRight")
    expect(time).to_have_text("0.10\u202fns")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    expect(time).not_to_have_text("0.10\u202fns")
    page.get_by_role("button", name="Pause").click()
    standing = time.text_content()
    page.evaluate(
        "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    )
    expect(time).to_have_text(str(standing))


def test_it_plays_by_itself_unless_motion_is_unwelcome(page: Page) -> None:
    open_page(page)
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.emulate_media(reduced_motion="no-preference")
    open_page(page)
    expect(page.get_by_role("button", name="Pause")).to_be_visible()


def test_light_is_seen_in_nearly_all_of_a_pass(page: Page) -> None:
    open_page(page)
    shares = page.evaluate(_SHARES_OF_A_PASS)
    assert len(shares) > 20
    assert np.mean(np.array(shares) >= 0.01) >= 0.95


_SHARES_OF_A_PASS = """
() => {
  const { player, light, held } = transientcam.store;
  [held.value, player.playing.value, player.speed_ns.value] = [true, true, 5];
  player.turn.value = player.lit.peek().first;
  const copy = document.createElement("canvas");
  const shares = [];
  for (let before = -1; shares.length < 1000; ) {
    player.advance(1 / 60);
    if (player.turn.peek() < before) break;
    before = player.turn.peek();
    const picture = light.snapshot();
    [copy.width, copy.height] = [picture.width, picture.height];
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    let lit = 0;
    for (let at = 0; at < data.length; at += 4) {
      const colours = data.slice(at, at + 3);
      lit += Math.max(...colours) - Math.min(...colours) > 40;
    }
    shares.push((4 * lit) / data.length);
  }
  player.playing.value = false;
  return shares;
}
"""


def test_a_click_shows_the_pixels_impulse_response(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    point_at(page, "transient", 81, 20, click=True)
    expect(page.locator(".panel-response h2")).to_have_text("Impulse response of pixel 81, 20")
    ink = page.locator(".response-plot .uplot canvas").evaluate(
        "(canvas) => new Set(new Uint32Array(canvas.getContext('2d')"
        ".getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size"
    )
    assert ink > 10, "an empty plot has but its axes' few colours"
    # a click into the response moves the light there
    over = page.locator(".response-plot .u-over")
    box = over.bounding_box()
    assert box is not None
    over.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
    shown = page.locator(".panel-transient [data-field=time]")
    expect(shown).to_have_text(re.compile(r"^21\.[678]"))  # half a period: 21.74 ns
    # the light so far at the pixel is shown
    page.get_by_role("tab", name="So far").click()
    page.evaluate("() => transientcam.store.player.seek(0.4)")
    light = cumulative(served, 0.4 / F_HZ)[20, 81]
    page.locator("canvas[data-renderer=closed-form][data-frame]").wait_for()
    density = page.locator(".panel-transient [data-field=density]")
    expect(density).to_have_text(re.compile(r"DN$"))
    so_far = float(text(page, ".panel-transient", "density").split()[0])
    assert so_far == pytest.approx(light, rel=2e-3, abs=0.6)


def cumulative(served: Served, time_s: float) -> NDArray[np.float32]:
    """Light up to a time in every pixel of the newest frame, as the daemon integrates it."""
    answer = httpx.get(
        f"{served.url}/api/v1/frames/latest/cumulative.npy", params={"time_s": time_s}
    ).raise_for_status()
    light: NDArray[np.float32] = np.load(io.BytesIO(answer.content))[0]
    return light


def test_light_so_far_is_what_the_daemon_integrates(page: Page, served: Served) -> None:
    open_page(page)
    page.get_by_role("tab", name="So far").click()
    page.locator("canvas[data-renderer=closed-form][data-frame]").wait_for()
    shows_frame(page, stop(served))
    look(page).get_by_label("Tone").select_option("linear")
    page.keyboard.press("Escape")
    white = float(str(transient_canvas(page).get_attribute("data-white")))
    for turn in (0.1, 0.27, 0.45, 0.9):
        light = cumulative(served, turn / F_HZ)
        expected = colours(light, 0.0, white, "inferno").astype(int)
        painted = transient_pixels(page, turn).astype(int)
        beside = np.abs(painted - expected).max(axis=-1) > 12
        assert beside.mean() < 0.005, "but for colours that round to their neighbours"
    assert expected.std() > 5
    # the gate shows what came within its nanosecond
    page.get_by_role("tab", name="Last 1 ns").click()
    page.locator("canvas[data-play=gate]").wait_for()
    turn = 0.27
    light = cumulative(served, turn / F_HZ) - cumulative(served, turn / F_HZ - 1e-9)
    expected = colours(light, 0.0, white, "inferno").astype(int)
    painted = transient_pixels(page, turn).astype(int)
    assert (np.abs(painted - expected).max(axis=-1) > 12).mean() < 0.005
    assert expected.std() > 5


def test_pictures_of_light_are_handed_out_as_on_screen(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    shown = transient_pixels(page, 0.27)
    with page.expect_download() as download:
        choose(page, "transient", "Picture (PNG)")
    with Image.open(download.value.path()) as image:
        np.testing.assert_array_equal(np.array(image.convert("RGBA")), shown)
    assert shown[..., :3].std() > 5
    # a strip shows light at the times it arrives
    page.evaluate("() => transientcam.store.player.seek(0.4)")
    before = text(page, ".panel-transient", "time")
    with page.expect_download() as download:
        choose(page, "transient", "Strip of 8 times (PNG)")
    with Image.open(download.value.path()) as image:
        strip = np.array(image.convert("RGB"))
    assert strip.shape == (2 * 134, 4 * 165 - 2, 3)
    pictures = [
        strip[134 * row : 134 * row + 120, 165 * column : 165 * column + 163]
        for row in range(2)
        for column in range(4)
    ]
    for one, other in pairwise(pictures):
        assert np.mean(one != other) > 0.05, "the light has moved"
    assert text(page, ".panel-transient", "time") == before, "and is where it was"


def test_a_film_and_a_figure_are_handed_out(page: Page, served: Served) -> None:
    open_page(page)
    choose(page, "transient", "Film of one pass (WebM)")
    filming = page.locator(".filming")
    expect(filming).to_contain_text(re.compile("Filming [1-9]"))
    filming.get_by_role("button", name="Cancel").click()
    expect(filming).to_have_count(0)
    shows_frame(page, stop(served))
    page.locator(".panel-transient").get_by_label("Speed").select_option("20")
    before = text(page, ".panel-transient", "time")
    with page.expect_download() as download:
        choose(page, "transient", "Film of one pass (GIF)")
    with Image.open(download.value.path()) as film:
        pictures = [np.array(each.convert("RGB")) for each in ImageSequence.Iterator(film)]
    assert len(pictures) > 10
    assert all(np.mean(one != other) > 0.001 for one, other in pairwise(pictures))
    assert text(page, ".panel-transient", "time") == before, "the light is where it was"
    with page.expect_download() as download:
        choose(page, "transient", "Film of one pass (WebM)")
    content = download.value.path().read_bytes()
    assert content[:4] == b"\x1a\x45\xdf\xa3", "EBML, which WebM is written in"
    assert b"webm" in content[:64]
    with page.expect_download() as download:
        choose(page, "map", "Figure (PNG)")
    with Image.open(download.value.path()) as image:
        figure = np.array(image.convert("RGBA"))
    # 2 x 4 pixels of the figure for each of the sensor's, behind margins of 2 x 46 and 2 x 30
    middles = figure[64 : 64 + 8 * 120 : 8, 96 : 96 + 8 * 163 : 8]
    np.testing.assert_array_equal(middles, canvas_pixels(map_canvas(page)))


def test_figures_of_moving_light_show_the_time_they_state(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    for turn in (0.2, 0.35, 0.5):
        page.evaluate(
            """(turn) => { const { player } = transientcam.store;
                 player.speed_ns.value = 20; player.seek(turn); player.playing.value = true; }""",
            turn,
        )
        name, moving = figure_of_light(page)
        time_s = float(re.findall(r"-([0-9]+)ps-", name)[0]) * 1e-12
        page.evaluate(
            """(time_s) => { const { player, period_s } = transientcam.store;
                 player.playing.value = false; player.seek(time_s / period_s.value); }""",
            time_s,
        )
        assert figure_of_light(page)[0] == name
        # the name states whole picoseconds; between two pictures light moves for some hundred
        assert np.abs(moving - figure_of_light(page)[1]).mean() < 1.0


def figure_of_light(page: Page) -> tuple[str, NDArray[np.float64]]:
    """Name and pixels of a figure of the light, saved now."""
    with page.expect_download() as download:
        choose(page, "transient", "Figure (PNG)")
    with Image.open(download.value.path()) as image:
        return download.value.suggested_filename, np.array(image.convert("RGB"), dtype=np.float64)
