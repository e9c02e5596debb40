"""The simulated scene, its effects and its faults, from the page."""

import re
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.conftest import Watch, put
from tests.browser.dashboard import LIVE, choose, drop, map_pixels, open_page, point_at
from tests.serving import Served

PATIENCE_MS = 60_000

# a scene other than the usual one
pytestmark = pytest.mark.shared_daemon("sim:wall?noise=off")


@pytest.fixture(autouse=True)
def wall(served: Served) -> Iterator[None]:
    """The wall without forced effects at the end of each test."""
    yield
    put(served, "simulation", {"scene": "wall", "effects": {}})


def simulated(served: Served) -> dict[str, Any]:
    document: dict[str, Any] = httpx.get(f"{served.url}/api/v1/simulation").json()
    return document


def test_the_camera_is_put_before_another_scene(page: Page, served: Served) -> None:
    open_page(page)
    held_up: list[Route] = []

    def hold(route: Route) -> None:
        held_up.append(route)

    page.route("**/simulation/explain", hold)
    choose(page, "sequence", "Simulated scene")
    panel = page.locator(".panel-simulation")
    scene = panel.get_by_label("Scene")
    expect(scene).to_have_value("wall")
    unplug = panel.get_by_role("button", name="Unplug")
    before = unplug.bounding_box()
    while not held_up:
        page.wait_for_timeout(50)
    for route in held_up:
        route.continue_()
    page.unroute("**/simulation/explain")
    panel.locator(".effect-table").wait_for()
    assert unplug.bounding_box() == before, "nothing moves when the effects come"
    wall = map_pixels(page)
    scene.select_option("mirrors")
    mirrors = panel.locator("[data-effect=mirror-paths]")
    expect(mirrors).to_have_attribute("data-built", "true", timeout=PATIENCE_MS)
    expect(scene).to_have_value("mirrors")
    page.wait_for_function(
        """() => transientcam.store.events.all.peek()
             .some(({ words }) => words === "The camera stands before mirrors.")"""
    )
    assert simulated(served)["scene"] == "mirrors"
    while np.mean(map_pixels(page) != wall) <= 0.2:  # frames of before may still be on their way
        page.wait_for_timeout(100)


def test_an_effect_is_forced_on_and_left_to_the_scene_again(page: Page, served: Served) -> None:
    open_page(page)
    choose(page, "sequence", "Simulated scene")
    panel = page.locator(".panel-simulation")
    ambient = panel.locator("[data-effect=ambient]")
    expect(ambient).to_have_attribute("data-built", "false")
    expect(ambient).to_contain_text("no")
    ambient.get_by_role("combobox").select_option("on")
    expect(ambient).to_have_attribute("data-built", "true", timeout=PATIENCE_MS)
    assert simulated(served)["effects"] == {"ambient": "on"}
    panel.get_by_role("button", name="Leave all to the scene").click()
    expect(ambient).to_have_attribute("data-built", "false", timeout=PATIENCE_MS)
    assert simulated(served)["effects"] == {}


def test_the_cable_is_pulled_and_an_image_lost(page: Page, served: Served) -> None:
    open_page(page)
    choose(page, "sequence", "Simulated scene")
    panel = page.locator(".panel-simulation")
    # buttons move when the table of effects arrives
    expect(panel.locator("[data-effect]").first).to_be_visible(timeout=PATIENCE_MS)
    expect(panel.get_by_role("button", name="Plug in")).to_be_disabled()
    panel.get_by_role("button", name="Unplug").click()
    expect(page.locator("[data-field=state]")).to_have_text("Camera lost")
    expect(panel.get_by_role("button", name="Unplug")).to_be_disabled()
    panel.get_by_role("button", name="Plug in").click()
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    expect(panel.get_by_role("button", name="Unplug")).to_be_enabled()
    before = page.evaluate("() => transientcam.store.status.lostImages.peek()")
    panel.get_by_role("button", name="Lose an image").click()
    page.wait_for_function(
        "(before) => transientcam.store.status.lostImages.peek() > before", arg=before
    )


# a wall of half the albedo and another distance than the built-in ones
OWN = """
name = "a wall of my own"
[light]
position_m = [0, 0, 0]
aim_at_m = [0, 1, 0]
electrons_per_s = 1e8
[[surface]]
kind = "diffuse"
centre_m = [0, 1.25, 0]
normal = [0, -1, 0]
size_m = [4, 4]
albedo = 0.5
"""


def test_a_scene_is_opened_by_dropping_its_file(page: Page, served: Served, watch: Watch) -> None:
    watch.refusals_expected = True
    open_page(page)
    drop(page, "own.toml", OWN.replace("0.5", "5"))
    expect(page.locator(".toast", has_text="surface[0].albedo = 5")).to_be_visible()
    assert simulated(served)["scene"] == "wall"
    drop(page, "own.toml", OWN)
    expect(page.locator("[data-field=subject]")).to_have_text("simulated a wall of my own")
    expect(page.locator(".file-drop")).to_have_count(0)
    point_at(page, "map", 81, 60)
    expect(page.locator(".panel-map [data-field=value]")).to_have_text(re.compile(r"^1\.2\d"))
    assert simulated(served)["scene"] == "a wall of my own"
