"""Has a camera that others capture with, too: of another service, which this one relays."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import TypeVar

from transientcam_driver import Camera, CameraLost, CameraState, NotStreaming, RawFrame
from transientcam_server.camera._acquisition import Acquisition, outdated
from transientcam_server.camera._darkness import Dark, Darkness, KeptCause
from transientcam_server.camera._events import (
    Event,
    LightConfirmedEvent,
    LightUnconfirmedEvent,
    OriginChanged,
)
from transientcam_server.camera._light import LightGuard
from transientcam_server.camera._status import AcquisitionStatus
from transientcam_server.errors import Problem, kinds
from transientcam_server.relay import RelayCamera

_T = TypeVar("_T")


class SharedAcquisition(Acquisition):
    """Follows what the camera does for others, and asks for changes before they are made here.

    Whether frames are captured, and with which sequence, is up to the origin. What this service
    does by itself (it starts, ends, or serves no client for a while) changes nothing there.
    ``darkness`` keeps what the origin has not confirmed, which is repeated after a restart.
    """

    def __init__(
        self,
        camera: RelayCamera,
        *,
        report: Callable[[Event], None],
        light: LightGuard,
        darkness: Darkness | None = None,
    ) -> None:
        super().__init__(camera, report=report, light=light, darkness=darkness)
        self._keeping = threading.Lock()
        self._origin = camera
        self._known = camera.origin
        self._running = self._started = camera.state is CameraState.STREAMING
        camera.on_unconfirmed = lambda ended: report(
            LightConfirmedEvent() if ended else LightUnconfirmedEvent(self._unconfirmed)
        )

    def start(self, *, dark: Dark | None = None) -> None:
        """Start the thread, and repeat what was not confirmed before a restart."""
        super().start()
        if dark is not None and dark.cause != "unwritable":
            self.safe_off()

    @property
    def offs(self) -> int:
        """Counts how often the light was to go off, here."""
        return self._origin.offs

    def _begin_stop(self, cause: KeptCause) -> "Future[None]":
        return self._off(self._origin.begin_stop, cause)

    def safe_off(self) -> "Future[None]":
        """Switch the light off at the origin, at once; done once the origin has confirmed that.

        It waits for no thread here, and is sent again until then.
        """
        return self._off(self._origin.begin_safe_off, "safe-off")

    def status(self) -> AcquisitionStatus:
        """Return the present status; never waits."""
        status = super().status()
        if not self._origin.switching_off:
            return status
        why = "" if status.reason is None else f" ({status.reason})"
        return replace(status, switching_off=True, reason=f"{self._unconfirmed}{why}")

    def occupy(
        self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T], *, offs: int
    ) -> "Future[_T]":
        """Refuse exclusive use of the camera, which is not this service's to give.

        Raises Problem ``camera-busy``, always.
        """
        url = self._origin.url
        raise Problem(kinds.CAMERA_BUSY, f"The camera belongs to {url}: do it there.")

    def _end_uncontrolled(self) -> None:
        self._act_on_lapse()  # the origin guards its light by itself

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

    def _end_light(self, *, safe: bool = False) -> None:
        """Leave the light to the origin: only what clients ask for goes there."""
        self._started = False

    def _start(self, offs: int) -> None:
        if not self._origin.start_unless(offs):
            raise outdated()
        self._forget_off()
        self._follow()

    def _stop(self, cause: KeptCause = "stop") -> None:
        """Stop where a lease has lapsed."""
        self._begin_stop(cause)

    def _off(self, begin: Callable[[], "Future[None]"], cause: KeptCause) -> "Future[None]":
        def follow(done: "Future[None]") -> None:
            if done.exception() is None:
                self._running = self._started = False
            if not isinstance(done.exception(), CameraLost):  # by which this service ends
                self._forget_off()

        with self._keeping:
            if self._darkness is not None:
                self._darkness.keep(Dark(cause))
            off = begin()
        off.add_done_callback(follow)
        return off

    def _forget_off(self) -> None:
        """Keep no longer that the light is to go off, unless there is more to be confirmed."""
        with self._keeping:
            if self._darkness is not None and not self._origin.switching_off:
                self._darkness.keep(None)

    @property
    def _unconfirmed(self) -> str:
        url = self._origin.url
        return f"the light may be on, and is being switched off: {url} has not confirmed it"

    def _camera_works(self) -> None:
        self._started = self._running
        super()._camera_works()

    def _switch_off_at_end(self) -> None:
        """Leave the light to the origin; `RelayCamera.close` ends what was switched on here."""
        self._origin.on_unconfirmed = lambda ended: None  # nobody listens any more
