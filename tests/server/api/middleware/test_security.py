import asyncio

import httpx
import pytest
from starlette.responses import PlainTextResponse, Response
from starlette.types import Receive, Scope, Send
from websockets.exceptions import InvalidStatus

from tests.server.streaming import streaming
from tests.serving import Served
from transientcam_server.api import SECURITY_HEADERS
from transientcam_server.api._middleware.security import (
    MAX_BODY_BYTES,
    OriginCheck,
    RootPath,
    SecurityHeaders,
)
from transientcam_server.settings import Settings

CHANGE = ("PUT", "/api/v1/acquisition")


def test_every_answer_carries_the_security_headers(http: httpx.Client) -> None:
    for path in ("/", "/docs", "/docs/swagger-ui.css", "/livez", "/api/v1/nothing", "/nothing"):
        response = http.get(path)
        for name, value in SECURITY_HEADERS.items():
            assert response.headers[name] == value, path
        assert "server" not in response.headers


def test_no_page_may_run_a_script_that_is_not_a_file_of_this_service() -> None:
    policy = dict(
        directive.strip().split(" ", 1)
        for directive in SECURITY_HEADERS["Content-Security-Policy"].split(";")
    )

    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == "'self'"
    assert policy["style-src"] == "'self'"
    assert "unsafe" not in SECURITY_HEADERS["Content-Security-Policy"]


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", ""])
@pytest.mark.parametrize("method", ["GET", "PUT"])
def test_a_name_that_is_not_served_is_refused(steady: httpx.Client, host: str, method: str) -> None:
    response = steady.request(method, "/api/v1/acquisition", headers={"Host": host})

    assert response.status_code == 403
    assert response.json()["type"] == "/problems/host-not-allowed"


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1234", "127.0.0.1", "[::1]:80"])
def test_names_of_this_machine_are_served(steady: httpx.Client, host: str) -> None:
    assert steady.get("/livez", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "origin", ["https://evil.example", "null", "http://127.0.0.1:1", "http://[bad", "file://"]
)
def test_a_page_of_another_site_may_not_change_anything(steady: httpx.Client, origin: str) -> None:
    method, path = CHANGE

    response = steady.request(method, path, json={"running": True}, headers={"Origin": origin})

    assert response.status_code == 403
    assert response.json()["type"] == "/problems/origin-not-allowed"


def test_the_own_page_may_change_things(steady: httpx.Client) -> None:
    method, path = CHANGE
    own = str(steady.base_url).rstrip("/")

    response = steady.request(method, path, json={"running": True}, headers={"Origin": own})

    assert response.status_code == 200


def test_a_page_of_another_site_may_not_open_the_stream(steady_daemon: Served) -> None:
    with (
        pytest.raises(InvalidStatus) as caught,
        streaming(steady_daemon.stream_url, origin="https://evil.example"),
    ):
        pass

    assert caught.value.response.status_code == 403
    assert b"origin-not-allowed" in (caught.value.response.body or b"")


def test_the_own_page_may_open_the_stream(steady_daemon: Served) -> None:
    with streaming(steady_daemon.stream_url, origin=steady_daemon.url) as client:
        client.subscribe("flags")


def test_a_page_of_another_site_may_link_here_but_load_nothing(steady: httpx.Client) -> None:
    def status(site: str, mode: str, destination: str) -> int:
        headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode, "Sec-Fetch-Dest": destination}
        return steady.get("/api/v1/frames/latest/flags.png", headers=headers).status_code

    assert status("cross-site", "no-cors", "image") == 403
    assert status("cross-site", "navigate", "iframe") == 403
    assert status("cross-site", "navigate", "document") == 200
    assert status("same-origin", "no-cors", "image") == 200
    assert status("none", "navigate", "document") == 200


def test_pages_of_allowed_origins_may_hold_the_page_in_a_frame() -> None:
    async def answer(*origins: str) -> httpx.Response:
        checked = OriginCheck(_page, settings=Settings(allowed_origins=origins))
        app = httpx.ASGITransport(SecurityHeaders(checked, framed_by=origins))
        frame = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}
        async with httpx.AsyncClient(transport=app, base_url="http://localhost:8000") as client:
            return await client.get("/", headers={"Sec-Fetch-Site": "cross-site", **frame})

    allowed, refused = asyncio.run(answer("http://wall.example/")), asyncio.run(answer())

    assert (allowed.status_code, refused.status_code) == (200, 403)
    policies = [each.headers["content-security-policy"] for each in (allowed, refused)]
    assert policies[0].endswith("; frame-ancestors 'self' http://wall.example")
    assert policies[1].endswith("; frame-ancestors 'self'")


async def _page(scope: Scope, receive: Receive, send: Send) -> None:
    await PlainTextResponse("page")(scope, receive, send)


def test_an_answer_to_another_site_carries_no_leave_to_read_it(steady: httpx.Client) -> None:
    response = steady.get("/api/v1/info", headers={"Origin": "https://evil.example"})

    assert "access-control-allow-origin" not in response.headers


@pytest.mark.parametrize("announced", [True, False])
def test_a_body_that_is_too_long_is_refused(steady: httpx.Client, announced: bool) -> None:
    body = b" " * (MAX_BODY_BYTES + 1)
    pieces = iter([body[: len(body) // 2], body[len(body) // 2 :]])

    response = steady.put(
        "/api/v1/sequence",
        content=body if announced else pieces,
        headers={"Content-Type": "application/json"},
    )

    assert response.status_code == 413
    assert response.json()["type"] == "/problems/too-large"


def _allows(settings: Settings, host: str) -> bool:
    async def app(*_: object) -> None: ...

    return OriginCheck(app, settings=settings)._is_ours(host)


def test_a_service_open_to_others_is_reached_by_address_and_configured_names_only() -> None:
    settings = Settings(host="0.0.0.0", insecure=True, allowed_hosts=("lab.example",))

    assert _allows(settings, "192.168.1.7")
    assert _allows(settings, "[fe80::1]")
    assert _allows(settings, "lab.example")
    assert not _allows(settings, "evil.example")
    assert not _allows(Settings(), "192.168.1.7")


@pytest.mark.parametrize("path", ["/lidar/api/v1/x?y=1", "/api/v1/x?y=1"])
def test_a_path_of_a_proxy_is_taken_off_and_named_in_addresses(path: str) -> None:
    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        assert (scope["path"], scope["raw_path"]) == ("/api/v1/x", b"/api/v1/x")
        await Response(headers={"Location": "/api/v1/jobs/j"})(scope, receive, send)

    async def ask() -> tuple[httpx.Response, httpx.Response]:
        transport = httpx.ASGITransport(app=RootPath(SecurityHeaders(app), root_path="/lidar"))
        async with httpx.AsyncClient(transport=transport, base_url="http://here") as client:
            return await client.get(path), await client.get("/lidar")

    answer, page = asyncio.run(ask())

    assert answer.headers["location"] == "jobs/j"
    assert (page.status_code, page.headers["location"]) == (308, "lidar/")
