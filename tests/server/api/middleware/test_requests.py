import logging

import httpx
import pytest

from tests.serving import Served
from transientcam_server.api import SECURITY_HEADERS, _problems as problems
from transientcam_server.api._middleware.requests import REQUEST_ID_HEADER

JSON = {"Content-Type": "application/json"}


def test_a_request_keeps_the_id_it_comes_with(http: httpx.Client) -> None:
    answer = http.get("/api/v1/nothing", headers={REQUEST_ID_HEADER: "trace-7/a.b"})

    assert answer.headers[REQUEST_ID_HEADER] == "trace-7/a.b"
    assert answer.json()["request_id"] == "trace-7/a.b"


@pytest.mark.parametrize("sent", [None, "", "two words", "x" * 129, 'a"b', "a,b"])
def test_without_one_that_may_stand_in_a_log_it_gets_one(
    http: httpx.Client, sent: str | None
) -> None:
    headers = {} if sent is None else {REQUEST_ID_HEADER: sent}

    answers = [http.get("/livez", headers=headers) for _ in range(2)]

    given = [answer.headers[REQUEST_ID_HEADER] for answer in answers]
    assert given[0] != given[1]
    assert sent not in given


@pytest.mark.parametrize(
    "path",
    [
        "/livez",
        "/api/v1/info",
        "/api/v1/sequence",
        "/api/v1/frames/latest",
        "/api/v1/frames/latest/flags.npy",
        "/api/v1/frames/latest/nothing",
        "/nothing",
        "/docs",
    ],
)
def test_head_reports_what_get_would_without_a_body(steady: httpx.Client, path: str) -> None:
    steady.put("/api/v1/acquisition", json={"running": False})  # both are about the same frame
    try:
        get, head = steady.get(path), steady.head(path)
    finally:
        steady.put("/api/v1/acquisition", json={"running": True})

    assert head.status_code == get.status_code
    assert head.content == b""
    assert head.headers["content-type"] == get.headers["content-type"]
    assert "content-length" in head.headers


def test_head_of_what_has_no_get_is_not_allowed(http: httpx.Client) -> None:
    answer = http.head("/api/v1/acquisition/safe-off")

    assert (answer.status_code, answer.headers["allow"]) == (405, "POST")
    assert "HEAD" in http.delete("/api/v1/sequence").headers["allow"].split(", ")


def test_a_failure_is_answered_counted_and_logged_with_its_id(
    served: Served,
    http: httpx.Client,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail() -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(served.service, "not_ready", fail)

    # it is not documented, because it is a mistake of the service
    with httpx.Client(base_url=served.url) as client:
        answer = client.get("/readyz", headers={REQUEST_ID_HEADER: "abc"})

    assert answer.status_code == 500
    assert answer.json()["type"] == "/problems/internal-error"
    assert answer.json()["request_id"] == answer.headers[REQUEST_ID_HEADER] == "abc"
    assert "secret" not in answer.text
    for name, value in SECURITY_HEADERS.items():
        assert answer.headers[name] == value
    (record,) = [each for each in caplog.records if each.exc_info]
    assert "/readyz" in record.getMessage()
    assert http.get("/livez").status_code == 200
    text = http.get("/metrics").text
    assert 'transientcam_http_requests_total{status="5xx"} 1.0' in text


@pytest.mark.parametrize("path", ["lease", "sequence/validate", "plan", "recordings"])
def test_a_body_of_many_levels_is_refused_and_not_logged(
    steady: httpx.Client, caplog: pytest.LogCaptureFixture, path: str
) -> None:
    caplog.set_level("DEBUG")
    body = '{"x":' * 500 + "1" + "}" * 500

    answer = steady.post(f"/api/v1/{path}", content=body, headers=JSON)

    assert answer.status_code == 422
    assert len(answer.content) < 2000
    assert '"x"' not in caplog.text
    assert "{'x'" not in caplog.text


def test_a_failure_with_a_refused_body_is_logged_without_it(
    steady: httpx.Client, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(error: object) -> None:
        raise ZeroDivisionError("in the midst of it")

    monkeypatch.setattr(problems, "_of_validation", fail)
    with httpx.Client(base_url=steady.base_url) as client:  # it is not documented
        answer = client.post("/api/v1/lease", content='{"private": 1}', headers=JSON)

    assert answer.status_code == 500
    (record,) = [each for each in caplog.records if each.exc_info]
    text = logging.Formatter().format(record)
    assert "ZeroDivisionError" in text
    assert "private" not in text


@pytest.mark.parametrize(
    ("path", "methods"),
    [("calibrations/active", "GET, HEAD, PUT"), ("calibrations/import", "POST")],
)
def test_methods_of_a_path_are_those_of_its_documentation(
    steady: httpx.Client, path: str, methods: str
) -> None:
    answer = steady.request("PATCH", f"/api/v1/{path}")

    assert (answer.status_code, answer.headers["allow"]) == (405, methods)


def test_changes_are_logged_without_their_query(
    http: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        http.put("/api/v1/acquisition?token=secret", json={"running": True})
        http.get("/api/v1/acquisition?token=secret")

    ours = [
        each
        for each in caplog.records
        if each.name == "transientcam_server.api.middleware.requests"
    ]
    (record,) = ours
    assert record.getMessage() == "PUT /api/v1/acquisition: 200, for anybody"
    assert record.levelname == "INFO"
    assert all("secret" not in each.getMessage() for each in caplog.records if each in ours)
