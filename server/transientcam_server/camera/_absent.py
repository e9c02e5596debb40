"""The place of a camera that is not there: what the service serves until there is one."""

from typing import Final

from transientcam_driver import (
    AppliedSequence,
    Camera,
    CameraError,
    CameraLost,
    CameraState,
    Capabilities,
    RawFrame,
    Sequence,
    Status,
    open_camera,
)
from transientcam_driver.camera import HostCamera
from transientcam_driver.clock import RealClock

NO_CAMERA: Final = "none"
"""The name that stands for it."""


class CameraAbsent(CameraLost):
    """No camera is chosen, or the one that is wanted cannot be opened."""

    _sentence = "{reason}"


class AbsentCamera(HostCamera):
    """Has the methods of `transientcam_driver.Camera`, all of which raise that it is not there.

    Its image has one pixel, and it never makes one.

    ``wanted``: the camera that each `reconnect` tries to open, which becomes ``found`` with its
    name; None waits for none.
    """

    def __init__(self, reason: str = "no camera is chosen", *, wanted: str | None = None) -> None:
        super().__init__(RealClock(), None)
        self.found: tuple[str, Camera] | None = None
        self._reason, self._wanted = reason, wanted
        self._state = CameraState.DISCONNECTED
        self._capabilities = Capabilities(
            model=NO_CAMERA,
            serial="",
            firmware="",
            protocol_version=0,
            width=1,
            height=1,
            bits=16,
            readout_s=0.0,
            streaming_readout_s=0.0,
            tuning_step_hz=1.0,
            min_frequency_hz=1e6,
            max_frequency_hz=400e6,
            max_harmonics=12,
            min_exposure_s=1e-9,
            max_exposure_s=1.0,
        )
        self._applied = self._capabilities.apply(self._capabilities.nearest(Sequence()), epoch=1)

    @property
    def off_switch(self) -> None:
        """None: there is no light."""
        return

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Raise CameraAbsent, as all do that need a camera."""
        raise self._absent()

    def start(self) -> None:
        """As `configure`."""
        raise self._absent()

    def status(self) -> Status:
        """As `configure`."""
        raise self._absent()

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """As `configure`."""
        raise self._absent()

    def reconnect(self) -> None:
        """Look whether the wanted camera can be opened by now; raises CameraError while not."""
        if self.found is None and self._wanted is not None:
            try:
                self.found = self._wanted, open_camera(self._wanted)
            except CameraError as error:
                self._reason = f"{self._wanted} cannot be opened: {error}"
        raise self._absent()

    def stop(self) -> None:
        """Do nothing: there is no light."""

    def close(self) -> None:
        """Do nothing."""

    def _absent(self) -> CameraAbsent:
        return CameraAbsent(self._reason)


def open_chosen(spec: str) -> Camera:
    """Open a camera that is chosen while the service runs, with its first sequence.

    Raises DriverError as `open_camera`; none is left open then.
    """
    if spec == NO_CAMERA:
        return AbsentCamera()
    camera = open_camera(spec)
    try:
        camera.status()
    except BaseException:
        camera.close()
        raise
    return camera
