"""The table of docs/operations.md that says who switches which camera's light off, and when.

It follows from what the drivers state: `Capabilities.heartbeat_s` and `Camera.off_switch`.
"""

from collections.abc import Iterator
from typing import Final

from transientcam_driver import Camera, open_camera
from transientcam_server.settings import Settings
from transientcam_supervisor import OffSwitch, TcpMessage, UsbClaim, UsbReset

BEGIN: Final = "<!-- `python tools/documents.py --write` writes what follows -->\n"
END: Final = "<!-- up to here -->\n"
CAMERAS: Final = {
    "open USB camera (`usb`)": "sim:wall",
    "Kinect v2 (`kinect2`)": "kinect2:emulated",
    "OPT8241-CDK (`opt8241`)": "opt8241:emulated",
    "TOFcam660 (`tofcam660`)": "tofcam660:emulated",
}
"""Each by an emulation, which states the same."""
NOTHING: Final = "**nothing**, until it has no power"


def with_table(page: str) -> str:
    """Return the page with the table as the drivers state it."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    columns = [list(_cells(spec)) for spec in CAMERAS.values()]
    rows = ("| | " + " | ".join(CAMERAS) + " |", "|---" * (len(CAMERAS) + 1) + "|")
    cells = (
        f"| {name} | " + " | ".join(column[k] for column in columns) + " |"
        for k, name in enumerate(_rows())
    )
    return before + BEGIN + "\n".join((*rows, *cells)) + "\n" + END + after


def _rows() -> Iterator[str]:
    yield "watchdog of its own (`heartbeat_s`)"
    yield "how the supervisor switches it off"
    yield "the daemon ends by a signal or a crash, or is killed for memory"
    yield "the daemon, or its thread of the camera, hangs or is stopped"
    yield "the same while the camera starts"
    yield "the supervisor ends or hangs"
    yield "both are killed at once; the machine hangs"


def _cells(spec: str) -> Iterator[str]:
    with open_camera(spec) as camera:
        switch = camera.off_switch
        assert switch is not None
        alone, silence_s = _alone(camera, switch), Settings().limits.unserved_s
    heartbeat_s = camera.capabilities.heartbeat_s
    yield f"{heartbeat_s:g} s" if heartbeat_s else "**none**"
    yield _how(switch)
    if not switch.steps:
        yield from [alone] * 5
        return
    yield f"the supervisor, 0.3 s, or {silence_s:g} s + 0.3 s where a core is dumped"
    yield f"the supervisor, {silence_s:g} s + 0.3 s"
    yield f"the supervisor, {silence_s + switch.start_s:g} s + 0.3 s"
    yield f"the daemon, 0.2 s, or {2 * silence_s:g} s where it hangs"
    yield alone


def _alone(camera: Camera, switch: OffSwitch) -> str:
    """Return what switches the light off where nobody asks for anything any more."""
    if camera.capabilities.heartbeat_s:
        return f"the device, {camera.capabilities.heartbeat_s:g} s"
    return f"the exposure ends, {switch.ends_s:.1f} s" if switch.ends_s else NOTHING


def _how(switch: OffSwitch) -> str:
    if not switch.steps:
        return "not at all"
    kinds = {type(each) for each in switch.steps}
    if TcpMessage in kinds:
        return "by a command over a connection of its own"
    if UsbClaim in kinds:
        return "by the camera's commands, over interfaces that it takes from the daemon"
    return "by a request beside the daemon's" + (", or a reset" if UsbReset in kinds else "")
