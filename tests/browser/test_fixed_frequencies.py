"""The page of a camera whose frequencies have gaps: what it has is shown, the rest says why not."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch
from tests.server.camera.plug_in import install

DISTANCE_M = 12.5
WHY = "it needs consecutive multiples of one frequency, and this camera measures the multiples"


@pytest.fixture
def camera(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The camera of another distribution, at 16, 80 and 120 MHz."""
    monkeypatch.syspath_prepend(str(install(tmp_path)))
    wall = tmp_path / "wall.txt"
    wall.write_text(str(DISTANCE_M))
    yield f"wall:{wall}?frequencies=fixed"
    sys.modules.pop("wall_camera", None)


def test_it_shows_points_and_returns_and_says_what_it_lacks(page: Page, watch: Watch) -> None:
    watch.refusals_expected = True  # of a plan
    page.goto("/?debug")

    points = page.locator("canvas[data-product=points]")
    expect(points).to_have_attribute("data-points", re.compile(r"^[1-9]"))
    expect(page.locator("[data-view=transient]")).to_have_count(0)
    validity = page.get_by_role("tab", name="Validity", exact=True)
    expect(validity).to_have_attribute("aria-disabled", "true")
    expect(validity).to_have_attribute("title", re.compile(WHY))
    response = page.locator("[data-view=response]")
    expect(response.locator("[data-field=absent]")).to_contain_text(WHY)
    expect(response.locator("[data-field=pixel-range]")).to_have_text(re.compile(r"^12\.50\d"))

    page.get_by_role("button", name="Predict").click()
    finding = page.locator("[data-view=sequence]")
    expect(finding).to_contain_text("Plans are made for")
