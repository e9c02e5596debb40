"""The stream: its handshake, its greeting, its messages and how it closes."""

import numpy as np

from transientcam.wire import PRODUCTS, SUBPROTOCOL, CloseCode
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect

_META = ("frame", "sequence_id", "calibration_id", "device_time_s", "host_time_s", "capture_s")


def a_handshake_without_the_subprotocol_is_refused(device: Device) -> None:
    """A handshake that does not offer the subprotocol is refused with 400 and a problem."""
    headers = {
        "connection": "Upgrade",
        "upgrade": "websocket",
        "sec-websocket-version": "13",
        "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ==",
        "sec-websocket-protocol": "another.protocol.v7",
    }
    response = device.send("GET", f"{API}/stream", headers=headers)
    problem = device.refusal(response, 400, "subprotocol-required")
    expect(SUBPROTOCOL in problem.get("supported", ()), "`supported` does not name it")


def the_greeting_says_what_frames_look_like(device: Device) -> None:
    """Every channel of the hello has product, unit, axes, dtype and shape, and frames agree."""
    products = device.offered("range", "flags", "moments", "raw")
    with device.capturing(), device.stream(*products) as stream:
        channels = {each.channel: each for each in stream.channels}
        equal([each.product for each in stream.channels], list(products), "the channels' products")
        for _ in products:
            frame = stream.frame()
            channel = channels[-1 if frame.channel is None else frame.channel]
            known = PRODUCTS[frame.product]
            found = frame.product, frame.unit, frame.axes, frame.array.dtype, frame.array.shape
            names = channel.product, channel.unit, channel.axes
            expected = (*names, np.dtype(channel.dtype), channel.shape)
            equal(found, expected, f"a frame of {channel.product}")
            equal(frame.axes, known.axes, f"the axes of {known.name}")


def the_products_of_a_frame_come_together(device: Device) -> None:
    """The products of one frame are separate messages, in the order of the channels."""
    products = ("flags", "range", "direct")
    with device.capturing(), device.stream(*products) as stream:
        frames = [stream.frame() for _ in range(2 * len(products))]
        equal([each.product for each in frames], [*products, *products], "the order of products")
        for first in (frames[: len(products)], frames[len(products) :]):
            equal(len({each.frame for each in first}), 1, "the number of frames in one frame")


def frames_are_counted_and_announced(device: Device) -> None:
    """Every frame has its number, sequence, times and lost images; numbers only grow."""
    with device.capturing(), device.stream("flags") as stream:
        frames = [stream.frame() for _ in range(4)]
        numbers = [each.frame for each in frames]
        expect(numbers == sorted(set(numbers)), f"frames are counted {numbers}")
        times = [each.meta["device_time_s"] for each in frames]
        expect(times == sorted(set(times)), f"frames begin at {times} s")
        for frame in frames:
            missing = [key for key in _META if frame.meta.get(key) is None]
            expect(not missing, f"frame {frame.frame} has no {', '.join(missing)}")


def a_streamed_frame_is_the_one_that_is_asked_for(device: Device) -> None:
    """A product of a frame is the same array in the stream as over HTTP."""
    with device.control(), device.capturing():
        with device.stream("range") as stream:
            streamed = {each.frame: each for each in (stream.frame() for _ in range(2))}
            device.document(device.send("PUT", f"{API}/acquisition", json={"running": False}))
            latest = device.frame(f"{API}/frames/latest/range")
            while latest.frame not in streamed:
                frame = stream.frame()
                streamed[frame.frame] = frame
        same = np.array_equal(latest.array, streamed[latest.frame].array, equal_nan=True)
        expect(same, f"range of frame {latest.frame} differs between stream and HTTP")


def a_bad_first_message_ends_the_stream(device: Device) -> None:
    """A first message that is no subscription is answered with a problem, then closed with 4001."""
    with device.stream(silent=True) as stream:
        stream.send({"type": "ack", "frame": 1})
        equal(stream.problem().get("type"), "/problems/bad-message", "the problem")
        equal(stream.close_code(), CloseCode.BAD_FIRST_MESSAGE, "the close code")


def a_bad_later_message_disturbs_nothing(device: Device) -> None:
    """A later message that cannot be used is answered with a problem; the stream continues."""
    with device.capturing(), device.stream("flags") as stream:
        stream.frame()
        stream.send({"type": "subscribe", "v": 1, "subscriptions": [{"product": "no-such"}]})
        expect(stream.problem().get("type"), "the problem has no type")
        stream.send_text("not binary")
        equal(stream.problem().get("type"), "/problems/bad-message", "the problem of a text")
        equal(stream.frame().product, "flags", "the product streamed afterwards")


def a_subscription_can_be_replaced(device: Device) -> None:
    """A later subscribe replaces the subscription, and is answered with a new hello."""
    with device.capturing(), device.stream("flags") as stream:
        stream.frame()
        stream.send({"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]})
        greeted = stream.greeting()
        equal(
            [each.product for each in greeted.channels], ["range"], "the channels of the new hello"
        )
        equal(stream.frame().product, "range", "the product streamed afterwards")


def a_change_of_the_sequence_is_notified(device: Device) -> None:
    """A changed sequence is announced to every stream, with the channels from then on."""
    with device.control(), device.capturing(), device.stream("moments") as stream:
        present = device.sequence
        other = device.fixed_harmonics or (2 if present["harmonics"] != 2 else 3)
        changes = {"harmonics": other, "zeroth": "estimated"}
        if device.fixed_harmonics:
            changes = {"takes": present["takes"] + 1}
        changed = device.accepted(present | changes)
        applied = device.document(device.send("PUT", f"{API}/sequence", json=changed))
        stream.notice("sequence-changed")
        equal(stream.channels[0].shape[0], other + 1, "the moments in the notice")
        new = applied["sequence_id"]  # some frames of the former may still be on their way
        frame = stream.frame(lambda each: each.meta["sequence_id"] == new)
        equal(frame.array.shape[0], other + 1, "the moments of the first new frame")


def a_rate_limit_is_kept(device: Device) -> None:
    """max_rate_hz bounds how many frames of a product come, without losing any of another."""
    with device.capturing(), device.stream("flags", "range") as stream:
        rate_hz = device.sequence["frame_rate_hz"]
        slow = {"product": "range", "max_rate_hz": rate_hz / 4.0}
        message = {"type": "subscribe", "v": 1, "subscriptions": [{"product": "flags"}, slow]}
        stream.send(message)
        stream.greeting()
        names = [stream.frame().product for _ in range(15)]
        expect(
            1 <= names.count("range") <= 5,
            f"{names.count('range')} of 15 messages are of the product limited to a quarter",
        )
