"""A page that asks for less: behind a link, or in a browser, that is too slow for all frames."""

import re

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.dashboard import choose_from, open_page
from tests.browser.test_map import product
from tests.browser.thin_link import ThinLink
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon(slower=3.0)


def open_refreshed(browser: Browser, url: str, every_ms: str) -> Page:
    """Open a page whose clock goes on by so much at each refresh, however seldom these come."""
    context = browser.new_context(reduced_motion="reduce", base_url=url)
    context.set_default_timeout(60_000)
    context.add_init_script(f"""
        let now_ms = Date.now();
        Date.now = () => now_ms;
        const refresh = () => {{
          now_ms += {every_ms};
          requestAnimationFrame(refresh);
        }};
        requestAnimationFrame(refresh);
    """)
    page = context.new_page()
    open_page(page)
    return page


def test_over_a_thin_link_less_is_asked_for_and_everything_once_light_rests(
    browser: Browser, served: Served
) -> None:
    with ThinLink(served.url).running() as link:
        page = open_refreshed(browser, link.url, "1000 / 60")
        exact = product(served, "range").astype(np.float64).ravel()
        page.evaluate(
            "() => { window.first = transientcam.store.frames.of('range').peek().values }"
        )
        sign = page.locator("[data-field=link]")
        page.get_by_role("button", name="Play").click()  # nobody waits for what rests
        link.rate_bytes_s = 5e5  # 0.9 MB a frame, of which the camera takes three a second
        expect(sign).to_contain_text("16 bits")
        expect(sign).to_have_attribute(
            "title", re.compile("carried 0[.][0-9]+\u202fMB/s.* 16 bits")
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
        page.context.close()


def test_a_slow_browser_asks_for_fewer_frames_while_light_plays_unless_it_is_told_not_to(
    browser: Browser, served: Served
) -> None:
    # less helps, so that it goes on being asked for; it never makes light flow
    page = open_refreshed(
        browser, served.url, "(document.querySelector('[data-field=link]') ? 40 : 100)"
    )
    sign = page.locator("[data-field=link]")
    expect(sign).to_have_count(0)
    page.get_by_role("button", name="Play").click()
    expect(sign).to_have_attribute(
        "title", re.compile("drew [0-9]+ pictures of the light a second")
    )
    choose_from(
        page, "Page: layout, colours, help", "Ask for less where link or browser is too slow \u2713"
    )
    expect(sign).to_have_count(0)
    page.context.close()
