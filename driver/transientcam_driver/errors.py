"""What can go wrong between a program and its camera.

::

    DriverError
    ├── SequenceError          a field of a sequence is out of range
    ├── SceneError             a scene file says something that cannot be
    ├── EffectError            there is no such effect, or no such choice of one
    ├── SpecError              open_camera() was given a name it cannot read
    ├── CalibrationError
    │   ├── CalibrationMismatch   a calibration belongs to something else
    │   └── CalibrationFileError  a file holds no calibration
    └── CameraError
        ├── CameraNotFound     no such camera is plugged in
        ├── PermissionDenied   it is there, and this user may not open it
        ├── CameraBusy         another program holds it
        ├── LibusbMissing      the USB library of the system is missing
        ├── CameraLost         it was unplugged, or stopped to answer
        ├── CameraClosed       close() was called
        ├── NotStreaming       read_frame() without start()
        ├── FrameTimeout       no complete frame within the time given
        ├── CameraFault        the device switched itself off, and says why
        ├── DeviceRefused      the device refused a request, and says why
        ├── TransferStalled    an endpoint answered with a stall
        ├── TransferOverflow   the device sent more than was asked for
        └── ProtocolError      it sent something the protocol does not allow
            └── FirmwareTooOld

``TransferStalled`` and ``TransferOverflow`` are what the transport tells the camera; the camera
recovers from both, or raises one of the others.
"""

from pathlib import Path

UDEV_RULES_FILE = "/etc/udev/rules.d/60-transientcam.rules"


class DriverError(Exception):
    """Everything this package raises on purpose."""


class SequenceError(DriverError):
    """A field of a sequence is outside what is possible, in general or on this camera."""

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(field, value, limit)
        self.field = field
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        return f"{self.field} = {self.value!r}: must be {self.limit}"


class SceneError(DriverError):
    """A scene file holds a key or a value that means nothing, or lacks one it needs."""

    def __init__(self, file: str | Path, key: str, value: object, allowed: str) -> None:
        super().__init__(file, key, value, allowed)
        self.file = str(file)
        self.key = key
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.file}: {self.key} = {self.value!r}: must be {self.allowed}"


class EffectError(DriverError):
    """An effect of the simulation, or a choice for one, that does not exist."""

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(field, value, limit)
        self.field = field
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        return f"{self.field} = {self.value!r}: must be {self.limit}"


class SpecError(DriverError):
    """The name given to ``open_camera`` cannot be read."""

    def __init__(self, spec: str, reason: str) -> None:
        super().__init__(spec, reason)
        self.spec = spec
        self.reason = reason

    def __str__(self) -> str:
        return (
            f"camera {self.spec!r}: {self.reason} "
            "(usb, usb:SERIAL, sim:SCENE or sim:SCENE?width=320&height=240&noise=off&seed=3)"
        )


class CalibrationError(DriverError):
    """Something about a calibration measurement."""


class CalibrationMismatch(CalibrationError):  # noqa: N818 - says what is wrong
    """A calibration is good for one camera, sequence and exposure, and ``field`` differs."""

    def __init__(self, field: str, value: object, needed: object) -> None:
        super().__init__(field, value, needed)
        self.field = field
        self.value = value
        self.needed = needed

    def __str__(self) -> str:
        return f"the calibration is for {self.field} = {self.needed!r}, not {self.value!r}"


class CalibrationFileError(CalibrationError):
    """A file holds no calibration: ``key`` is ``found``, not ``expected``."""

    def __init__(self, file: str | Path, key: str, found: object, expected: object) -> None:
        super().__init__(file, key, found, expected)
        self.file = str(file)
        self.key = key
        self.found = found
        self.expected = expected

    def __str__(self) -> str:
        return f"{self.file}: {self.key} is {self.found}, but must be {self.expected}"


class CameraError(DriverError):
    """Something between this process and the camera."""


class CameraNotFound(CameraError):  # noqa: N818 - a state has no "Error" in its name
    """No camera of this kind, or none with this serial number, is plugged in."""

    def __init__(self, serial: str | None = None) -> None:
        super().__init__(serial)
        self.serial = serial

    def __str__(self) -> str:
        if self.serial is None:
            return "no camera is plugged in"
        return f"no camera with serial number {self.serial!r} is plugged in"


class PermissionDenied(CameraError):  # noqa: N818 - the same
    """The camera is plugged in, but this user may not open its device node."""

    def __init__(self, node: str, rule: str) -> None:
        super().__init__(node, rule)
        self.node = node
        self.rule = rule

    def __str__(self) -> str:
        return (
            f"no permission to open {self.node}. Put this line into {UDEV_RULES_FILE}:\n"
            f"  {self.rule}\n"
            "then run `udevadm control --reload && udevadm trigger`, "
            "join the group plugdev, and plug the camera in again"
        )


class CameraBusy(CameraError):  # noqa: N818 - the same
    """Another program has claimed the camera; a camera serves one program at a time."""

    def __init__(self, node: str) -> None:
        super().__init__(node)
        self.node = node

    def __str__(self) -> str:
        return f"another program holds the camera at {self.node} (`fuser -v {self.node}` names it)"


class LibusbMissing(CameraError):  # noqa: N818 - the same
    """The system has no libusb-1.0."""

    def __str__(self) -> str:
        return "libusb-1.0 was not found (Debian, Ubuntu: apt install libusb-1.0-0)"


class CameraLost(CameraError):  # noqa: N818 - the same
    """The camera was unplugged or stopped to answer; ``Camera.reconnect`` finds it again."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason

    def __str__(self) -> str:
        return f"the camera was lost: {self.reason}"


class CameraClosed(CameraError):  # noqa: N818 - the same
    """The camera was closed by this process."""

    def __str__(self) -> str:
        return "the camera is closed"


class NotStreaming(CameraError):  # noqa: N818 - the same
    """A frame was asked for while the camera was not started, or was stopped meanwhile."""

    def __init__(self, state: str) -> None:
        super().__init__(state)
        self.state = state

    def __str__(self) -> str:
        return f"the camera is {self.state}, not streaming: call start() first"


class FrameTimeout(CameraError):  # noqa: N818 - the same
    """No complete frame arrived within the time given."""

    def __init__(self, timeout_s: float) -> None:
        super().__init__(timeout_s)
        self.timeout_s = timeout_s

    def __str__(self) -> str:
        return f"no complete frame within {self.timeout_s:g} s"


class CameraFault(CameraError):  # noqa: N818 - the same
    """The device switched its light off by itself."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason

    def __str__(self) -> str:
        return f"the camera switched its light off: {self.reason}"


class DeviceRefused(CameraError):  # noqa: N818 - the same
    """The device stalled a request; ``code`` and ``detail`` are its answer to GET_LAST_ERROR."""

    def __init__(self, request: str, code: str, detail: str) -> None:
        super().__init__(request, code, detail)
        self.request = request
        self.code = code
        self.detail = detail

    def __str__(self) -> str:
        return f"the camera refused {self.request}: {self.detail or self.code}"


class TransferStalled(CameraError):  # noqa: N818 - the same
    """An endpoint answered with a stall."""

    def __str__(self) -> str:
        return "the camera stalled a transfer"


class TransferOverflow(CameraError):  # noqa: N818 - the same
    """The device sent more in one transfer than the host had asked for."""

    def __str__(self) -> str:
        return "the camera sent more than was asked for"


class ProtocolError(CameraError):
    """The device sent something the protocol does not allow."""

    def __init__(self, detail: str) -> None:
        super().__init__(detail)
        self.detail = detail

    def __str__(self) -> str:
        return f"the camera does not keep to the protocol: {self.detail}"


class FirmwareTooOld(ProtocolError):  # noqa: N818 - the same
    """The firmware speaks a version of the protocol that this driver does not."""

    def __init__(self, found: int, needed: int) -> None:
        super().__init__(f"version {found} found, version {needed} needed: update the firmware")
        self.found = found
        self.needed = needed

    def __reduce__(self) -> tuple[type["FirmwareTooOld"], tuple[int, int]]:
        return type(self), (self.found, self.needed)
