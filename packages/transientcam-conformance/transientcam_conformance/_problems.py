"""Every error is answered with a problem document (RFC 9457) of a known type."""

import httpx

from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect

_ID = "conformance-1.2:3"


def an_unknown_path_is_a_problem(device: Device) -> None:
    """A path that is not there is answered with 404 and the problem not-found."""
    device.refusal(device.send("GET", f"{API}/no-such-thing"), 404, "not-found")


def a_wrong_method_is_a_problem(device: Device) -> None:
    """A method that a path has not is answered with 405, and Allow lists those that it has."""
    response = device.send("DELETE", f"{API}/info")
    device.refusal(response, 405, "method-not-allowed")
    expect("GET" in response.headers.get("allow", ""), "Allow does not list GET of /info")


def a_broken_body_is_a_problem(device: Device) -> None:
    """A body that is not JSON is answered with 400 and the problem bad-request, or with 422."""
    headers = {"content-type": "application/json"}
    response = device.send("PUT", f"{API}/acquisition", content=b"{", headers=headers)
    expect(response.status_code in (400, 422), f"a broken body gives {response.status_code}")
    device.refusal(response, response.status_code, "bad-request", "invalid-request")


def a_wrong_value_is_named(device: Device) -> None:
    """A value that cannot be used is answered with 422, and named with what would do."""
    with device.control():
        response = device.send("PUT", f"{API}/acquisition", json={"running": "perhaps"})
        problem = device.refusal(response, 422, "invalid-request", field="running")
        equal(problem.get("value"), "perhaps", "`value` in the problem")


def an_unknown_field_is_named(device: Device) -> None:
    """A field that is not known is refused with 422, and named."""
    response = device.send("POST", f"{API}/sequence/validate", json={"exposure_ms": 2})
    device.refusal(response, 422, "invalid-request", "invalid-sequence", field="exposure_ms")


def an_unknown_product_is_a_problem(device: Device) -> None:
    """A product that the camera has not is answered with 404, and those that it has are listed."""
    problem = device.refusal(
        device.send("GET", f"{API}/frames/latest/no-such-product"), 404, "unknown-product"
    )
    expect("range" in problem.get("known", ()), "the problem does not list range as known")


def an_unknown_recording_is_a_problem(device: Device) -> None:
    """A recording that is not there is answered with 404 and the problem unknown-recording."""
    device.refusal(device.send("GET", f"{API}/recordings/none"), 404, "unknown-recording")


def a_body_that_is_too_large_is_a_problem(device: Device) -> None:
    """A body that is longer than the service reads is answered with 413, not read to its end."""
    body = b" " * (4 * 1024 * 1024)
    headers = {"content-type": "application/json"}
    response = device.send("PUT", f"{API}/acquisition", content=body, headers=headers)
    device.refusal(response, 413, "too-large")


def every_problem_has_a_page(device: Device) -> None:
    """The type of a problem is the address of a page that explains it."""
    types = {
        device.refusal(device.send(method, path), status)["type"]
        for method, path, status in (
            ("GET", f"{API}/no-such-thing", 404),
            ("DELETE", f"{API}/info", 405),
            ("GET", f"{API}/frames/latest/no-such-product", 404),
        )
    }
    for each in types:
        page = device.send("GET", each)
        expect(page.status_code == httpx.codes.OK, f"{each} gives {page.status_code}, no page")


def every_answer_names_its_request(device: Device) -> None:
    """An answer repeats the X-Request-ID of its request, and has one of its own otherwise."""
    given = device.send("GET", f"{API}/info", headers={"x-request-id": _ID})
    equal(given.headers.get("x-request-id"), _ID, "X-Request-ID of the answer")
    first, second = (device.send("GET", f"{API}/no-such-thing") for _ in range(2))
    identifiers = {each.headers.get("x-request-id") for each in (first, second)}
    expect(None not in identifiers and len(identifiers) == 2, "requests have no ids of their own")
    equal(
        first.json().get("request_id"),
        first.headers.get("x-request-id"),
        "`request_id` in the problem",
    )
