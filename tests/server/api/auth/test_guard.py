"""Authentication: over HTTP and over the stream, on a real daemon."""

import logging
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.datastructures import Headers

from tests.server.contract import client_of
from tests.server.streaming import streaming
from tests.serving import Served, serving
from transientcam import Camera, wire
from transientcam.errors import ProblemError
from transientcam_server.api import TokenFile
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.guard import UNAUTHENTICATED, Guard
from transientcam_server.errors import Problem
from transientcam_server.settings import Settings

NOW = datetime(2030, 1, 1, tzinfo=UTC)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> TokenFile:
    return TokenFile(tmp_path_factory.mktemp("tokens") / "tokens.json")


@pytest.fixture(scope="module")
def tokens(file: TokenFile) -> dict[str, str]:
    return {str(role): file.create(f"{role} 1", role, now=NOW)[1] for role in Role}


@pytest.fixture(scope="module")
def daemon(file: TokenFile, tokens: dict[str, str]) -> Iterator[Served]:
    """A daemon that requires a token of every client."""
    with serving("sim:mirrors?noise=off", require_token=True, tokens_file=file.path) as served:
        served.start_all_workers()
        yield served


@pytest.fixture
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def test_without_a_token_nothing_of_the_camera_is_reported(
    http: httpx.Client, daemon: Served
) -> None:
    for path, methods in daemon.app.openapi()["paths"].items():
        if not path.startswith("/api/v1/"):
            continue
        for method in methods:
            answer = http.request(method, path.replace("{product}", "range"))
            assert answer.status_code == 401, (method, path)
            assert answer.json()["type"] == "/problems/token-required"
            assert answer.headers["www-authenticate"] == "Bearer"


@pytest.mark.parametrize("path", ["/livez", "/docs", "/problems", "/api/versions"])
def test_health_and_pages_are_open(http: httpx.Client, path: str) -> None:
    assert http.get(path).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Authorization": "Bearer"},
        bearer("x"),
        bearer("tcam_00000000_AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"),
        {"X-API-Key": "x"},
        {"Authorization": "bearer  x"},
    ],
)
def test_a_token_that_was_not_made_is_refused(http: httpx.Client, headers: dict[str, str]) -> None:
    answer = http.get("/api/v1/info", headers=headers)

    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/token-refused")


def test_a_scheme_that_is_not_spoken_is_as_good_as_no_token(http: httpx.Client) -> None:
    answer = http.get("/api/v1/info", auth=("anna", "secret"))

    assert answer.json()["type"] == "/problems/token-required"


@pytest.mark.parametrize("role", ["viewer", "operator", "admin"])
def test_every_role_looks(http: httpx.Client, tokens: dict[str, str], role: str) -> None:
    for headers in (bearer(tokens[role]), {"X-API-Key": tokens[role]}):
        info = http.get("/api/v1/info", headers=headers).raise_for_status().json()
        assert (info["caller"]["name"], info["caller"]["role"]) == (f"{role} 1", role)
    body = {"harmonics": 4}
    checked = http.post("/api/v1/sequence/validate", json=body, headers=bearer(tokens[role]))
    assert checked.status_code == 200


CHANGES: list[tuple[str, str, dict[str, Any]]] = [
    ("PUT", "/api/v1/sequence", {"harmonics": 3}),
    ("PUT", "/api/v1/acquisition", {"running": True}),
    ("POST", "/api/v1/simulation/faults", {"fault": "drop-image"}),
    ("POST", "/api/v1/lease", {"holder": "me"}),
]


@pytest.mark.parametrize(("method", "path", "body"), CHANGES)
def test_a_viewer_changes_nothing(
    http: httpx.Client, tokens: dict[str, str], method: str, path: str, body: dict[str, Any]
) -> None:
    answer = http.request(method, path, json=body, headers=bearer(tokens["viewer"]))

    problem = answer.json()
    assert (answer.status_code, problem["type"]) == (403, "/problems/role-too-low")
    assert (problem["value"], problem["limit"]) == ("viewer", "operator")
    assert "viewer 1" in problem["detail"]


@pytest.mark.parametrize("role", ["operator", "admin"])
def test_operators_control_the_camera(
    http: httpx.Client, tokens: dict[str, str], role: str
) -> None:
    for method, path, body in CHANGES[:2]:
        answer = http.request(method, path, json=body, headers=bearer(tokens[role]))
        assert answer.status_code == 200


def test_a_viewer_may_switch_the_light_off(http: httpx.Client, tokens: dict[str, str]) -> None:
    off = http.post("/api/v1/acquisition/safe-off", headers=bearer(tokens["viewer"]))
    assert off.json()["state"] == "stopped"

    body = {"running": True}
    on = http.put("/api/v1/acquisition", json=body, headers=bearer(tokens["operator"]))
    assert on.json()["running"]


def test_an_operator_does_not_take_the_lease_from_an_admin(
    http: httpx.Client, tokens: dict[str, str]
) -> None:
    body = {"holder": "me", "takeover": True}
    operator, admin = bearer(tokens["operator"]), bearer(tokens["admin"])

    assert http.post("/api/v1/lease", json=body, headers=operator).status_code == 201
    taken = http.post("/api/v1/lease", json=body, headers=admin)
    assert taken.status_code == 201
    assert http.post("/api/v1/lease", json=body, headers=operator).status_code == 409
    mine = admin | {wire.LEASE_HEADER: taken.json()["lease_id"]}
    assert http.delete("/api/v1/lease", headers=mine).status_code == 200


def test_the_client_shows_its_token(daemon: Served, tokens: dict[str, str]) -> None:
    with Camera(daemon.url, token=tokens["viewer"], timeout_s=60.0) as camera:
        assert camera.info["name"] == "transientcam"
        with camera.stream("flags") as stream:
            assert stream.receive().product == "flags"
        with pytest.raises(ProblemError) as caught:
            camera.stop()
    assert caught.value.status == 403


def test_a_first_message_with_a_token_opens_the_stream(
    daemon: Served, tokens: dict[str, str]
) -> None:
    with streaming(daemon.stream_url) as client:
        client.subscribe("flags", token=tokens["viewer"])
        assert client.frame().product == "flags"


def test_a_header_opens_the_stream_too(daemon: Served, tokens: dict[str, str]) -> None:
    with streaming(daemon.stream_url, additional_headers=bearer(tokens["viewer"])) as client:
        client.subscribe("flags")
        assert client.frame().product == "flags"


@pytest.mark.parametrize(
    ("token", "slug"), [(None, "token-required"), ("x", "token-refused"), ("", "token-refused")]
)
def test_without_one_the_stream_says_why_and_closes_with_4003(
    daemon: Served, token: str | None, slug: str
) -> None:
    with streaming(daemon.stream_url) as client:
        client.send(
            {"type": "subscribe", "v": 1, "token": token, "subscriptions": [{"product": "flags"}]}
        )
        problem = client.error()
        code = client.close_code()

    assert (problem["status"], problem["type"]) == (401, f"/problems/{slug}")
    assert code == wire.CloseCode.AUTHENTICATION_FAILED


def test_a_revoked_token_is_sent_away(daemon: Served, file: TokenFile) -> None:
    token, text = file.create("guest", Role.VIEWER, now=NOW)
    with streaming(daemon.stream_url) as client:
        client.subscribe("flags", token=text)
        file.revoke(token.id)
        code = client.close_code()

    assert code == 4003
    assert httpx.get(f"{daemon.url}/api/v1/info", headers=bearer(text)).status_code == 401


def test_no_token_gets_into_a_log(
    daemon: Served, tokens: dict[str, str], caplog: pytest.LogCaptureFixture
) -> None:
    secrets = [tokens["viewer"], "tcam_00000000_" + "s" * 43]
    with caplog.at_level(logging.DEBUG):
        for secret in secrets:
            httpx.get(f"{daemon.url}/api/v1/info", headers=bearer(secret))
            with streaming(daemon.stream_url, additional_headers=bearer(secret)) as client:
                client.send({"type": "subscribe", "v": 1, "token": secret, "subscriptions": [7]})
                client.close_code()

    ours = [each for each in caplog.records if each.threadName == "served"]
    assert any("was not let in" in each.getMessage() for each in ours)
    for record in ours:
        for secret in secrets:
            assert secret.split("_", 2)[-1] not in record.getMessage()


# -- whether a token is needed ------------------------------------------------------------------


def guard(tmp_path: Path, **settings: Any) -> Guard:
    return Guard(Settings(tokens_file=tmp_path / "tokens.json", **settings), now=lambda: NOW)


def asks(guard: Guard, headers: dict[str, str]) -> bool:
    try:
        return guard.identify(Headers(headers)) != UNAUTHENTICATED
    except Problem as problem:
        return problem.kind.slug == "token-required"


@pytest.mark.parametrize(
    ("settings", "plain", "forwarded"),
    [
        ({}, False, True),
        ({"host": "::1"}, False, True),
        ({"require_token": True}, True, True),
        ({"host": "0.0.0.0"}, True, True),
        ({"host": "0.0.0.0", "insecure": True}, False, False),
        ({"insecure": True}, False, False),
    ],
)
def test_a_token_is_asked_for_wherever_others_could_come_from(
    tmp_path: Path, settings: dict[str, Any], plain: bool, forwarded: bool
) -> None:
    here = guard(tmp_path, **settings)

    assert asks(here, {}) == plain
    assert asks(here, {"X-Forwarded-For": "192.0.2.1"}) == forwarded
    assert asks(here, {"Forwarded": "for=192.0.2.1"}) == forwarded


def test_where_none_is_needed_a_role_that_is_shown_still_counts(tmp_path: Path) -> None:
    here = guard(tmp_path)
    _, text = here.tokens.create("a", Role.VIEWER, now=NOW)

    assert here.identify(Headers(bearer(text))).role is Role.VIEWER
    with pytest.raises(Problem):
        here.identify(Headers(bearer("x")))


def test_a_broken_file_admits_and_keeps_no_client(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    here = guard(tmp_path, require_token=True)
    _, text = here.tokens.create("a", Role.VIEWER, now=NOW)
    principal = here.identify(Headers(bearer(text)))
    assert here.still_valid(principal)
    assert here.still_valid(UNAUTHENTICATED)

    here.tokens.path.write_text("{")

    with pytest.raises(Problem):
        here.identify(Headers(bearer(text)))
    assert not here.still_valid(principal)
    assert "no token is valid" in caplog.text
