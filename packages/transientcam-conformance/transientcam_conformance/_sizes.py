"""Answers and messages beyond 1 MiB and 16 MiB, where many a library stops."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from transientcam_conformance._conversation import Conversation
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect, skip_unless

MIB: Final = 1024 * 1024
_LONGEST_CAPTURE_S = 10.0


def an_answer_over_1_mib_arrives_whole(device: Device) -> None:
    """A product over time of more than 1 MiB is answered whole."""
    _expect_transient(device, MIB)


def an_answer_over_16_mib_arrives_whole(device: Device) -> None:
    """A product over time of more than 16 MiB is answered whole."""
    _expect_transient(device, 16 * MIB)


def a_message_over_1_mib_arrives_whole(device: Device) -> None:
    """A streamed frame of more than 1 MiB arrives whole."""
    with _large(device, MIB) as stream:
        _expect_message(stream, MIB)


def a_message_over_16_mib_arrives_whole(device: Device) -> None:
    """A streamed frame of more than 16 MiB arrives whole."""
    with _large(device, 16 * MIB) as stream:
        _expect_message(stream, 16 * MIB)


def an_answer_without_measure_is_refused(device: Device) -> None:
    """A request for too many times of flight is refused with 422, naming the limit."""
    device.require_product("transient")
    with device.capturing():
        params = {"bins": 10**9, "wait_s": 10.0}
        response = device.send("GET", f"{API}/frames/latest/transient", params=params)
        device.refusal(response, 422, "invalid-request", "answer-too-large")


def _expect_transient(device: Device, size_bytes: int) -> None:
    device.require_product("transient")
    capabilities = device.camera["capabilities"]
    pixels = capabilities["width"] * capabilities["height"]
    bins = math.ceil(size_bytes / (4 * pixels)) + 1
    with device.capturing():
        params = {"bins": bins, "wait_s": 10.0}
        frame = device.frame(f"{API}/frames/latest/transient", params=params)
        shape = (bins, capabilities["height"], capabilities["width"])
        equal(frame.array.shape, shape, "the shape of the answer")
        expect(frame.array.nbytes > size_bytes, f"the answer has {frame.array.nbytes} bytes")
        expect(
            frame.time_s is not None and len(frame.time_s) == bins,
            "not every time of flight is listed",
        )


@contextmanager
def _large(device: Device, size_bytes: int) -> Iterator[Conversation]:
    """Stream raw images at a sequence with so many that a frame is large."""
    device.require_product("raw")
    with device.control(), device.capturing(), device.stream("flags") as stream:
        large = device.accepted(_sequence(device, size_bytes))
        applied = device.document(device.send("PUT", f"{API}/sequence", json=large))
        skip_unless(
            applied["capture_s"] < _LONGEST_CAPTURE_S,
            f"a frame of that size takes {applied['capture_s']:.0f} s to capture",
        )
        stream.send({"type": "subscribe", "v": 1, "subscriptions": [{"product": "raw"}]})
        stream.greeting()
        yield stream


def _sequence(device: Device, size_bytes: int) -> dict[str, Any]:
    capabilities, fixed = device.camera["capabilities"], device.fixed_harmonics
    images = math.ceil(size_bytes / (2 * capabilities["width"] * capabilities["height"])) + 1
    harmonics = fixed or min(capabilities["max_harmonics"], 8)
    phases = len(capabilities["sampling"]["phases_rad"]) if fixed else 4
    takes = math.ceil(images / (phases * harmonics))
    skip_unless(
        takes <= capabilities["max_takes"], f"this camera makes no frame of {size_bytes // MIB} MiB"
    )
    half_hz = capabilities["max_frequency_hz"] / harmonics / 2.0
    return {
        "harmonics": harmonics,
        "takes": takes,
        "zeroth": "estimated",
        "exposure_s": capabilities["min_exposure_s"],
        "base_frequency_hz": capabilities["min_frequency_hz"] if fixed else half_hz,
    }


def _expect_message(stream: Conversation, size_bytes: int) -> None:
    frame = stream.frame(lambda each: each.product == "raw" and each.array.nbytes > size_bytes)
    equal(frame.array.shape, stream.channels[0].shape, "the shape of the frame")
    equal(len(frame.labels), frame.array.shape[0], "the number of labels")
