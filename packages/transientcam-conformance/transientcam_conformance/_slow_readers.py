"""Slow readers lose frames, with notices; no other client is affected."""

import math
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Final

import numpy as np

from transientcam.errors import PromiseBroken
from transientcam.wire import Channel
from transientcam_conformance._conversation import Conversation
from transientcam_conformance._device import Device
from transientcam_conformance._expecting import equal, expect, skip_unless

_FRAMES: Final = 10
_UNTIL_STUCK: Final = 15
"""Frames of which several come before a client that reads nothing has all its buffers full."""
_ATTEMPTS: Final = 6
"""A machine that is busy for a moment breaks no promise."""
_ROUNDS: Final = 3
_MORE_THAN_BUFFERS_BYTES: Final = (24 * 1024 * 1024, 96 * 1024 * 1024)
"""Between a daemon and its client; a proxy on the way has buffers of its own."""
_SMALL_BYTES: Final = 400 * 1024
_LARGE: Final = ("raw", "moments", "direct", "indirect", "range")


def drops_are_reported(device: Device) -> None:
    """A late acknowledgement is answered with the newest frame and the number dropped before."""
    with (
        device.capturing(),
        device.stream("flags") as steady,
        device.stream("range", credit=1) as slow,
    ):
        first = slow.frame()
        steady.frame(lambda each: each.frame >= first.frame + 5)
        slow.acknowledge(first.frame)
        second = slow.frame()
        missed = second.frame - first.frame - 1
        expect(missed >= 3, f"{missed} frames are missing between two, 5 after the first were due")
        equal(slow.dropped(_channel(slow)), missed, "the number of frames reported as dropped")


def who_does_not_acknowledge_gets_no_more_than_its_credits(device: Device) -> None:
    """No more frames than the credits are on their way unacknowledged."""
    with device.capturing():
        for _ in range(_ROUNDS):  # a busy daemon may leave out the very frame that would show it
            _keeps_to_credits(device)


def _keeps_to_credits(device: Device) -> None:
    with device.stream("range") as steady, device.stream("range", credit=2) as slow:
        first, second = slow.frame(), slow.frame()
        newest = steady.frame(lambda each: each.frame >= second.frame + 4)
        slow.acknowledge(second.frame)
        # one sent before the acknowledgement is older, whichever a busy daemon left out
        expect(slow.frame().frame >= newest.frame, "frames were sent beyond the credits")
        expect(first.frame < second.frame, "frames come twice")


def a_client_that_never_reads_delays_no_other(device: Device) -> None:
    """While one client reads nothing at all, another gets every single frame."""
    with device.capturing():
        if not any(
            _gets_everything(device, beside=device.offered(*_LARGE)) for _ in range(_ATTEMPTS)
        ):
            # a machine that is too busy for a client alone says nothing of the other one
            alone = all(_gets_everything(device) for _ in range(_ATTEMPTS))
            skip_unless(alone, "a client misses frames without that other one, too")
            raise PromiseBroken("a healthy client misses frames while another one does not read")


def who_never_reads_loses_frames(device: Device) -> None:
    """Frames are not kept for a client that does not read: it loses them, and gets their number."""
    lost = any(_loses_frames(device, size_bytes) for size_bytes in _MORE_THAN_BUFFERS_BYTES)
    expect(lost, "everything was kept for a client that does not read")


def _gets_everything(device: Device, *, beside: Sequence[str] = ()) -> bool:
    """Return whether a client gets every frame; beside one that reads nothing, if that has any."""
    with (
        device.stream(*beside, unread=True) if beside else nullcontext(),
        device.stream("flags") as healthy,
    ):
        first = healthy.frame()
        if beside:  # what buffers take is still computed for that one
            stuck = first.frame + _UNTIL_STUCK
            first = healthy.frame(lambda each: each.frame >= stuck)
        lost = healthy.dropped(_channel(healthy))
        numbers = [first.frame, *(healthy.frame().frame for _ in range(_FRAMES - 1))]
        missed = numbers[-1] - numbers[0] + 1 - len(numbers)
        equal(
            healthy.dropped(_channel(healthy)) - lost,
            missed,
            "the number of frames reported to a healthy client as dropped",
        )
        return not missed


def _loses_frames(device: Device, size_bytes: int) -> bool:
    """Leave so much unread, and return whether any of it was dropped."""
    with (
        device.capturing(),
        device.stream(*device.offered(*_LARGE), unread=True) as stuck,
        device.stream("flags") as healthy,
    ):
        frame_bytes = sum(_bytes(each) for each in stuck.channels)
        skip_unless(frame_bytes > _SMALL_BYTES, "frames are too small to fall behind with")
        last = healthy.frame().frame + math.ceil(size_bytes / frame_bytes)
        healthy.frame(lambda each: each.frame >= last)
        return _has_dropped(stuck, last)


def _has_dropped(stuck: Conversation, last: int) -> bool:
    """Read what has waited: every gap between frames of a channel was reported as dropped."""
    channel = _channel(stuck)
    newest = stuck.frame(lambda each: each.channel == channel).frame
    while newest < last:
        number = stuck.frame(lambda each: each.channel == channel).frame
        missed = number - newest - 1
        if missed:
            equal(stuck.dropped(channel), missed, "the frames reported as dropped")
            return True
        newest = number
    return False


def _bytes(channel: Channel) -> int:
    return math.prod(channel.shape) * np.dtype(channel.dtype).itemsize


def _channel(conversation: Conversation) -> int:
    return conversation.channels[0].channel
