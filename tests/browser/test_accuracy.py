import httpx
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watch
from tests.browser.dashboard import choose, open_page, shows_frame, text
from tests.browser.test_transient import stop
from tests.serving import Served

# Every sequence is weighed on the scene: seconds of work on a free machine.
PATIENCE_MS = 120_000


def number(shown: str) -> float:
    """A figure with its prefix, in the unit itself."""
    value, unit = shown.split()[:2]
    factors = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "s": 1.0, "ms": 1e-3, "µs": 1e-6}
    return float(value) * factors[unit]


def test_a_point_of_the_front_is_chosen_and_applied(page: Page, served: Served) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    choose(page, "response", "Accuracy against time")
    page.get_by_role("button", name="Predict").click()
    points = page.locator(".front-point")
    points.first.wait_for(timeout=PATIENCE_MS)
    answer = httpx.get(f"{served.url}/api/v1/tradeoff", timeout=120).raise_for_status().json()
    front = answer["front"]
    expect(points).to_have_count(len(front))
    centres = points.evaluate_all(
        "(all) => all.map((each) => { const dot = each.querySelector('circle');"
        " return [Number(dot.getAttribute('cx')), Number(dot.getAttribute('cy'))]; })"
    )
    assert centres == sorted(centres), "more time to the right"
    assert [y for _, y in centres] == sorted(y for _, y in centres), "less error further down"
    expect(page.locator("[data-field=now]")).to_be_visible()

    wanted = front[len(front) // 2]
    plot = page.locator(".front svg").bounding_box()
    assert plot is not None
    x, y = centres[len(front) // 2]
    page.mouse.click(plot["x"] + x, plot["y"] + y)
    points.nth(len(front) // 2).focus()
    panel = ".panel-accuracy"
    predicted = wanted["predicted"]
    for name, expected in (
        ("range_error_m", predicted["range_error_m"]["median"]),
        ("range_std_m", predicted["range_std_m"]["median"]),
        ("range_bias_m", predicted["range_bias_m"]),
    ):
        assert number(text(page, panel, f"choice_{name}")) == pytest.approx(expected, rel=5e-3)
    capture_s = number(text(page, panel, "choice_capture_s"))
    assert capture_s == pytest.approx(wanted["capture_s"], rel=5e-3)
    page.keyboard.press("ArrowRight")
    following = front[len(front) // 2 + 1]
    expect(page.locator("[data-field=choice_exposure_s]")).to_be_visible()
    assert number(text(page, panel, "choice_exposure_s")) == pytest.approx(
        following["sequence"]["exposure_s"], rel=5e-3
    )
    page.get_by_role("button", name="Apply this sequence").click()
    expect(page.locator(".panel-sequence [data-field=harmonics]")).to_have_text(
        str(following["sequence"]["harmonics"])
    )
    expect(page.locator("[data-field=accuracy-status]")).to_have_text("")
    applied = httpx.get(f"{served.url}/api/v1/sequence").json()
    assert {name: applied[name] for name in following["sequence"]} == following["sequence"]


def test_a_target_is_planned_for_or_refused_in_words(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    shows_frame(page, stop(served))
    choose(page, "response", "Accuracy against time")
    plan = page.get_by_role("button", name="Plan")
    expect(plan).to_be_disabled()
    page.get_by_label("Error at most").fill("8")
    plan.click()
    page.locator("[data-field=choice]").wait_for(timeout=PATIENCE_MS)
    assert number(text(page, ".panel-accuracy", "choice_range_error_m")) <= 8e-3
    watch.refusals_expected = True
    page.get_by_label("Error at most").fill("1e-9")
    page.get_by_label("Frames at least").fill("20")
    plan.click()
    status = page.locator("p.refusal[data-field=accuracy-status]")
    status.wait_for(timeout=PATIENCE_MS)
    assert len(str(status.text_content())) > 20
