"""How another process switches the light of a Kinect v2 off: as its owner does, by its commands."""

from transientcam_driver.cameras.kinect2._commands import COMPLETION_BYTES
from transientcam_driver.cameras.kinect2._device import READY_EVERY_S, READY_TRIES, STOP_REQUESTS
from transientcam_driver.cameras.kinect2._usb_link import (
    ANSWERS,
    COMMANDS,
    CONTROL,
    FUNCTION_SUSPEND,
    SET_FEATURE,
    STREAM,
    SUSPEND_AND_WAKE,
    TO_INTERFACE,
)
from transientcam_supervisor import (
    OffSwitch,
    Step,
    UsbClaim,
    UsbControl,
    UsbRead,
    UsbSetting,
    UsbWrite,
)


def off_switch(node: str) -> OffSwitch:
    """Return it for the camera at a device node.

    Commands go over an endpoint, whose interface has to be taken from the owner. Whether a reset of
    the port switches the light off is not known, so that none is asked for.
    """
    commands: list[Step] = []
    for number, request in enumerate(STOP_REQUESTS):
        commands += UsbWrite(COMMANDS, request.pack(number)), UsbRead(ANSWERS, COMPLETION_BYTES)
    steps = (
        UsbClaim(CONTROL),
        UsbClaim(STREAM),
        UsbSetting(STREAM, 0),
        *commands,
        UsbControl(TO_INTERFACE, SET_FEATURE, FUNCTION_SUSPEND, SUSPEND_AND_WAKE),
    )
    return OffSwitch(node, steps, start_s=READY_TRIES * READY_EVERY_S)
