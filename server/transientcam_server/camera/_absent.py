"""The place of a camera that is not there: what the service serves until there is one."""

from typing import Final, NoReturn

from transientcam_driver import Camera, CameraError, CameraLost, Capabilities, Sequence, open_camera
from transientcam_driver.camera import HostCamera
from transientcam_driver.clock import RealClock

NO_CAMERA: Final = "none"
"""The name that stands for it."""


class CameraAbsent(CameraLost):
    """No camera is chosen, or the one that is wanted cannot be opened."""

    _sentence = "{reason}"


class AbsentCamera(HostCamera):
    """A `Camera` that is lost, with one pixel in an image that it never makes.

    ``wanted``: what each `reconnect` tries to open, which becomes ``found``, with its name.
    """

    found: tuple[str, Camera] | None = None

    def __init__(self, reason: str = "no camera is chosen", *, wanted: str | None = None) -> None:
        super().__init__(RealClock(), None)
        self._reason, self._wanted = reason, wanted
        self._capabilities = Capabilities(
            model=NO_CAMERA, serial="", firmware="", protocol_version=0, width=1, height=1, bits=16,
            max_harmonics=12, min_frequency_hz=1e6, max_frequency_hz=1e8, tuning_step_hz=1.0,
            min_exposure_s=1e-6, max_exposure_s=1.0, readout_s=0.0, streaming_readout_s=0.0,
        )  # fmt: skip
        self._applied = self._capabilities.apply(self._capabilities.nearest(Sequence()), epoch=1)

    @property
    def off_switch(self) -> None:
        """None: there is no light."""

    def _lost(self, *_: object, **__: object) -> NoReturn:
        raise CameraAbsent(self._reason)

    configure = start = status = read_frame = _lost

    def reconnect(self) -> None:
        """Try to open the wanted camera; raises CameraLost also where it is found."""
        if self.found is None and self._wanted is not None:
            try:
                self.found = self._wanted, open_camera(self._wanted)
            except CameraError as error:
                self._reason = f"{self._wanted} cannot be opened: {error}"
        self._lost()

    def stop(self) -> None:
        """Do nothing: there is no light, and nothing to give back."""

    close = stop


def open_chosen(spec: str) -> Camera:
    """Open a camera as `open_camera` does, or the place of one."""
    return AbsentCamera() if spec == NO_CAMERA else open_camera(spec)
