"""The reconstruction's settings and the calibrations, set from the page."""

import re
import struct
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch
from tests.browser.dashboard import LIVE, choose, choose_from, open_page, shows_frame
from tests.browser.test_map import product, stop
from tests.serving import Served

# A measurement captures every frame twice, and is evaluated.
PATIENCE_MS = 60_000


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


def test_settings_that_somebody_else_changed_meanwhile_are_not_overwritten(
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


class TestCalibrations:
    @pytest.fixture
    def camera(self) -> str:
        """A camera before the diffusor."""
        return "sim:calibration?seed=3"

    def test_one_is_measured_used_and_watched(self, page: Page, served: Served) -> None:
        open_page(page)
        choose(page, "response", "Calibration")
        panel = page.locator(".panel-calibration")
        panel.get_by_label("Name", exact=True).fill("after warm-up")
        panel.get_by_label("Frames, with and without light").fill("8")
        panel.get_by_role("button", name="Measure").click()
        expect(panel.locator("progress")).to_be_visible()
        expect(page.locator("[data-field=state]")).to_have_text("Calibrating")
        expect(page.get_by_role("button", name="Stop", exact=True)).to_be_disabled()
        outcome = panel.locator("[data-field=calibration-outcome]")
        expect(outcome).to_contain_text("Measured", timeout=PATIENCE_MS)
        row = panel.locator("[data-calibration]").last
        expect(row).to_contain_text("after warm-up")
        expect(row).to_contain_text("in use")
        expect(page.locator("[data-field=state]")).to_have_text(LIVE)
        listed = httpx.get(f"{served.url}/api/v1/calibrations").json()
        assert listed["active"] == listed["calibrations"][0]["id"]
        page.wait_for_function(
            "(id) => transientcam.store.frames.of('range').peek()?.meta.calibration_id === id",
            arg=listed["active"],
        )
        page.evaluate("() => transientcam.store.calibrations.refresh()")
        expect(row.locator("[data-field=drift]")).to_contain_text("contradict themselves")

        # another sequence, another calibration: it says why, and waits
        httpx.put(f"{served.url}/api/v1/sequence", json={"harmonics": 2}).raise_for_status()
        expect(row.locator("[data-field=misfit]")).to_contain_text("harmonics")
        expect(row).to_contain_text("waits for its sequence")
        expect(page.locator(".toast", has_text="Nominal gains")).to_be_visible()

    def test_one_of_a_scene_is_used_only_on_a_second_click_and_undone(
        self, page: Page, served: Served
    ) -> None:
        httpx.put(f"{served.url}/api/v1/simulation", json={"scene": "mirrors"}).raise_for_status()
        open_page(page)
        choose(page, "response", "Calibration")
        panel = page.locator(".panel-calibration")
        outcome = panel.locator("[data-field=calibration-outcome]")
        panel.get_by_label("Frames, with and without light").fill("3")
        panel.get_by_role("button", name="Measure").click()
        expect(outcome).to_contain_text("a scene, not a diffusor", timeout=PATIENCE_MS)
        row = panel.locator("[data-calibration]").nth(1)
        expect(row.locator("[data-field=verdict]")).to_have_text("of a scene")
        expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")
        row.get_by_role("button", name="Use").click()
        expect(row.locator("[data-field=doubt]")).to_contain_text("unlike a diffusor")
        expect(row.get_by_role("img")).to_be_visible()
        expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")
        row.get_by_role("button", name="Use anyway").click()
        expect(row).to_contain_text("in use")
        panel.get_by_role("button", name="Return to the nominal gains").click()
        expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")

    def test_the_diffusor_of_a_simulated_camera_is_put_before_the_lens(
        self, page: Page, served: Served
    ) -> None:
        httpx.put(f"{served.url}/api/v1/simulation", json={"scene": "mirrors"}).raise_for_status()
        open_page(page)
        choose(page, "response", "Calibration")
        panel = page.locator(".panel-calibration")
        panel.get_by_role("button", name="Put the diffusor before the lens").click()
        taking = panel.get_by_role("button", name="Take the diffusor away")
        expect(taking).to_be_visible(timeout=PATIENCE_MS)
        panel.get_by_label("Frames, with and without light").fill("3")
        panel.get_by_role("button", name="Measure").click()
        outcome = panel.locator("[data-field=calibration-outcome]")
        expect(outcome).to_contain_text("Measured: ", timeout=PATIENCE_MS)
        expect(panel.locator("[data-calibration]").nth(1)).to_contain_text("in use")
        taking.click()
        expect(panel.get_by_role("button", name="Put the diffusor before the lens")).to_be_visible()
        assert httpx.get(f"{served.url}/api/v1/simulation").json()["scene"] == "mirrors"

    def test_one_is_exported_deleted_and_imported(
        self, page: Page, served: Served, tmp_path: Path
    ) -> None:
        url = f"{served.url}/api/v1/calibrations"
        job = httpx.post(url, json={"name": "bench", "frames": 2}).raise_for_status().json()
        jobs = f"{served.url}/api/v1/jobs/{job['id']}"
        result = httpx.get(jobs, params={"wait_s": 30}, timeout=60).json()["result"]
        identity = result["calibration"]
        open_page(page)
        choose(page, "response", "Calibration")
        panel = page.locator(".panel-calibration")
        with page.expect_download() as download:
            panel.get_by_role("button", name="Export bench").click()
        exported = tmp_path / "bench.npz"
        download.value.save_as(exported)
        assert exported.read_bytes() == httpx.get(f"{url}/{identity}/file").content
        row = panel.locator(f"[data-calibration='{identity}']")
        choose_from(row, "More of bench", "Delete…")
        confirm = page.get_by_role("dialog", name="Delete this calibration?")
        confirm.get_by_role("button", name="Delete").click()
        expect(row).to_have_count(0)
        assert httpx.get(url).json()["calibrations"] == []
        panel.get_by_label("File of a calibration").set_input_files(exported)
        expect(row).to_contain_text("bench")
        row.get_by_role("button", name="Use").click()
        expect(row).to_contain_text("in use")
        assert httpx.get(url).json()["active"] == identity
        panel.locator("[data-calibration=nominal]").get_by_role("button", name="Use").click()
        expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")

    def test_a_measurement_is_cancelled(self, page: Page, served: Served) -> None:
        open_page(page)
        choose(page, "response", "Calibration")
        panel = page.locator(".panel-calibration")
        panel.get_by_label("Frames, with and without light").fill("400")
        panel.get_by_role("button", name="Measure").click()
        panel.get_by_role("button", name="Cancel").click()
        outcome = panel.locator("[data-field=calibration-outcome]")
        expect(outcome).to_have_text("The measurement was cancelled.", timeout=PATIENCE_MS)
        assert httpx.get(f"{served.url}/api/v1/calibrations").json()["calibrations"] == []

    def test_a_file_that_is_no_calibration_is_refused_in_words(
        self, page: Page, served: Served, watch: Watch, tmp_path: Path
    ) -> None:
        open_page(page)
        choose(page, "response", "Calibration")
        watch.refusals_expected = True
        wrong = tmp_path / "wrong.npz"
        wrong.write_bytes(b"PK\x03\x04 and no more")
        page.get_by_label("File of a calibration").set_input_files(wrong)
        expect(page.locator("[data-field=calibration-status].refusal")).to_have_text(
            re.compile(".{10,}")
        )


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
        choose(page, "points", "Points as shown (PLY)")
    head, _, body = Path(download.value.path()).read_bytes().partition(b"end_header\n")
    assert f"element vertex {valid.sum()}".encode() in head
    assert len(body) == struct.calcsize("<3f3B") * valid.sum()
    points = np.array([point[:3] for point in struct.iter_unpack("<3f3B", body)])
    y, x = np.nonzero(valid)
    rays = np.stack([(x - lens["cx"]) / lens["fx"], (y - lens["cy"]) / lens["fy"], np.ones_like(x)])
    expected = rays / np.linalg.norm(rays, axis=0) * ranges[valid]
    np.testing.assert_allclose(points.T, expected, rtol=1e-4, atol=1e-5)
    with page.expect_download() as download:
        choose(page, "points", "Points with light and flags (PLY)")
    assert b"property float amplitude" in Path(download.value.path()).read_bytes()[:400]
