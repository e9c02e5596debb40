"""Frames of many pixels: the stream announces them, and the page requests them."""

import re

import numpy as np
import pytest
from playwright.sync_api import Page

from tests.browser.conftest import Watch
from tests.browser.dashboard import open_page, shows_frame
from tests.browser.test_map import product, stop
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon("sim:mirrors?noise=off&width=320&height=240", slower=10.0)

OF_A_FRAME = re.compile(r"GET .*/api/v1/frames/([0-9]+)/(\w+)\.msgpack")


def requested(watch: Watch) -> set[tuple[int, str]]:
    """Frames and products that the page requested by number, but for what ranges are worth."""
    found = (OF_A_FRAME.fullmatch(each) for each in watch.requests)
    numbered = {(int(each[1]), each[2]) for each in found if each is not None}
    return {each for each in numbered if not each[1].startswith(("range_", "trust"))}


def shows_another_frame(page: Page, name: str) -> int:
    """Wait until a product of a newer frame is shown; its number."""
    shown = page.evaluate_handle(
        "(name) => transientcam.store.frames.of(name).peek()?.meta.frame ?? 0", name
    )
    newer = page.wait_for_function(
        """([name, shown]) => { const { frame } = transientcam.store.frames.of(name).peek().meta;
             return frame > shown && frame }""",
        arg=[name, shown],
    )
    number: int = newer.json_value()
    return number


def test_large_frames_are_requested_and_shown_as_they_are(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    for name in ("coefficients", "range"):
        assert (shows_another_frame(page, name), name) in requested(watch)
    shows_frame(page, stop(served))

    for name in ("coefficients", "range"):
        values = page.evaluate(
            """(name) => Array.from(transientcam.store.frames.of(name).peek().values,
                 (value) => Number.isNaN(value) ? null : value)""",
            name,
        )
        shown = np.array([np.nan if each is None else each for each in values], np.float32)
        np.testing.assert_array_equal(shown, product(served, name).ravel(), err_msg=name)


def test_what_is_chosen_later_is_requested_of_the_frames_from_then_on(
    page: Page, watch: Watch
) -> None:
    open_page(page)
    page.get_by_role("tab", name="Direct", exact=True).click()
    page.locator(".panel-map canvas[data-product=direct][data-frame]").wait_for()

    assert (shows_another_frame(page, "direct"), "direct") in requested(watch)


def test_frames_come_by_the_stream_where_requests_are_refused(page: Page, watch: Watch) -> None:
    watch.refusals_expected = True
    page.route(
        re.compile(OF_A_FRAME.pattern.removeprefix("GET ")), lambda route: route.fulfill(status=429)
    )
    open_page(page)

    for _ in range(3):
        shows_another_frame(page, "range")
    assert len(requested(watch)) == 1
