"""The settings of reconstruction and sequence, set from the page."""

import re
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch
from tests.browser.dashboard import choose, open_page, shows_frame
from tests.browser.test_map import product, stop
from tests.serving import Served

pytestmark = pytest.mark.shared_daemon


def reconstruction(served: Served) -> dict[str, Any]:
    document: dict[str, Any] = httpx.get(f"{served.url}/api/v1/reconstruction").json()
    return document


def test_the_reconstruction_is_set_within_its_limits(page: Page, served: Served) -> None:
    open_page(page)
    choose(page, "sequence", "Reconstruction")
    panel = page.locator(".panel-reconstruction")
    smoothing = panel.get_by_label("Smoothing")
    smoothing.fill("11")
    expect(panel.locator(".refusal")).to_have_text(
        "Smoothing must be a number from 0 to 10\u202fpx."
    )
    expect(smoothing).to_have_attribute("aria-invalid", "true")
    expect(panel.get_by_role("button", name="Apply")).to_be_disabled()
    smoothing.fill("2.5")
    panel.get_by_label("Range by").select_option("maximum-entropy")
    panel.get_by_role("button", name="Apply").click()
    expect(panel.get_by_role("button", name="Apply")).to_have_count(0)
    reported = reconstruction(served)
    assert (reported["smoothing_px"], reported["estimator"]) == (2.5, "maximum-entropy")
    page.wait_for_function(
        "(id) => transientcam.store.frames.of('range').peek()?.meta.reconstruction_id === id",
        arg=reported["reconstruction_id"],
    )
    panel.get_by_role("button", name="The defaults").click()
    expect(smoothing).to_have_value("0.6")
    assert reconstruction(served)["estimator"] == "automatic"


def test_settings_that_another_client_changed_meanwhile_are_not_overwritten(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    choose(page, "sequence", "Reconstruction")
    panel = page.locator(".panel-reconstruction")
    panel.get_by_label("Bias").fill("0.01")
    url = f"{served.url}/api/v1/reconstruction"
    httpx.put(url, json={"smoothing_px": 3.0}).raise_for_status()
    expect(page.locator(".toast", has_text="of the reconstruction changed")).to_be_visible()
    watch.refusals_expected = True
    panel.get_by_role("button", name="Apply").click()
    expect(panel.locator("[data-field=reconstruction-status]")).to_have_class(re.compile("refusal"))
    assert reconstruction(served)["bias"] == 0.004
    panel.get_by_role("button", name="Undo").click()
    expect(panel.get_by_label("Smoothing")).to_have_value("3")


def test_takes_follow_each_other_as_chosen(page: Page, served: Served) -> None:
    open_page(page)
    page.get_by_role("button", name="Edit").click()
    order = page.get_by_label("Order of takes")
    expect(order).to_be_disabled()
    page.get_by_label("Takes", exact=True).fill("2")
    order.select_option(label="image by image")
    page.get_by_role("button", name="Apply").click()
    expect(page.locator(".panel-sequence [data-field=takes]")).to_have_text("2, image by image")
    applied = httpx.get(f"{served.url}/api/v1/sequence").json()
    assert (applied["takes"], applied["take_order"]) == (2, "interleaved")


def test_points_are_handed_out_where_the_lens_says(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    choose(page, "sequence", "Points in space")
    canvas = page.locator("canvas[data-product=points]")
    ranges = product(served, "range")
    valid = np.isfinite(ranges)
    expect(canvas).to_have_attribute("data-points", str(valid.sum()))
    lens = httpx.get(f"{served.url}/api/v1/camera").json()["intrinsics"]
    with page.expect_download() as download:
        choose(page, "points", "Points as streamed (CSV)")
    table = np.genfromtxt(Path(download.value.path()), delimiter=",", names=True)
    points = np.stack([table[f"{axis}_m"] for axis in "xyz"], axis=1)
    y, x = np.nonzero(valid)
    np.testing.assert_array_equal([table["column_px"], table["row_px"]], [x, y])
    np.testing.assert_allclose(table["range_m"], ranges[valid], rtol=1e-6)
    rays = np.stack([(x - lens["cx"]) / lens["fx"], (y - lens["cy"]) / lens["fy"], np.ones_like(x)])
    np.testing.assert_allclose(points.T, rays * points[:, 2], rtol=1e-4, atol=1e-5)
    light_m = [lens[f"light_{axis}_m"] for axis in "xyz"]
    path_m = np.linalg.norm(points, axis=1) + np.linalg.norm(points - light_m, axis=1)
    np.testing.assert_allclose(path_m, 2 * ranges[valid], rtol=1e-5)
    with page.expect_download() as download:
        choose(page, "points", "Points with light and flags (PLY)")
    assert b"property float amplitude" in Path(download.value.path()).read_bytes()[:400]
