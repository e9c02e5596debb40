"""A page that asks for less: behind a link, or in a browser, that is too slow for all frames."""

import re

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

from tests.browser.dashboard import choose_from, open_page
from tests.browser.test_map import product
from tests.browser.thin_link import ThinLink
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon(slower=3.0)


def test_over_a_thin_link_less_is_asked_for_and_everything_again_once_it_is_wide(
    browser: Browser, served: Served
) -> None:
    with ThinLink(served.url).running() as link:
        context = browser.new_context(reduced_motion="reduce", base_url=link.url)
        context.set_default_timeout(60_000)
        page = context.new_page()
        open_page(page)
        exact = product(served, "range").astype(np.float64).ravel()
        page.evaluate(
            "() => { window.first = transientcam.store.frames.of('range').peek().values }"
        )
        sign = page.locator("[data-field=link]")
        page.get_by_role("button", name="Play").click()  # nobody waits for what rests
        link.rate_bytes_s = 5e5  # 0.9 MB a frame, of which the camera takes three a second
        expect(sign).to_contain_text("16 bits")
        expect(sign).to_have_attribute(
            "title", re.compile("carried 0.[1-9][0-9]*\u202fMB/s.* 16 bits")
        )
        # frames are all alike, but for the steps of the codes
        page.wait_for_function(
            """() => transientcam.store.frames.of('range').peek().values
                 .some((value, at) => Math.abs(value - first[at]) > 0)"""
        )
        values = page.evaluate(
            """() => Array.from(transientcam.store.frames.of('range').peek().values,
                 (value) => Number.isNaN(value) ? null : value)"""
        )
        shown = np.array([np.nan if each is None else each for each in values])
        step_m = (np.nanmax(exact) - np.nanmin(exact)) / 65534
        np.testing.assert_allclose(shown, exact, rtol=1e-6, atol=0.51 * step_m)
        page.get_by_role("button", name="Pause").click()
        expect(sign).to_have_count(0)
        page.wait_for_function(
            "() => transientcam.store.frames.of('range').peek().values.every((value, at) =>"
            " Object.is(value, first[at]))"
        )
        page.get_by_role("button", name="Play").click()
        expect(sign).to_contain_text("16 bits")
        link.rate_bytes_s = None
        # a laden machine may draw too slowly, whatever the link carries
        expect(sign.filter(has_text="16 bits")).to_have_count(0, timeout=120_000)
        context.close()


# However quick the machine is, each refresh of the screen takes a tenth of a second.
SLOW_REFRESHES = """
const refresh = () => {
  const end_ms = performance.now() + 100;
  while (performance.now() < end_ms);
  requestAnimationFrame(refresh);
};
requestAnimationFrame(refresh);
"""


def test_a_slow_browser_asks_for_fewer_frames_while_light_plays_unless_it_is_told_not_to(
    browser: Browser, served: Served
) -> None:
    context = browser.new_context(reduced_motion="reduce", base_url=served.url)
    context.set_default_timeout(60_000)
    context.add_init_script(SLOW_REFRESHES)
    page = context.new_page()
    open_page(page)
    sign = page.locator("[data-field=link]")
    expect(sign).to_have_count(0)
    page.get_by_role("button", name="Play").click()
    # no demand mends refreshes, so that what was tried is taken back some seconds later
    expect(sign.filter(has_text="Slow browser")).to_have_attribute(
        "title", re.compile("drew [0-9]+ pictures of the light a second")
    )
    choose_from(
        page,
        "Page: layout, colours, help",
        "Ask for less where link or browser is too slow \u2713",
    )
    expect(sign).to_have_count(0)
    context.close()
