"""The player of notebooks in a page that is a host of anywidgets and nothing else."""

import base64
import json
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.dashboard import canvas_pixels
from tests.serving import Served
from transientcam import Camera, density, player
from transientcam.player_widget import MODULE, PlayerWidget

pytestmark = pytest.mark.shared_daemon()

# A host as anywidget's documentation states it: a module whose `render` is given a model.
_HOST = """
<!doctype html><meta charset="utf-8"><div id="cell"></div>
<script type="module">
  import widget from "/player.js";
  const state = decoded(await began());
  const listeners = new Map();
  const changed = {};
  const model = {
    get: (name) => state[name],
    set: (name, value) => { changed[name] = state[name] = value; },
    save_changes: () => {
      void saved(JSON.stringify(changed));
      for (const each in changed) delete changed[each];
    },
    on: (event, listener) => listeners.set(event, listener),
    off: (event) => listeners.delete(event),
  };
  function decoded(message) {
    if ("coefficients" in message) {
      const bytes = Uint8Array.from(atob(message.coefficients), (each) => each.charCodeAt(0));
      message.coefficients = new DataView(bytes.buffer);
    }
    return message;
  }
  window.arrived = (message) => {
    Object.assign(state, decoded(message));
    for (const name in message) listeners.get(`change:${name}`)?.();
  };
  window.end = widget.render({ model, el: document.getElementById("cell") });
</script>
"""


class Host:
    """Carries the state between a widget and its page."""

    def __init__(self, page: Page, widget: PlayerWidget, url: str) -> None:
        self._page = page
        self._widget = widget
        self._outgoing: list[dict[str, Any]] = []
        widget.observe(lambda change: self._outgoing.append({change.name: change.new}))
        page.expose_function("began", lambda: encoded(widget.get_state()))
        page.expose_function("saved", self._saved)
        page.route(
            "**/host.html", lambda route: route.fulfill(body=_HOST, content_type="text/html")
        )
        page.route("**/player.js", _module)
        page.goto(f"{url}/host.html")

    def _saved(self, changes: str) -> None:
        self._widget.set_state(json.loads(changes))

    def deliver(self) -> None:
        """Hand on what the widget changed."""
        state: dict[str, Any] = {}
        while self._outgoing:
            state |= self._outgoing.pop(0)
        self._page.evaluate("(state) => arrived(state)", encoded(state))


def _module(route: Route) -> None:
    route.fulfill(body=MODULE.read_bytes(), content_type="text/javascript")


def encoded(state: dict[str, Any]) -> dict[str, Any]:
    """State without the widget's own and its module; bytes as base64."""
    return {
        name: base64.b64encode(value).decode() if isinstance(value, bytes) else value
        for name, value in state.items()
        if not name.startswith("_") and name not in ("layout", "tabbable", "tooltip")
    }


def brightness(page: Page) -> np.ndarray[Any, Any]:
    found: np.ndarray[Any, Any] = canvas_pixels(page.locator("canvas"))[..., :3].sum(axis=-1)
    return found


def test_light_is_scrubbed_and_a_live_one_shows_newer_frames(page: Page, served: Served) -> None:
    with Camera(served.url, timeout_s=60.0) as camera:
        widget = player(camera, rate_hz=100.0, time_s=11.3e-9)
        first = widget.shape["frame"]
        host = Host(page, widget, served.url)
        readout = page.locator("output").first
        expect(readout).to_contain_text("11.30")
        expect(page.locator("canvas")).to_have_attribute("data-frame", str(first))

        # what is drawn is the density of Eq. (2), as the client evaluates it
        coefficients = camera.frame("coefficients").array
        drawn = brightness(page)
        wanted = density(coefficients, 2 * np.pi * 23e6 * 11.3e-9)
        order = np.argsort(wanted, axis=None)
        dark, bright = drawn.ravel()[order[:2000]], drawn.ravel()[order[-2000:]]
        assert bright.min() > dark.max()

        slider = page.get_by_role("slider", name="Time of flight")
        slider.fill("0.5")
        expect(readout).to_contain_text("21.74")
        slider.dispatch_event("change")
        while widget.time_s == 11.3e-9:
            page.wait_for_timeout(10)
        assert widget.time_s == pytest.approx(0.5 / 23e6)

        # the page asked for a newer frame by itself, and it comes
        camera.latest(after=first, wait_s=10)
        while widget.shape["frame"] == first:
            host.deliver()
            page.wait_for_timeout(10)
        host.deliver()
        expect(page.locator("canvas")).not_to_have_attribute("data-frame", str(first))

        page.get_by_role("button", name="Play").click()
        expect(readout).not_to_contain_text("21.74")
        page.get_by_role("button", name="Pause").click()
        page.evaluate("end()")
        expect(page.locator(".transientcam-player")).to_have_count(0)
