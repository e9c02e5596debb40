"""The panel of sequence and accuracy: the front, the slider along it, plans, and the way back."""

import math
import re
import threading
from importlib import import_module
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import SEQUENCE_FIELDS
from tests.browser.dashboard import open_page, shows_frame, text
from tests.browser.test_accessibility import offences_of
from tests.browser.test_transient import stop
from tests.server.planning.calls import Here
from tests.serving import Served
from transientcam_server.planning import Progress

pytestmark = pytest.mark.shared_daemon

PANEL = ".panel-sequence"
PLANNED_MS = 300_000
"""A plan takes seconds of the processor, which compilers and other tests may have."""


@pytest.fixture(autouse=True)
def few_families(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is searched is no concern of the page's: little, so that it is found quickly."""
    monkeypatch.setattr(served.service.planning, "_process", Here())
    families = import_module("transientcam_server.planning._search.families")  # not the function
    monkeypatch.setattr(families, "HARMONICS", (1, 4))
    monkeypatch.setattr(families, "FREQUENCY_FACTORS", (1.0,))
    monkeypatch.setattr(families, "SEARCHED", ("single-frequency", "maximum-entropy"))


def number(shown: str) -> float:
    """A figure with its prefix, in the unit itself."""
    value, unit = shown.removeprefix("± ").split()[:2]
    factors = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "s": 1.0, "ms": 1e-3, "µs": 1e-6}
    return float(value) * factors[unit]


def running(served: Served) -> dict[str, Any]:
    """What the camera measures with, as a sequence is set."""
    document = httpx.get(f"{served.url}/api/v1/sequence").raise_for_status().json()
    return {name: document[name] for name in SEQUENCE_FIELDS}


def test_the_front_fills_and_its_slider_sets_a_sequence_that_can_be_undone(
    page: Page, served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()
    computed = served.service.planner.tradeoff_document

    def held_up(goal: Any, scene: Any, progress: Progress) -> Any:
        def show(document: dict[str, Any]) -> None:
            progress.show(document)
            if len(document["front"]) > 2:
                assert go_on.wait(120)

        return computed(goal, scene, progress.part(0.0, 1.0, show=show))

    monkeypatch.setattr(served.service.planner, "tradeoff_document", held_up)
    open_page(page)
    shows_frame(page, stop(served))
    began_with = running(served)
    page.locator(".performance").click()
    points = page.locator(".front-point")
    status = page.locator(f"{PANEL} [data-field=accuracy-status]")
    try:
        expect(points).to_have_count(3)
        expect(status).to_contain_text("captures of")
        expect(status.get_by_role("button", name="Cancel")).to_be_visible()
    finally:
        go_on.set()
    expect(status.get_by_role("progressbar")).to_have_count(0)
    front = (
        httpx.get(f"{served.url}/api/v1/tradeoff", timeout=120).raise_for_status().json()["front"]
    )
    expect(points).to_have_count(len(front))
    centres = centres_of(points)
    assert centres == sorted(centres), "more time to the right"
    assert [y for _, y in centres] == sorted(y for _, y in centres), "less error further down"
    expect(page.locator("[data-field=now]")).to_be_visible()
    expect(page.locator("[data-field=ghost]")).to_be_visible()
    # the header states shares of the picture, of which the panel has the median pixel
    page.wait_for_function("() => transientcam.store.rangeErrors.of('range_error').value !== null")
    stated = page.locator(f"{PANEL} [data-field=now_range_error_m]")
    expect(stated).to_have_attribute("title", re.compile("1 σ of noise and bias together"))
    shown = page.evaluate("() => transientcam.store.rangeErrors.of('range_error').value.meta")
    worth = shown["accuracy"]
    assert number(text(page, PANEL, "now_range_error_m").removeprefix("\u00b1 ")) == pytest.approx(
        math.hypot(worth["range_std_m"], worth["range_bias_m"]),
        rel=0.05,  # as plans have it
    )
    share, within = text(page, ".bar", "deviation").split(" % \u00b1 ")
    # of a camera that nobody calibrated drift could not be judged, so that it is a most
    assert worth["not_judged"] == ["drift"]
    assert float(share.removeprefix("≤ ")) == round(100 * worth["trusted_share"])
    assert number(within) == pytest.approx(worth["within_m"], rel=0.05)
    assert offences_of(page, within=PANEL) == []

    # a point is looked at, and nothing set
    middle = len(front) // 2
    plot = page.locator(".front svg").bounding_box()
    assert plot is not None
    x, y = centres[middle]
    page.mouse.click(plot["x"] + x, plot["y"] + y)
    expect(page.locator("[data-field=choice_exposure_s]")).to_be_visible()
    looked = front[middle]
    for name, expected in (
        ("range_error_m", looked["predicted"]["range_error_m"]["median"]),
        ("range_std_m", looked["predicted"]["range_std_m"]["median"]),
        ("range_bias_m", looked["predicted"]["range_bias_m"]),
        ("capture_s", looked["capture_s"]),
    ):
        assert number(text(page, PANEL, f"choice_{name}")) == pytest.approx(expected, rel=5e-3)
    assert running(served) == began_with

    # neither is what keys pass by, until they are let go
    slider = page.get_by_label("From fast to accurate")
    expect(slider).to_have_value(str(middle))
    slider.focus()
    page.keyboard.down("ArrowRight")
    expect(slider).to_have_value(str(middle + 1))
    assert running(served) == began_with
    page.keyboard.up("ArrowRight")
    undo = page.get_by_role("log").get_by_role("button", name="Undo")
    undo.wait_for()
    wanted = front[middle + 1]["sequence"]
    assert running(served) == {name: wanted[name] for name in SEQUENCE_FIELDS}
    exposure = page.locator(f"{PANEL} [data-field=exposure_s]")
    expect(exposure).to_be_visible()
    assert number(str(exposure.text_content()).replace("\u202f", " ")) == pytest.approx(
        wanted["exposure_s"], rel=5e-3
    )
    undo.click()
    page.wait_for_function(
        "(exposure_s) => transientcam.store.sequence.peek().exposure_s === exposure_s",
        arg=began_with["exposure_s"],
    )
    assert running(served) == began_with


def test_a_target_is_planned_for_refused_in_words_or_given_up(
    page: Page, served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    panel = page.locator(PANEL)
    panel.get_by_text("Plan for a target").click()
    plan = page.get_by_role("button", name="Plan", exact=True)
    expect(plan).to_be_disabled()
    page.evaluate(
        "() => { transientcam.store.measures.region.value = { x0: 40, y0: 30, x1: 99, y1: 79 }; }"
    )
    page.get_by_label("Error at most").fill("20")
    plan.click()
    panel.locator("[data-field=choice_range_error_m]").wait_for(timeout=PLANNED_MS)
    outline = panel.locator("[data-field=planned_region]")
    expect(outline).to_have_attribute("points", "40.5,30.5 99.5,30.5 99.5,79.5 40.5,79.5")
    assert number(text(page, PANEL, "choice_range_error_m")) <= 20e-3
    page.get_by_label("Error at most").fill("1e-9")
    plan.click()
    status = panel.locator("p.refusal[data-field=accuracy-status]")
    status.wait_for(timeout=PLANNED_MS)
    assert "error of the range" in str(status.text_content())
    expect(panel.locator("[data-field=choice_range_error_m]")).to_have_count(0)

    began, pause = threading.Event(), threading.Event()

    def endless(goal: object, scene: object, progress: Progress) -> None:
        began.set()
        while True:
            progress()
            pause.wait(0.01)

    monkeypatch.setattr(served.service.planner, "plan_document", endless)
    plan.click()
    assert began.wait(60)
    panel.get_by_role("button", name="Cancel").click()
    expect(panel.get_by_role("progressbar")).to_have_count(0)
    jobs = httpx.get(f"{served.url}/api/v1/jobs").json()["jobs"]
    assert jobs[0]["state"] == "cancelled"


def centres_of(points: Locator) -> list[list[float]]:
    """Where the dots of a front are drawn."""
    centres: list[list[float]] = points.evaluate_all(
        "(all) => all.map((each) => { const dot = each.querySelector('circle');"
        " return [Number(dot.getAttribute('cx')), Number(dot.getAttribute('cy'))]; })"
    )
    return centres
