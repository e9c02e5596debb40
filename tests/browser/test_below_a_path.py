"""The page below a path of a proxy, and a tab that slept while its connections ended."""

from urllib.parse import urlsplit

from playwright.sync_api import Page

from tests.browser.conftest import Watch
from tests.browser.dashboard import open_page
from tests.serving import Served
from tests.surroundings.proxies import below_a_path
from transientcam import Camera

_NEWER = """
(frame) => Number(document.querySelector(".panel-map canvas[data-frame]").dataset.frame) > frame
"""


def test_it_runs_below_a_path_and_goes_on_after_its_tab_was_asleep(
    page: Page, served: Served, watch: Watch
) -> None:
    with below_a_path(served.url, stripped=True) as proxy:
        watch.host = urlsplit(proxy.url).netloc
        open_page(page, f"{proxy.url}/?debug")
        shown = page.locator(".panel-map canvas[data-frame]").get_attribute("data-frame")
        page.wait_for_function(_NEWER, arg=int(shown or 0))
        tab = page.context.new_cdp_session(page)

        tab.send("Page.setWebLifecycleState", {"state": "frozen"})
        proxy.cut()
        with Camera(served.url) as camera:
            last = camera.latest()["frame"]
        tab.send("Page.setWebLifecycleState", {"state": "active"})

        page.wait_for_function(_NEWER, arg=last)
        # what was asked for when it was cut
        watch.complaints = [each for each in watch.complaints if "net::ERR_" not in each]
        page.close()
    assert all(f"{proxy.url}/" in request for request in watch.requests if "http" in request)
