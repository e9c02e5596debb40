import re
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import MIRRORS, SlowClock, Watch
from tests.browser.dashboard import LIVE, choose_from, open_page, shows_frame
from tests.serving import Served, serving
from transientcam_server.api import Role, utc_now
from transientcam_server.api._auth.tokens import TokenFile

pytestmark = pytest.mark.shared_daemon


def lease(served: Served, method: str, **document: Any) -> httpx.Response:
    lease_id = document.pop("lease_id", None)
    headers = {} if lease_id is None else {"Transientcam-Lease": lease_id}
    body = None if method == "DELETE" else document
    return httpx.request(method, f"{served.url}/api/v1/lease", headers=headers, json=body)


def control(page: Page, button: str, name: str | None = None) -> None:
    """Press a button of the dialog about control."""
    page.locator("[data-field=control]").click()
    dialog = page.get_by_role("dialog", name="Control")
    if name is not None:
        dialog.get_by_label("What others should call you").fill(name)
    dialog.get_by_role("button", name=button, exact=True).click()
    expect(dialog).to_have_count(0)


def test_control_is_taken_renewed_used_and_given_back(page: Page, served: Served) -> None:
    open_page(page)
    control(page, "Take control", "bench 2")
    expect(page.locator("[data-field=control]")).to_have_text("You have control")
    held = httpx.get(f"{served.url}/api/v1/lease").json()
    assert (held["holder"], held["on_lapse"]) == ("bench 2", "stop")
    others = httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False})
    assert others.status_code == 409
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    page.evaluate("() => transientcam.store.lease.look()")
    renewed = httpx.get(f"{served.url}/api/v1/lease").json()
    assert renewed["expires_in_s"] > held["duration_s"] - 5
    control(page, "Give back")
    expect(page.locator("[data-field=control]")).to_have_text("Take control")
    assert httpx.get(f"{served.url}/api/v1/lease").json()["held"] is False


def test_controls_name_another_holder_of_the_lease_and_wait(page: Page, served: Served) -> None:
    open_page(page)
    granted = lease(served, "POST", holder="the night shift", duration_s=600).json()
    edit = page.get_by_role("button", name="Edit")
    expect(edit).to_be_disabled()
    expect(edit).to_have_attribute("title", "the night shift controls the camera")
    for name in ("Stop", "Single"):
        expect(page.get_by_role("button", name=name, exact=True)).to_be_disabled()
    expect(page.locator("[data-field=control]")).to_have_text(
        re.compile(r"^the night shift \d+ s$")
    )
    toast = page.locator(".toast", has_text="the night shift has taken control.")
    expect(toast).to_be_visible()
    lease(served, "DELETE", lease_id=granted["lease_id"])
    expect(edit).to_be_enabled()


def test_a_change_that_is_refused_for_the_lease_names_its_holder(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    watch.refusals_expected = True
    lease(served, "POST", holder="the night shift", duration_s=600)
    expect(page.get_by_role("button", name="Stop", exact=True)).to_be_disabled()
    # as a page that has no notice of it yet
    words = page.evaluate(
        "() => transientcam.store.api.ask('PUT /acquisition', { body: { running: false } })"
        ".catch((error) => error.message)"
    )
    assert words.startswith("the night shift controls the camera")


def test_control_is_taken_over_in_both_directions(page: Page, served: Served, watch: Watch) -> None:
    open_page(page)
    lease(served, "POST", holder="the night shift", duration_s=600)
    expect(page.locator("[data-field=control]")).to_contain_text("the night shift")
    control(page, "Take over", "bench 2")
    expect(page.locator("[data-field=control]")).to_have_text("You have control")
    watch.refusals_expected = True
    taken = lease(served, "POST", holder="the day shift", duration_s=600, takeover=True)
    banner = page.locator("[data-banner=control]")
    expect(banner).to_contain_text("the day shift has taken over control.")
    expect(page.get_by_role("button", name="Stop", exact=True)).to_be_disabled()
    lease(served, "DELETE", lease_id=taken.json()["lease_id"])
    expect(banner).to_have_count(0)  # it is free again
    expect(page.get_by_role("button", name="Stop", exact=True)).to_be_enabled()


def test_the_light_goes_off_whichever_client_has_control(page: Page, served: Served) -> None:
    open_page(page)
    lease(served, "POST", holder="the night shift", duration_s=600)
    expect(page.locator("[data-field=control]")).to_contain_text("the night shift")
    page.get_by_role("button", name="Light off", exact=True).click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    assert httpx.get(f"{served.url}/api/v1/acquisition").json()["running"] is False


@pytest.mark.parametrize("by", ["click", "key"])
def test_the_light_goes_off_beside_an_open_dialog(page: Page, served: Served, by: str) -> None:
    open_page(page)
    button = page.locator("button.light-off")
    place = button.bounding_box()
    page.locator("[data-field=control]").click()
    inside = page.get_by_role("dialog", name="Control").locator("button.light-off")
    expect(inside).to_be_visible()
    assert inside.bounding_box() == place
    if by == "click":
        inside.click()
    else:
        page.get_by_role("dialog", name="Control").get_by_role("button", name="Close").press("x")
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    assert httpx.get(f"{served.url}/api/v1/acquisition").json()["running"] is False


def test_a_request_for_light_off_that_is_lost_is_repeated(
    page: Page, served: Served, watch: Watch
) -> None:
    open_page(page)
    watch.refusals_expected = True
    page.route("**/acquisition/safe-off", lambda route: route.fulfill(status=429), times=1)
    page.get_by_role("button", name="Light off", exact=True).click()
    expect(page.locator("[data-banner=light]")).to_contain_text("The light may be on.")
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    expect(page.locator("[data-banner=light]")).to_have_count(0)
    assert httpx.get(f"{served.url}/api/v1/acquisition").json()["running"] is False


def test_a_page_that_is_closed_gives_control_back(
    browser: Browser, page: Page, served: Served
) -> None:
    open_page(page)
    context = browser.new_context(base_url=served.url, reduced_motion="reduce")
    other = context.new_page()
    open_page(other)
    control(other, "Take control", "bench 2")
    expect(page.locator("[data-field=control]")).to_contain_text("bench 2")
    other.close(run_before_unload=True)
    expect(page.locator("[data-field=control]")).to_have_text("Take control")
    context.close()


def test_a_single_capture_is_a_new_frame_and_the_camera_stands(page: Page, served: Served) -> None:
    open_page(page)
    before = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    single = page.get_by_role("button", name="Single", exact=True)
    single.click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    expect(single).to_be_enabled()
    assert httpx.get(f"{served.url}/api/v1/acquisition").json()["running"] is False
    newest = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    assert newest > before
    shows_frame(page, newest)
    single.click()
    page.wait_for_function(
        "(frame) => transientcam.store.status.newest.peek().frame > frame", arg=newest
    )
    expect(single).to_be_enabled()
    shows_frame(page, httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"])


def test_a_camera_that_stands_still_is_shown_by_its_last_frame(page: Page, served: Served) -> None:
    httpx.get(f"{served.url}/api/v1/frames/latest", params={"wait_s": 10}).raise_for_status()
    httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False}).raise_for_status()
    newest = httpx.get(f"{served.url}/api/v1/frames/latest").json()["frame"]
    open_page(page)
    shows_frame(page, newest)
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")


@pytest.fixture
def guarded(tmp_path: Path) -> Any:
    """A daemon that requires tokens, and a valid one of each role."""
    file = tmp_path / "tokens.json"
    tokens = {
        role: TokenFile(file).create(str(role), role, now=utc_now(), expires=None)[1]
        for role in (Role.VIEWER, Role.OPERATOR)
    }
    with serving(MIRRORS, clock=SlowClock(), require_token=True, tokens_file=file) as served:
        yield served, tokens


@pytest.fixture
def page_of_guarded(browser: Browser, guarded: Any) -> Any:
    """A page of a daemon that requires tokens; refusals are what it is about."""
    served, tokens = guarded
    context = browser.new_context(base_url=served.url, reduced_motion="reduce")
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page, served, tokens
    context.close()
    assert errors == []


def show_token(page: Page, token: str) -> None:
    dialog = page.get_by_role("dialog", name="Authentication required")
    dialog.get_by_label("Token", exact=True).fill(token)
    dialog.get_by_role("button", name="Use this token").click()


def test_a_service_that_requires_a_token_gets_one(page_of_guarded: Any) -> None:
    page, _, tokens = page_of_guarded
    page.goto("/?debug")
    dialog = page.get_by_role("dialog", name="Authentication required")
    expect(dialog).to_be_visible()
    expect(page.locator("[data-field=state]")).to_have_text("Not let in")
    expect(page.locator(".panel-map .stage-empty")).to_contain_text("with a token")
    show_token(page, "tc_mistyped")
    expect(dialog).to_contain_text("does not know this token")
    show_token(page, tokens[Role.OPERATOR])
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
    page.locator(".panel-map canvas[data-frame]").wait_for()
    assert tokens[Role.OPERATOR] not in page.url
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")
    # of this tab: there after a reload, gone with the tab
    page.reload()
    page.locator(".panel-map canvas[data-frame]").wait_for()
    assert page.evaluate("() => Object.values(localStorage).join()").find("tc_") == -1
    choose_from(page, "Page: layout, colours, help", "Forget the token")
    expect(page.locator("[data-field=state]")).to_have_text("Not let in")
    expect(page.locator("[data-banner=token]")).to_be_visible()
    assert page.evaluate("() => Object.values(sessionStorage).join()") == ""


def test_a_viewer_sees_what_its_role_does_not_permit(page_of_guarded: Any) -> None:
    page, _, tokens = page_of_guarded
    page.goto("/?debug")
    show_token(page, tokens[Role.VIEWER])
    page.locator(".panel-map canvas[data-frame]").wait_for()
    stop = page.get_by_role("button", name="Stop", exact=True)
    expect(stop).to_be_disabled()
    expect(stop).to_have_attribute("title", "The token viewer is a viewer's")
    button = page.locator("[data-field=control]")
    expect(button).to_have_text("View only")
    button.click()
    control_dialog = page.get_by_role("dialog", name="Control")
    expect(control_dialog.get_by_role("button", name="Take control")).to_be_disabled()
    control_dialog.get_by_role("button", name="Close").click()
    choose_from(page, "Page: layout, colours, help", "Token…")
    dialog = page.get_by_role("dialog", name="Authentication required")
    expect(dialog.locator("[data-field=caller]")).to_contain_text("knows this page as viewer")
    # with another one it may at once
    show_token(page, tokens[Role.OPERATOR])
    expect(stop).to_be_enabled()


def test_a_viewer_may_switch_the_light_off(page_of_guarded: Any) -> None:
    page, _, tokens = page_of_guarded
    page.goto("/?debug")
    show_token(page, tokens[Role.VIEWER])
    page.locator(".panel-map canvas[data-frame]").wait_for()
    page.get_by_role("button", name="Light off", exact=True).click()
    expect(page.locator("[data-field=state]")).to_have_text("Stopped")


def test_a_token_that_is_revoked_is_asked_for_again(page_of_guarded: Any) -> None:
    page, served, tokens = page_of_guarded
    page.goto("/?debug")
    show_token(page, tokens[Role.OPERATOR])
    page.locator(".panel-map canvas[data-frame]").wait_for()
    file = served.app.state.guard.tokens
    revoked = file.find(tokens[Role.OPERATOR], now=utc_now())
    assert revoked is not None
    file.revoke(revoked.id)
    expect(page.get_by_role("dialog", name="Authentication required")).to_be_visible()
    expect(page.locator("[data-field=state]")).to_have_text("Not let in")
    show_token(page, tokens[Role.VIEWER])
    expect(page.locator("[data-field=state]")).to_have_text(LIVE)
