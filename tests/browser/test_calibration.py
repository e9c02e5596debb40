"""Calibrations, measured, used and kept from the page."""

import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch, put
from tests.browser.dashboard import LIVE, choose, choose_from, open_page
from tests.serving import Served

# a camera before the diffuser, of which many frames are captured
pytestmark = pytest.mark.shared_daemon("sim:calibration?seed=3", slower=1.0)

# A measurement captures every frame twice, and is evaluated.
PATIENCE_MS = 60_000


@pytest.fixture(autouse=True)
def uncalibrated(served: Served) -> Iterator[None]:
    """The nominal gains and no others, before the diffuser, at the end of each test."""
    yield
    put(served, "calibrations/active", {"id": "nominal"})
    for each in httpx.get(f"{served.url}/api/v1/calibrations").json()["calibrations"]:
        httpx.delete(f"{served.url}/api/v1/calibrations/{each['id']}").raise_for_status()
    if httpx.get(f"{served.url}/api/v1/simulation").json()["scene"] != "calibration":
        put(served, "simulation", {"scene": "calibration"})


def test_one_is_measured_used_and_watched(page: Page, served: Served) -> None:
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
    page: Page, served: Served
) -> None:
    put(served, "simulation", {"scene": "mirrors"})
    open_page(page)
    choose(page, "response", "Calibration")
    panel = page.locator(".panel-calibration")
    outcome = panel.locator("[data-field=calibration-outcome]")
    panel.get_by_label("Frames, with and without light").fill("3")
    panel.get_by_role("button", name="Measure").click()
    expect(outcome).to_contain_text("a scene, not a diffuser", timeout=PATIENCE_MS)
    row = panel.locator("[data-calibration]").nth(1)
    expect(row.locator("[data-field=verdict]")).to_have_text("of a scene")
    expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")
    row.get_by_role("button", name="Use").click()
    expect(row.locator("[data-field=doubt]")).to_contain_text("unlike a diffuser")
    expect(row.get_by_role("img")).to_be_visible()
    expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")
    row.get_by_role("button", name="Use anyway").click()
    expect(row).to_contain_text("in use")
    panel.get_by_role("button", name="Return to the nominal gains").click()
    expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")


def test_the_diffuser_of_a_simulated_camera_is_put_before_the_lens(
    page: Page, served: Served
) -> None:
    put(served, "simulation", {"scene": "mirrors"})
    open_page(page)
    choose(page, "response", "Calibration")
    panel = page.locator(".panel-calibration")
    panel.get_by_role("button", name="Put the diffuser before the lens").click()
    taking = panel.get_by_role("button", name="Take the diffuser away")
    expect(taking).to_be_visible(timeout=PATIENCE_MS)
    panel.get_by_label("Frames, with and without light").fill("3")
    panel.get_by_role("button", name="Measure").click()
    outcome = panel.locator("[data-field=calibration-outcome]")
    expect(outcome).to_contain_text("Measured: ", timeout=PATIENCE_MS)
    expect(panel.locator("[data-calibration]").nth(1)).to_contain_text("in use")
    taking.click()
    expect(panel.get_by_role("button", name="Put the diffuser before the lens")).to_be_visible()
    assert httpx.get(f"{served.url}/api/v1/simulation").json()["scene"] == "mirrors"


def test_one_is_exported_deleted_and_imported(page: Page, served: Served, tmp_path: Path) -> None:
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
    import_file(page, exported)
    expect(row).to_contain_text("bench")
    row.get_by_role("button", name="Use").click()
    expect(row).to_contain_text("in use")
    assert httpx.get(url).json()["active"] == identity
    panel.locator("[data-calibration=nominal]").get_by_role("button", name="Use").click()
    expect(panel.locator("[data-calibration=nominal]")).to_contain_text("in use")


def import_file(page: Page, file: Path) -> None:
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import…").click()
    chooser.value.set_files(file)


def test_a_measurement_is_cancelled(page: Page, served: Served) -> None:
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
    page: Page, served: Served, watch: Watch, tmp_path: Path
) -> None:
    open_page(page)
    choose(page, "response", "Calibration")
    watch.refusals_expected = True
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(b"PK\x03\x04 and no more")
    import_file(page, wrong)
    expect(page.locator("[data-field=calibration-status].refusal")).to_have_text(
        re.compile(".{10,}")
    )
