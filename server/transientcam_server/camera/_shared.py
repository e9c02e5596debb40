"""Has a camera that others capture with, too: of another service, which this one relays."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from transientcam_driver import Camera, CameraState, NotStreaming, RawFrame
from transientcam_server.camera._acquisition import Acquisition
from transientcam_server.camera._darkness import KeptCause
from transientcam_server.camera._events import Event, OriginChanged
from transientcam_server.camera._light import LightGuard
from transientcam_server.errors import Problem, kinds
from transientcam_server.relay import RelayCamera

_T = TypeVar("_T")


class SharedAcquisition(Acquisition):
    """Follows what the camera does for others, and asks for changes before they are made here.

    Whether frames are captured, and with which sequence, is up to the origin. What this service
    does by itself (it starts, ends, or serves no client for a while) changes nothing there.
    """

    def __init__(
        self, camera: RelayCamera, *, report: Callable[[Event], None], light: LightGuard
    ) -> None:
        super().__init__(camera, report=report, light=light)
        self._origin = camera
        self._known = camera.origin
        self._running = self._started = camera.state is CameraState.STREAMING

    def occupy(
        self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T], *, offs: int
    ) -> "Future[_T]":
        """Refuse exclusive use of the camera, which is not this service's to give.

        Raises
        ------
        Problem
            ``camera-busy``, always.
        """
        url = self._origin.url
        raise Problem(kinds.CAMERA_BUSY, f"The camera belongs to {url}: calibrate it there.")

    def _light_is_held(self) -> bool:
        self._act_on_lapse()
        return False  # the origin guards its light by itself

    def _step(self) -> None:
        super()._step()
        if self._connected:
            self._follow()

    def _read(self) -> None:
        try:
            super()._read()
        except NotStreaming:
            self._follow()

    def _report_frame(self, raw: RawFrame) -> None:
        self._follow()
        super()._report_frame(raw)

    def _follow(self) -> None:
        """Take over what was changed at the origin."""
        running = self._camera.state is CameraState.STREAMING
        if running != self._running:
            self._running = self._started = running
            self._arrivals_s.clear()
            self._moved_s = self._clock()
        self._report_sequence()
        if self._origin.origin is not self._known:
            self._known = self._origin.origin
            self._report(OriginChanged())

    def _is_missed(self) -> bool:
        return False  # not by this service

    def _end_light(self) -> None:
        """Leave the light to the origin: only what clients ask for goes there."""
        self._started = False

    def _set_running(self, running: bool, cause: KeptCause = "stop") -> None:
        if running:
            self._camera.start()
        else:
            self._camera.stop()
        self._follow()

    def _camera_works(self) -> None:
        self._started = self._running
        super()._camera_works()

    def _safe_off(self) -> None:
        self._camera.safe_off()
        self._follow()

    def _switch_off_at_end(self) -> None:
        """Leave the light to the origin; `RelayCamera.close` ends what was switched on here."""
