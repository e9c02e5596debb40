"""An OAK ToF: raw images of its ToF node, four of which make a frame.

depthai is imported when a camera is asked for: it is large, and looks for devices by itself.
"""

from contextlib import suppress
from datetime import timedelta
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import (
    CameraLost,
    CameraNotFound,
    Capture,
    Description,
    Exposure,
    Lens,
    PluginError,
    ProtocolError,
)
from transientcam_supervisor import OffSwitch

WIDTH: Final = 640
HEIGHT: Final = 480
FREQUENCIES_HZ: Final = (80e6, 100e6)
_TAPS: Final = 4
_IMAGES: Final = 4
"""Of a frame: each frequency as it is, and with its taps swapped."""
_BROWN: Final = 5
"""Coefficients of Brown and Conrady, k1, k2, p1, p2, k3, which further ones follow."""
BITS: Final = 12
MEASURED: Final = tuple(
    Exposure(f_hz, (tap + 2 * swapped) % _TAPS * np.pi / 2)
    for f_hz in FREQUENCIES_HZ
    for swapped in (0, 1)
    for tap in range(_TAPS)
)
"""What the taps of the four images see, in the order of their numbers (assumed: see README)."""


class Oak:
    """A camera that is connected; `transientcam_driver.FreeRunningCamera` makes a camera of it.

    ``name``: id, IP address or USB port of the device; empty for any.
    ``fps``: raw images a second that are asked for.
    Raises CameraNotFound where there is no such device, or it has no ToF sensor.
    """

    off_switch = OffSwitch()
    """No other process reaches the device while this one has it."""

    def __init__(self, name: str, *, fps: float) -> None:
        try:
            depthai: Any = import_module("depthai")
        except ImportError as error:
            raise PluginError("oak", "the package depthai is not installed") from error
        self._depthai, self._fps = depthai, fps
        self._pipeline: Any = None
        try:
            self._device = depthai.Device(name) if name else depthai.Device()
        except RuntimeError as error:
            which = f"OAK {name}".strip()
            raise CameraNotFound(name, f"no {which} can be opened: {error}") from error
        try:
            sensors = self._device.getConnectedCameras(depthai.CameraSensorType.TOF)
            if not sensors:
                serial = self._device.getDeviceId()
                raise CameraNotFound(serial, f"the device {serial} has no ToF sensor")
            self._socket = sensors[0]
            self.description = Description(
                model=f"{self._device.getProductName() or 'OAK'} ToF",
                serial=self._device.getDeviceId(),
                firmware=f"depthai {depthai.__version__}",
                width=WIDTH,
                height=HEIGHT,
                frame_rate_hz=fps / _IMAGES,
                measurements=MEASURED,
                bits=BITS,
                lens=self._lens(),
            )
        except BaseException:
            self.close()
            raise

    def start(self, exposure_s: float) -> None:
        """Build a pipeline, which lights the laser; a stopped one cannot be started again."""
        depthai = self._depthai
        self._collected: list[Any] = []
        try:
            self._pipeline = depthai.Pipeline(self._device)
            profile = depthai.ToFConfig.Profile.MID_RANGE
            tof = self._pipeline.create(depthai.node.ToF)
            tof.build(boardSocket=self._socket, profile=profile, fps=self._fps)
            self._raw = tof.raw.createOutputQueue(maxSize=2 * _IMAGES, blocking=False)
            self._pipeline.start()
        except RuntimeError as error:
            raise CameraLost(str(error)) from error

    def receive(self, timeout_s: float) -> Capture | None:
        """Collect raw images until four of a frame are there; what has come is kept."""
        try:
            message = self._raw.get(timedelta(seconds=timeout_s))
        except RuntimeError as error:
            raise CameraLost(str(error)) from error
        if message is None:
            return None
        number = message.getSequenceNum()
        if self._collected and number != self._collected[-1].getSequenceNum() + 1:
            self._collected = []  # one is missing: the frame with it
        if not self._collected and number % _IMAGES:
            return None
        self._collected.append(message)
        if len(self._collected) < _IMAGES:
            return None
        images, self._collected = self._collected, []
        begun = images[0].getTimestampDevice(self._depthai.CameraExposureOffset.START)
        return Capture(
            [tap for image in images for tap in taps_of(image)],
            number // _IMAGES,
            begun.total_seconds(),
            message.getSensorTemperature(),
        )

    def temperature_c(self) -> float:
        """Ask the chip of the device for its temperature."""
        try:
            return float(self._device.getChipTemperature().average)
        except RuntimeError as error:
            raise CameraLost(str(error)) from error

    def light_off(self) -> None:
        """Stop the pipeline, and so the laser."""
        pipeline, self._pipeline = self._pipeline, None
        if pipeline is not None:
            try:
                pipeline.stop()
            except RuntimeError as error:
                raise CameraLost(str(error)) from error

    def close(self) -> None:
        """Give the device back."""
        with suppress(CameraLost):
            self.light_off()
        with suppress(RuntimeError):
            self._device.close()

    def _lens(self) -> Lens | None:
        """Return the lens by the EEPROM of the device; None where that holds none."""
        try:
            stored = self._device.readCalibration()
            (fx, _, cx), (_, fy, cy), _ = stored.getCameraIntrinsics(self._socket, WIDTH, HEIGHT)
            bent = stored.getDistortionCoefficients(self._socket)
        except RuntimeError:
            return None
        if any(bent[_BROWN:]):  # a model that `Lens` does not have: better none than a wrong one
            return None
        return Lens(fx, fy, cx, cy, tuple(bent[:_BROWN]))


def taps_of(message: Any) -> list[NDArray[np.uint16]]:
    """Return the images (H, W) of the taps of a raw image: 2 x 2 to a pixel, rows of data behind.

    Raises ProtocolError for an image of another size or type.
    """
    image, kind = message.getFrame(), message.getType().name
    found = f"raw images of {image.shape}, {kind}"
    if kind != f"RAW{BITS}" or image.shape[1:] != (2 * WIDTH,) or len(image) < 2 * HEIGHT:
        raise ProtocolError(f"{found}, not {2 * HEIGHT} rows of {2 * WIDTH}, RAW{BITS}")
    return [image[row : 2 * HEIGHT : 2, column::2] for row in (0, 1) for column in (0, 1)]
