"""What can go wrong between a program and its camera.

::

    DriverError
    ├── FieldError             a field has a value that it cannot have
    │   ├── SequenceError      of a sequence, in general or on this camera
    │   └── EffectError        there is no such effect, or no such choice of one
    ├── SceneError             a scene file is not valid
    ├── SpecError              open_camera() was given a name that is not valid
    ├── PluginError            the package of a camera cannot be used
    ├── CompilerMissing        a simulated scene moves, and numba is not installed
    ├── CalibrationError
    │   ├── CalibrationMismatch   a calibration belongs to something else
    │   └── CalibrationFileError  a file holds no calibration
    └── CameraError
        ├── CameraNotFound     no such camera is plugged in
        │   └── CameraUnreachable  no camera answers at an address of the network
        ├── PermissionDenied   it is there, and this user may not open it
        ├── CameraBusy         another program holds it
        ├── LibusbMissing      the USB library of the system is missing
        ├── CameraLost         it was unplugged, or stopped to answer
        ├── CameraClosed       close() was called
        ├── NotStreaming       read_frame() without start()
        ├── FrameTimeout       no complete frame within the time given
        ├── CameraFault        the device switched itself off
        ├── DeviceRefused      the device refused a request, with its reason
        ├── ImagesLost         images that were asked for will not come, or not whole
        ├── TransferStalled    an endpoint answered with a stall
        ├── TransferOverflow   the device sent more than was requested
        └── ProtocolError      it sent something the protocol does not allow
            └── FirmwareTooOld

``ImagesLost``, ``TransferStalled`` and ``TransferOverflow`` go from the transport to the camera,
which recovers from them or raises one of the others.
"""

import reprlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, dataclass_transform

_SHOWN = reprlib.Repr()  # of a value that may be of any size and depth
_SHOWN.maxstring = _SHOWN.maxother = _SHOWN.maxlong = 200
UDEV_RULES_FILE = "/etc/udev/rules.d/60-transientcam.rules"


@dataclass_transform(eq_default=False, field_specifiers=(field,))
class StatedError(Exception):
    """A dataclass of its data, whose ``_sentence`` is a format string of its fields.

    The sentence is what ``str`` gives.
    """

    _sentence: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        dataclass(eq=False, repr=False)(cls)

    def __post_init__(self) -> None:
        self.args = tuple(vars(self).values())  # by which it is pickled

    def __str__(self) -> str:
        return self._sentence.format_map(vars(self))


class DriverError(Exception):
    """Everything this package raises on purpose; without fields its argument is a sentence."""


class FieldError(DriverError, StatedError):
    """``field`` has a ``value`` beyond its ``limit``."""

    field: str
    value: object
    limit: str

    def __str__(self) -> str:
        return f"{self.field} = {_SHOWN.repr(self.value)}: must be {self.limit}"


class SequenceError(FieldError):
    """A field of a sequence is outside what is possible, in general or on this camera."""


class EffectError(FieldError):
    """An effect of the simulation, or a choice for one, that does not exist."""


class SceneError(DriverError, StatedError):
    """A scene file holds a key or a value that is not valid, or lacks one that is required."""

    file: str | Path
    key: str
    value: object
    allowed: str
    _sentence = "{file}: {key} = {value!r}: must be {allowed}"

    def __post_init__(self) -> None:
        self.file = str(self.file)
        super().__post_init__()


class SpecError(DriverError, StatedError):
    """The name given to ``open_camera`` is not valid."""

    spec: str
    reason: str
    _sentence = "camera {spec!r}: {reason}"


class PluginError(DriverError, StatedError):
    """The plug-in of a kind of camera cannot be used."""

    kind: str
    reason: str
    _sentence = "the camera {kind!r} cannot be used: {reason}"


class CompilerMissing(DriverError, StatedError):
    """The light of a simulated scene that moves is computed by numba, which cannot be used."""

    reason: str
    _sentence = (
        "scenes that move need numba ({reason}): pip install 'transientcam[simulation]', "
        "or choose a scene that stands still"
    )


class CalibrationError(DriverError):
    """Something about a calibration measurement."""


class CalibrationMismatch(CalibrationError, StatedError):
    """A calibration is good for one camera, sequence and exposure, and ``field`` differs."""

    field: str
    value: object
    needed: object
    _sentence = "the calibration is for {field} = {needed!r}, not {value!r}"


class CalibrationFileError(CalibrationError, StatedError):
    """A file holds no calibration: ``key`` is ``found``, not ``expected``."""

    file: str | Path
    key: str
    found: object
    expected: object
    _sentence = "{file}: {key} is {found}, but must be {expected}"

    def __post_init__(self) -> None:
        self.file = str(self.file)
        super().__post_init__()


class CameraError(DriverError):
    """Something between this process and the camera."""


class CameraNotFound(CameraError, StatedError):
    """No camera of this kind, or none with this serial number, is plugged in."""

    serial: str | None = None
    reason: str = ""  # in words of its own

    def __str__(self) -> str:
        named = "" if self.serial is None else f" with serial number {self.serial!r}"
        return self.reason or f"no camera{named} is plugged in"


class CameraUnreachable(CameraNotFound):
    """No camera answers at an address of the network."""

    def __str__(self) -> str:
        return f"no camera answers at {self.serial}"


class PermissionDenied(CameraError, StatedError):
    """The camera is plugged in, but this user may not open its device node."""

    node: str
    rule: str
    _sentence = (
        f"no permission to open {{node}}. Put this line into {UDEV_RULES_FILE}:\n"
        "  {rule}\n"
        "then run `udevadm control --reload && udevadm trigger`, "
        "join the group plugdev, and plug the camera in again"
    )


class CameraBusy(CameraError, StatedError):
    """Another program has claimed the camera; a camera serves one program at a time."""

    node: str
    _sentence = "another program holds the camera at {node} (`fuser -v {node}` names it)"


class LibusbMissing(CameraError, StatedError):
    """The system has no libusb-1.0."""

    _sentence = "libusb-1.0 was not found (Debian, Ubuntu: apt install libusb-1.0-0)"


class CameraLost(CameraError, StatedError):
    """The camera was unplugged or stopped to answer; ``Camera.reconnect`` finds it again."""

    reason: str
    _sentence = "the camera was lost: {reason}"


class CameraClosed(CameraError, StatedError):
    """The camera was closed by this process."""

    _sentence = "the camera is closed"


class NotStreaming(CameraError, StatedError):
    """``read_frame`` while the camera was not started, or was stopped meanwhile."""

    state: str
    _sentence = "the camera is {state}, not streaming: call start() first"


class FrameTimeout(CameraError, StatedError):
    """No complete frame arrived within the time given."""

    timeout_s: float
    _sentence = "no complete frame within {timeout_s:g} s"


class CameraFault(CameraError, StatedError):
    """The device switched its light off by itself."""

    reason: str
    _sentence = "the camera switched its light off: {reason}"


class DeviceRefused(CameraError, StatedError):
    """The device stalled a request; ``code`` and ``detail`` are its answer to GET_LAST_ERROR."""

    request: str
    code: str
    detail: str

    def __str__(self) -> str:
        return f"the camera refused {self.request}: {self.detail or self.code}"


class ImagesLost(CameraError, StatedError):
    """Images that were asked for will not come, or not whole."""

    reason: str
    _sentence = "images were lost: {reason}"


class TransferStalled(CameraError, StatedError):
    """An endpoint answered with a stall."""

    _sentence = "the camera stalled a transfer"


class TransferOverflow(CameraError, StatedError):
    """The device sent more in one transfer than the host had requested."""

    _sentence = "the camera sent more than was asked for"


class ProtocolError(CameraError, StatedError):
    """The device sent something the protocol does not allow."""

    detail: str
    _sentence = "the camera does not keep to the protocol: {detail}"


class FirmwareTooOld(ProtocolError):
    """The firmware has a version of the protocol that this driver does not have."""

    detail: str = field(init=False)
    found: int
    needed: int

    def __post_init__(self) -> None:
        super().__post_init__()
        found, needed = self.found, self.needed
        self.detail = f"version {found} found, version {needed} needed: update the firmware"
