import asyncio
import re
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from tests.server.contract import check_answer
from transientcam_server.api import _problems as problems
from transientcam_server.api._docs import pages
from transientcam_server.errors._kinds import KINDS


@pytest.mark.parametrize("slug", sorted(KINDS))
def test_every_kind_of_problem_has_a_page(steady: httpx.Client, slug: str) -> None:
    response = steady.get(f"/problems/{slug}")

    assert response.status_code == 200
    assert KINDS[slug].title in response.text
    assert slug in steady.get("/problems").text


def test_the_documentation_needs_no_other_host(http: httpx.Client) -> None:
    page = http.get("/docs").text

    assert "//" not in re.sub(r"<!--.*?-->", "", page)
    scripts = re.findall(r'(?:src|href)="(?!data:)([^"]+)"', page)
    assert len(scripts) == 4
    for path in scripts:
        assert http.get(f"/{path}").status_code == 200


@pytest.mark.parametrize("path", ["/docs/redoc.standalone.js", "/docs/..%2fcore.py", "/docs/x"])
def test_only_the_files_of_the_documentation_are_served(steady: httpx.Client, path: str) -> None:
    assert steady.get(path).status_code == 404


@pytest.mark.parametrize("method", ["GET", "HEAD", "PUT", "POST", "DELETE"])
@pytest.mark.parametrize("path", ["/api/v1/nothing", "/api/nothing", "/api", "/nothing", "/a/b"])
def test_an_unknown_path_is_a_problem_and_never_the_page(
    steady: httpx.Client, method: str, path: str
) -> None:
    response = steady.request(method, path, headers={"Accept": "text/html"})

    assert response.status_code == 404
    assert response.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("DELETE", "/api/v1/sequence", "PUT"),
        ("GET", "/api/v1/sequence/validate", "POST"),
        ("POST", "/api/v1/frames/latest/range", "GET"),
        ("PATCH", "/livez", "GET"),
    ],
)
def test_a_method_that_does_not_apply_is_refused_with_those_that_do(
    steady: httpx.Client, method: str, path: str, allowed: str
) -> None:
    response = steady.request(method, path)

    assert response.status_code == 405
    assert allowed in response.headers["allow"]


def _app(static: Path, monkeypatch: pytest.MonkeyPatch) -> FastAPI:
    monkeypatch.setattr(pages, "STATIC", static)
    app = FastAPI(docs_url=None)

    @app.get("/api/v1/known")
    async def known() -> dict[str, bool]:
        return {"known": True}

    pages.add_dashboard(app)
    problems.install(app, prefix="/api")
    return app


def _get(
    app: FastAPI, path: str, method: str = "GET", accept_encoding: str = "identity"
) -> httpx.Response:
    async def request() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            headers = {"Accept": "text/html", "Accept-Encoding": accept_encoding}
            return await client.request(method, path, headers=headers)

    return asyncio.run(request())


def test_without_a_built_dashboard_a_page_says_how_to_build_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    response = _get(_app(tmp_path / "absent", monkeypatch), "/")

    assert response.status_code == 200
    assert "Node.js" in response.text


def test_a_built_dashboard_is_served_beside_the_interface(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<p>dashboard</p>")
    (tmp_path / "assets" / "a.js").write_text("1;")
    (tmp_path / "icon.svg").write_text("<svg/>")
    app = _app(tmp_path, monkeypatch)

    assert _get(app, "/favicon.ico").text == "<svg/>"
    assert _get(app, "/").text == "<p>dashboard</p>"
    assert _get(app, "/assets/a.js").text == "1;"
    assert _get(app, "/api/v1/known").json() == {"known": True}


@pytest.mark.parametrize(
    ("accepted", "compressed"), [("gzip, deflate, br", True), ("identity", False)]
)
def test_an_asset_is_sent_compressed_and_kept_for_good(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, accepted: str, *, compressed: bool
) -> None:
    script = b"const light = 299792458;" * 50
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<p>dashboard</p>")
    (tmp_path / "assets" / "a.js").write_bytes(script)
    app = _app(tmp_path, monkeypatch)

    response = _get(app, "/assets/a.js", accept_encoding=accepted)

    assert response.content == script
    assert response.headers.get("content-encoding") == ("gzip" if compressed else None)
    assert response.headers["content-type"].startswith("text/javascript")
    assert "Accept-Encoding" in response.headers["vary"]
    assert "immutable" in response.headers["cache-control"]
    for path in ("/assets/b.js", "/assets/..%2findex.html", "/assets/"):
        missing = _get(app, path, accept_encoding=accepted)
        assert missing.status_code == 404
        assert missing.headers["content-type"] == "application/problem+json"
    # the page itself is asked for anew each time, and knows its version
    assert "cache-control" not in _get(app, "/").headers
    assert _get(app, "/").headers["etag"]


def test_what_the_first_visit_takes_is_at_most_190_kb(steady: httpx.Client) -> None:
    sizes = []

    def get(path: str) -> str:
        answer = steady.get(path).raise_for_status()
        sizes.append(answer.num_bytes_downloaded)
        return answer.text

    page = get("/")
    first = re.findall(r'(?:src|href)="\./(assets/[^"]+)"', page)
    if not first:
        pytest.skip("the dashboard was not built")
    texts = "".join(get(f"/{path}") for path in first)
    # what these name: the worker by the script, the type of Latin letters by the styles
    named = set(re.findall(r"(?:worker|inter-latin-wght-normal)-[\w-]+\.(?:js|woff2)", texts))
    for name in (*named, "../icon.svg"):
        get(f"/assets/{name}")

    assert len(named) == 2
    assert 0 < texts.index("canvas.cover") < texts.index(".colour-bar"), "the base's rules first"
    assert sum(sizes) <= 190_000
    assert sum(sizes) > 100_000, "all of it was counted"


@pytest.mark.parametrize("path", ["/frames/latest/range.npy", "/frames/latest/raw.msgpack"])
def test_arrays_are_not_compressed(steady: httpx.Client, path: str) -> None:
    response = steady.get(f"/api/v1{path}")

    response.raise_for_status()
    assert "content-encoding" not in response.headers


@pytest.mark.parametrize("path", ["/api/v1/nothing", "/somewhere", "/%2e%2e/x"])
def test_beside_a_built_dashboard_an_unknown_path_is_a_problem_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    (tmp_path / "index.html").write_text("<p>dashboard</p>")
    app = _app(tmp_path, monkeypatch)

    for method in ("GET", "POST"):
        response = _get(app, path, method)
        assert response.status_code == 404
        check_answer(app.openapi(), response)
    assert _get(app, "/api/v1/known", "POST").status_code == 405
