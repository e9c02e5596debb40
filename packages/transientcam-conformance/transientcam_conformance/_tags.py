"""ETag and If-Match: no client overwrites a change that another has made meanwhile."""

from typing import Any

import httpx

from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect

_SEQUENCE = f"{API}/sequence"
_STALE = '"of-another-state"'


def what_can_be_changed_has_a_tag(device: Device) -> None:
    """The answer to GET carries an ETag, the same as long as nothing was changed."""
    for path in _tagged(device):
        first, second = _tag(device, path), _tag(device, path)
        equal(second, first, f"the ETag of {path}, unchanged,")


def what_is_known_is_not_sent_again(device: Device) -> None:
    """If-None-Match with the ETag is answered with 304 and no body, another with 200."""
    for path in _tagged(device):
        tag = _tag(device, path)
        same = device.send("GET", path, headers={"if-none-match": tag})
        equal((same.status_code, same.content), (304, b""), f"{path}, known already,")
        other = device.send("GET", path, headers={"if-none-match": _STALE})
        equal(other.status_code, 200, f"{path}, known as something else,")


def a_stale_tag_changes_nothing(device: Device) -> None:
    """A PUT whose If-Match names another state is answered with 412 and changes nothing."""
    with device.control():
        for path in _tagged(device):
            before, tag = device.read(path), _tag(device, path)
            response = device.send("PUT", path, json=before, headers={"if-match": _STALE})
            device.refusal(response, 412)
            equal(_tag(device, path), tag, f"the ETag of {path} after a refused change")


def the_right_tag_changes_it(device: Device) -> None:
    """A PUT whose If-Match names the present state is done, and answered with the new ETag."""
    with device.control():
        changed = _other(device)
        tag = _tag(device, _SEQUENCE)
        response = device.send("PUT", _SEQUENCE, json=changed, headers={"if-match": tag})
        device.document(response)
        new = response.headers.get("etag")
        expect(new is not None and new != tag, f"the new ETag is {new}, that before was {tag}")
        equal(_tag(device, _SEQUENCE), new, "the ETag read afterwards")
        again = device.send("PUT", _SEQUENCE, json=changed, headers={"if-match": tag})
        device.refusal(again, 412, "sequence-changed")


def _tagged(device: Device) -> list[str]:
    """Return every resource that takes If-Match by its description."""
    return [
        path
        for path, methods in sorted(device.openapi["paths"].items())
        if any(
            each["name"].lower() == "if-match"
            for each in methods.get("put", {}).get("parameters", ())
        )
    ]


def _tag(device: Device, path: str) -> str:
    response = device.send("GET", path)
    expect(response.status_code == httpx.codes.OK, f"GET {path} gives {response.status_code}")
    tag = response.headers.get("etag")
    expect(tag, f"GET {path} has no ETag")
    return str(tag)


def _other(device: Device) -> dict[str, Any]:
    """Return a sequence that differs from the present one, and that the camera takes."""
    present = device.sequence
    capabilities = device.camera["capabilities"]
    least, most = capabilities["min_exposure_s"], capabilities["max_exposure_s"]
    exposure_s = present["exposure_s"]
    longer = exposure_s * 1.25 if exposure_s * 1.25 <= most else max(least, exposure_s / 2.0)
    return device.accepted(present | {"exposure_s": longer})
