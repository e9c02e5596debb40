from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from tests.serving import Served

PATH = "/api/v1/sequence"
VIDEO: dict[str, Any] = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}


def test_the_running_sequence_is_reported_with_what_follows_from_it(http: httpx.Client) -> None:
    document = http.get("/api/v1/sequence").json()

    assert document["harmonics"] == 3
    assert document["images"] == 16
    # 16 images of 1.92 ms, read out in 3.73 ms each
    assert document["capture_s"] == pytest.approx(16 * (1.92e-3 + 3.98e-3))
    assert document["unambiguous_range_m"] == pytest.approx(299_792_458.0 / 46e6)


def test_a_new_sequence_is_applied_and_the_next_frames_are_of_it(http: httpx.Client) -> None:
    before = http.get("/api/v1/sequence").json()

    applied = http.put("/api/v1/sequence", json=VIDEO).json()

    assert applied["images"] == 12
    assert applied["sequence_id"] != before["sequence_id"]
    # the paper's video rate
    assert applied["frame_rate_hz"] == pytest.approx(18.6, abs=0.01)
    number = http.get("/api/v1/frames/latest", params={"wait_s": 10.0}).json()["frame"]
    following = http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": number}).json()
    assert following["sequence_id"] == applied["sequence_id"]
    assert following["exposure_s"] == 0.0005
    assert http.get("/api/v1/sequence").json() == applied


def test_a_document_that_was_read_may_be_changed_and_sent_back(http: httpx.Client) -> None:
    document = http.get("/api/v1/sequence").json() | {"takes": 2}

    response = http.put("/api/v1/sequence", json=document)

    assert response.status_code == 200
    assert response.json()["takes"] == 2


def test_a_sequence_can_be_checked_without_touching_the_camera(
    served: Served, http: httpx.Client
) -> None:
    before = served.camera.applied

    document = http.post("/api/v1/sequence/validate", json=VIDEO | {"harmonics": 5}).json()

    assert document["images"] == 20
    assert document["sequence_id"] == 0
    assert served.camera.applied == before


BAD: list[tuple[dict[str, Any], str]] = [
    ({"harmonics": 0}, "harmonics"),
    ({"harmonics": 33}, "harmonics"),
    ({"harmonics": 2.5}, "harmonics"),
    ({"harmonics": "three"}, "harmonics"),
    ({"base_frequency_hz": 0}, "base_frequency_hz"),
    ({"base_frequency_hz": 1e12}, "base_frequency_hz"),
    ({"base_frequency_hz": None}, "base_frequency_hz"),
    ({"exposure_s": -0.001}, "exposure_s"),
    ({"exposure_s": 3600.0}, "exposure_s"),
    ({"takes": 10**9}, "takes"),
    ({"takes": True}, "takes"),
    ({"zeroth": "guessed"}, "zeroth"),
    ({"sub_phases": {"scheme": "arccos", "n": 1000}}, "sub_phases.n"),
    ({"sub_phases": {"scheme": "magic"}}, "sub_phases.scheme"),
    ({"sub_phases": 8}, "sub_phases"),
    ({"exposure": 0.001}, "exposure"),
]


@pytest.mark.parametrize(("document", "field"), BAD)
@pytest.mark.parametrize("method", ["PUT", "POST"])
def test_a_sequence_out_of_range_is_refused_and_the_old_one_runs_on(
    steady: httpx.Client, document: dict[str, Any], field: str, method: str
) -> None:
    before = steady.get("/api/v1/sequence").json()
    path = "/api/v1/sequence" if method == "PUT" else "/api/v1/sequence/validate"

    response = steady.request(method, path, json=document)

    problem = response.json()
    assert (response.status_code, problem["type"]) == (422, "/problems/invalid-sequence")
    assert problem["field"] == field
    assert "value" in problem
    assert problem["limit"]
    assert steady.get("/api/v1/sequence").json() == before


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"{", 422),
        (b"[1, 2]", 422),
        (b'"video"', 422),
        (b"null", 422),
        (b"", 422),
        (b"\xff\xfe", 422),
        (b"[" * 5000, 400),
        (b'{"takes": 1e999}', 422),
    ],
)
def test_a_body_that_is_no_sequence_at_all_is_refused(
    steady: httpx.Client, body: bytes, status: int
) -> None:
    before = steady.get("/api/v1/sequence").json()

    response = steady.put(
        "/api/v1/sequence", content=body, headers={"Content-Type": "application/json"}
    )

    assert response.status_code == status
    assert steady.get("/api/v1/sequence").json() == before


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity"])
def test_numbers_that_are_none_are_refused_and_returned_as_text(
    steady: httpx.Client, text: str
) -> None:
    response = steady.put(
        "/api/v1/sequence",
        content=f'{{"exposure_s": {text}}}',
        headers={"Content-Type": "application/json"},
    )

    assert response.status_code == 422
    assert response.json()["value"] in ("nan", "inf", "-inf")


def test_a_sequence_is_named_by_its_tag(http: httpx.Client) -> None:
    first = http.get(PATH)
    same = http.get(PATH)
    put = http.put(PATH, json=VIDEO)
    second = http.get(PATH)

    assert first.headers["etag"] == same.headers["etag"]
    assert put.headers["etag"] == second.headers["etag"] != first.headers["etag"]


def test_a_sequence_that_is_known_is_not_reported_again(http: httpx.Client) -> None:
    tag = http.get(PATH).headers["etag"]

    known = http.get(PATH, headers={"If-None-Match": f'"other", W/{tag}'})
    other = http.get(PATH, headers={"If-None-Match": '"other"'})

    assert (known.status_code, known.content, known.headers["etag"]) == (304, b"", tag)
    assert other.status_code == 200


def test_a_change_of_a_sequence_that_was_changed_meanwhile_is_refused(http: httpx.Client) -> None:
    mine = http.get(PATH).headers["etag"]
    http.put(PATH, json=VIDEO)
    before = http.get(PATH)

    late = http.put(PATH, json={"harmonics": 5}, headers={"If-Match": mine})

    problem = late.json()
    assert (late.status_code, problem["type"]) == (412, "/problems/sequence-changed")
    assert (problem["value"], problem["current"]) == (mine, before.headers["etag"])
    assert http.get(PATH).json() == before.json()
    assert http.put(PATH, json=VIDEO, headers={"If-Match": problem["current"]}).status_code == 200
    assert http.put(PATH, json=VIDEO, headers={"If-Match": "*"}).status_code == 200


def test_of_two_clients_that_change_the_same_sequence_at_once_one_is_refused(
    http: httpx.Client,
) -> None:
    tag = http.get(PATH).headers["etag"]

    def change(takes: int) -> int:
        with httpx.Client(base_url=http.base_url, timeout=60.0) as client:
            body = VIDEO | {"takes": takes}
            return client.put(PATH, json=body, headers={"If-Match": tag}).status_code

    with ThreadPoolExecutor(4) as executor:
        statuses = sorted(executor.map(change, (1, 2, 3, 4)))

    assert statuses == [200, 412, 412, 412]
