"""Resuming a stream: missed frames are sent, or reported as missing."""

from transientcam.wire import Frame, Notice, ServerMessage
from transientcam_conformance._device import Device
from transientcam_conformance._expecting import equal, expect

_AFTER = 3


def a_stream_goes_on_where_it_stopped(device: Device) -> None:
    """A stream with `start` begins with that frame, or with a gap that names the missing ones."""
    with device.capturing():
        with device.stream("flags") as stream:
            last = stream.frame().frame
        with device.stream("flags") as watcher:
            watcher.frame(lambda each: each.frame >= last + _AFTER)
        _expect_from(device, last + 1)


def a_gap_is_stated(device: Device) -> None:
    """Frames that are no longer kept are reported as a gap from `start` to the last missing one.

    The first frame follows the gap without a hole.
    """
    with device.capturing():
        with device.stream("flags") as stream:
            stream.frame()
        _expect_from(device, 1)


def _expect_from(device: Device, start: int) -> None:
    with device.stream("flags", start=start) as stream:
        due = start
        seen: list[int] = []
        while len(seen) < _AFTER:
            message: ServerMessage = stream.receive()
            if isinstance(message, Notice) and message.kind in ("gap", "dropped"):
                due = _after(message, due)
            if isinstance(message, Frame):
                equal(message.frame, due, f"the next frame when resuming from {start}")
                seen.append(message.frame)
                due = message.frame + 1


def _after(notice: Notice, due: int) -> int:
    """Return which frame is next after a notice of missing ones."""
    if notice.kind == "dropped":
        return due + int(notice.details["count"])
    equal(notice.details.get("from"), due, "`from` of a gap")
    expect(notice.details.get("reason"), "a gap has no reason")
    return int(notice.details["to"]) + 1
