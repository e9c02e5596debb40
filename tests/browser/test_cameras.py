"""The page with the cameras of the network."""

from dataclasses import replace

import pytest
from playwright.sync_api import Page, expect

from tests.serving import Served
from transientcam.discovery import FoundCamera, Search
from transientcam_server.api._neighbours import NeighbourSearch

pytestmark = pytest.mark.shared_daemon

BENCH = FoundCamera(
    name="bench 2",
    url="http://192.168.1.20:8000",
    serial="TC-0007",
    firmware="1.2",
    api="v1",
    tls=False,
    model="AMCW lidar",
    state="lost",
)
MARKUP = "<img src=x onerror=alert(1)>\"'&amp;"


def announce(served: Served, *cameras: FoundCamera, left_out: int = 0) -> None:
    search = NeighbourSearch(lambda: Search(cameras, left_out))
    served.app.state.neighbours = search


def test_cameras_are_listed_with_links_to_their_dashboards(page: Page, served: Served) -> None:
    announce(served, BENCH)
    page.goto("/cameras")
    expect(page.locator("#message")).to_have_text("1 camera.")
    cells = page.locator("tbody td")
    expect(cells).to_have_text(["bench 2", BENCH.url, "AMCW lidar", "TC-0007", "lost", "now"])
    expect(page.locator("tbody a")).to_have_attribute("href", BENCH.url)


def test_cameras_stand_side_by_side(page: Page, served: Served) -> None:
    announce(served, replace(BENCH, url=served.url), replace(BENCH, url="javascript:alert(1)"))
    page.goto("/cameras")
    expect(page.locator("iframe")).to_have_count(0)
    page.get_by_role("link", name="maps").click()
    expect(page.locator("iframe")).to_have_count(1)
    within = page.frame_locator("iframe")
    within.locator(".panel-map canvas[data-frame]").wait_for()
    expect(within.get_by_role("button", name="Light off")).to_be_visible()
    page.get_by_role("link", name="the list alone").click()
    expect(page.locator("iframe")).to_have_count(0)


def test_what_a_hostile_host_announces_is_text(page: Page, served: Served) -> None:
    hostile = replace(
        BENCH, name=MARKUP, url=f"javascript:{MARKUP}", model=MARKUP, serial=MARKUP, state=""
    )
    announce(served, hostile, left_out=3)
    page.goto("/cameras")
    expect(page.locator("#message")).to_have_text(
        "1 camera; 3 more were announced and are not listed."
    )
    cells = page.locator("tbody td")
    expect(cells.nth(0)).to_have_text(MARKUP)
    expect(cells.nth(2)).to_have_text(MARKUP)
    expect(cells.nth(4)).to_have_text("not announced")
    assert page.locator("tbody img").count() == 0
    assert page.locator("tbody a").get_attribute("href") is None


def test_an_empty_network_is_said_so(page: Page, served: Served) -> None:
    announce(served)
    page.goto("/cameras")
    expect(page.locator("#message")).to_have_text("No camera announces itself on this network.")
    expect(page.locator("table")).to_be_hidden()
