"""The camera of another service, as a `transientcam_driver.Camera`."""

import logging
import secrets
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, Final

import transientcam
from transientcam import AsyncCamera
from transientcam_driver import (
    AppliedSequence,
    CameraError,
    CameraLost,
    CameraState,
    FrameTimeout,
    NotStreaming,
    ProtocolError,
    RawFrame,
    Sequence,
    Status,
)
from transientcam_driver.camera import HostCamera
from transientcam_driver.clock import Clock, RealClock
from transientcam_server.imaging import NOMINAL_ID
from transientcam_server.relay._delivery import Delivery
from transientcam_server.relay._frames import RAW, SUBSCRIBED, Collector, Parts, capture_of
from transientcam_server.relay._origin import Described, Origin, require_same_camera
from transientcam_server.relay._reports import RelayCounters, hops_of, lost_at_origin, status_of

_log = logging.getLogger("transientcam_server.relay.camera")
_SLICE_S: Final = 0.05
"""How long a reader may wait before it looks whether the camera was stopped."""
SILENT_S: Final = 1.0
SILENT_PERIODS: Final = 5.0
"""Without a frame for so long, the larger of both, the origin is asked whether it captures."""
_CAPTURING: Final = frozenset(("arming", "starting", "streaming"))


class RelayCamera(HostCamera):
    """Frames of another service, numbered on across its restarts; changes are made there.

    The camera is shared: it captures what and when the origin does, whichever client sets that.
    ``start``, ``stop``, ``safe_off`` and ``configure`` are made at the origin and raise
    `OriginRefused` where it refuses. What switches the light off goes there at once, whatever this
    relay knows of the origin, and is sent again until it is confirmed; ``start`` ends that.
    ``close`` switches off only what this relay has switched on.

    The connection is closed with the camera, also where this cannot be opened.

    ``service_id``: that of the service this camera belongs to; by it a loop of relays is found.
    ``origin``: what is relayed, as it described itself last.
    ``relayed``: what was missed on the way.
    ``on_unconfirmed``: called, on any thread, when the origin does not confirm that its light is
    off, with False, and when that has ended, with True.
    Raises CameraLost where the origin does not answer, is too old, lacks what is to be relayed, or
    relays this very service.
    """

    def __init__(
        self,
        origin: Origin,
        *,
        clock: Clock | None = None,
        unix_time_s: Callable[[], float] = time.time,
    ) -> None:
        super().__init__(clock or RealClock(), None)
        self.service_id = secrets.token_hex(8)
        self.relayed = RelayCounters()
        self._link = origin
        self._unix_time_s = unix_time_s
        self._stream: transientcam.Stream | None = None
        self._sequence_id = -1
        self._epochs = 0
        self._last: int | None = None  # as the origin counts frames
        self._added = 0  # to that, so that numbers go on after its restart
        self._device_time_s = 0.0
        self._switched_on = False
        self._outdated = False
        self._former_id: str | None = None
        self._gone: str | None = None
        self._heard_s = 0.0
        self._stop_lease: str | None = None
        self._first_offs = secrets.randbits(31)
        self._releasing: list[Delivery] = []
        self._safe_off = Delivery(
            lambda: origin.send_apart(AsyncCamera.safe_off), changed=self._takes_long
        )
        self._stop = Delivery(
            lambda: origin.send_apart(AsyncCamera.stop, lease_id=self._stop_lease),
            changed=self._takes_long,
        )
        self.on_unconfirmed: Callable[[bool], None] = lambda ended: None
        try:
            self.origin = origin.describe()
            self._capabilities = self.origin.capabilities
            self._connect(self.origin)
        except BaseException:
            origin.close()
            raise

    @property
    def off_switch(self) -> None:
        """None: the light is at the origin, which has a supervisor of its own."""
        return

    @property
    def path(self) -> tuple[str, ...]:
        """The ids of all services from this one to the camera."""
        return (self.service_id, *self.origin.path)

    @property
    def url(self) -> str:
        """Address of the origin."""
        return self._link.url

    @property
    def product(self) -> str:
        """What is relayed: ``raw`` or ``measured_moments``."""
        return self._link.product

    @property
    def has_images(self) -> bool:
        """Whether frames have images, and not their moments alone."""
        return self.product == RAW

    def device_time_s(self) -> float:
        """Time of the last frame, by the clock of the device."""
        return self._device_time_s

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence at the origin, for all its clients."""
        self._require_connected()
        self._capabilities.validate(sequence)
        self._adopt(self._link.configure(sequence.to_document()))
        return self._applied

    def start(self) -> None:
        """Let the origin capture; nothing is asked of one that does and is not to stop."""
        self.start_unless(self.offs)

    @property
    def offs(self) -> int:
        """Counts how often the light was to go off: `safe_off` and `stop`."""
        return self._first_offs + self._safe_off.asked + self._stop.asked

    def start_unless(self, offs: int) -> bool:
        """As `start`; return False where the light was to go off since there were so many ``offs``.

        The origin refuses a start that one of its own, or one from here, overtakes on the way.
        """
        self._require_connected()
        asked = self._safe_off.asked, self._stop.asked
        if self._first_offs + sum(asked) != offs:
            return False
        if self.switching_off or self._state is not CameraState.STREAMING:
            there = self._link.offs()
            if self.offs != offs:
                return False
            self._link.start(offs=there)
            for off, count in zip((self._safe_off, self._stop), asked, strict=True):
                off.end("the capture was started meanwhile", asked=count)
            with self._control:
                self._switched_on = True
                self._begin()
        return True

    def stop(self) -> None:
        """Stop the capture at the origin, for all its clients."""
        self._confirmed(self.begin_stop())

    def safe_off(self) -> None:
        """Switch the light off at the origin, whichever client holds the lease there."""
        self._confirmed(self.begin_safe_off())

    def begin_stop(self) -> "Future[None]":
        """As `stop`, without waiting: done once the origin has confirmed it, or refuses."""
        lease_id = self._link.lease_id
        if lease_id is not None or not self._stop.unconfirmed:
            self._stop_lease = lease_id
        return self._followed(self._stop.begin())

    def begin_safe_off(self) -> "Future[None]":
        """As `safe_off`, without waiting: in any state, and again until the origin confirms it."""
        return self._followed(self._safe_off.begin())

    @property
    def switching_off(self) -> bool:
        """Whether the light was to go off and the origin has not confirmed it."""
        return self._safe_off.unconfirmed or self._stop.unconfirmed

    def status(self) -> Status:
        """Ask the origin for the status of its camera, and whether it captures."""
        self._require_connected()
        document = self._ask()
        if document["status"] is None:
            raise self._lost("the origin's camera does not answer")
        return status_of(document["status"], epoch=self._applied.epoch)

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next frame that the origin sends."""
        end_s = self._clock.now_s() + timeout_s
        while True:
            self._require_connected()
            if self._state is not CameraState.STREAMING:
                raise NotStreaming(self._state)
            now_s = self._clock.now_s()
            raw = self._receive(max(0.0, min(_SLICE_S, end_s - now_s)))
            if raw is not None:
                return raw
            if self._outdated:
                self._refresh()
            frame_s = 1.0 / self._applied.frame_rate_hz
            if now_s - self._heard_s > max(SILENT_S, SILENT_PERIODS * frame_s):
                self._ask()
            if now_s >= end_s:
                raise FrameTimeout(timeout_s)

    def reconnect(self) -> None:
        """Find the origin again, and go on after the last frame where that is kept."""
        with self._control:
            self._require_open()
            if self._state is CameraState.DISCONNECTED:
                self._connect(self._link.describe())
                self.relayed.reconnects += 1

    def close(self) -> None:
        """Leave the origin, and switch off what this relay has switched on."""
        if self._closed:
            return
        if self._switched_on:
            with suppress(CameraError):
                self._link.stop()
        self._closed = True
        self._state = CameraState.DISCONNECTED
        if self.switching_off:
            _log.error(
                "%s has not confirmed that its light is off, and is asked at the next start",
                self.url,
            )
        for each in (self._safe_off, self._stop, *self._releasing):
            each.end("this service ends")
            each.join()
        self._link.close()

    def take_lease(self, holder: str, **terms: Any) -> None:
        """Take the lease of the origin for a client of this relay; terms as `Camera.lease` has."""
        self._require_connected()
        self.release_lease()
        for former in self._releasing:
            former.wait(self._link.timeout_s)  # refused while the origin has not confirmed that
        self._link.take_lease(f"{holder} (through a relay)", **terms)

    def release_lease(self) -> "Future[None] | None":
        """Give the lease of the origin back, if this relay has it, behind a stop that was made.

        Never waits: it is renewed no more, and the origin is told until it confirms that.
        """
        lease_id = self._link.abandon_lease()
        if lease_id is None:
            return None

        async def release() -> None:
            if self._stop.unconfirmed:  # it is made under this lease
                raise CameraLost("the stop before it is not confirmed")
            await self._link.send_apart(AsyncCamera.give_lease_back, lease_id=lease_id)

        delivery = Delivery(release)
        self._releasing = [*(each for each in self._releasing if each.unconfirmed), delivery]
        return delivery.begin()

    # -- what the origin is at ------------------------------------------------------------------

    def _connect(self, found: Described) -> None:
        if self.service_id in found.path:
            raise CameraLost(f"{self.url} relays this very service: a loop of relays")
        require_same_camera(self._capabilities, found.capabilities)
        if self.origin.service_id != found.service_id:  # it counts frames and sequences anew
            self.relayed.restarts += 1
            self._added += self._last or 0
            self._last, self._sequence_id, self._switched_on = None, -1, False
        self.origin, self._outdated, self._gone = found, False, None
        self._adopt(found.sequence)
        start = None if self._last is None else self._last + 1
        self._stream = self._link.stream(start=start, on_notice=self._noticed)
        self._collector = Collector(SUBSCRIBED[self._link.product])
        self._state = CameraState.IDLE
        self._ask()

    def _ask(self) -> dict[str, Any]:
        """Return the document of the origin's camera, and follow whether it captures."""
        self._heard_s = self._clock.now_s()
        try:
            document = self._link.camera()
        except CameraLost as error:
            raise self._lost(error.reason) from error
        if document["state"] == "lost":
            raise self._lost(lost_at_origin(document["reason"]))
        if document["state"] != "calibrating":  # frames go on afterwards
            self._follow(document["state"] in _CAPTURING)
        return document

    def _follow(self, capturing: bool) -> None:
        with self._control:
            if not capturing:
                self._state, self._switched_on = CameraState.IDLE, False
            elif self._state is not CameraState.STREAMING:
                self._begin()

    def _begin(self) -> None:
        self._state, self._heard_s = CameraState.STREAMING, self._clock.now_s()

    def _followed(self, off: "Future[None]") -> "Future[None]":
        """Note that the origin captures no more, once it says so; never waits for a lock."""

        def follow(done: "Future[None]") -> None:
            if done.exception() is None and self._state is CameraState.STREAMING:
                self._state, self._switched_on = CameraState.IDLE, False

        off.add_done_callback(follow)
        return off

    def _confirmed(self, off: "Future[None]") -> None:
        try:
            off.result(self._link.timeout_s)
        except TimeoutError:
            raise CameraLost(f"{self.url} has not confirmed it, and is asked again") from None

    def _takes_long(self, ended: bool) -> None:
        if not ended:
            _log.warning("%s has not confirmed that its light is off: it is asked again", self.url)
        self.on_unconfirmed(ended)

    def _refresh(self) -> None:
        """Take over what the origin has changed beside its sequence."""
        self._outdated = False
        try:
            found = self._link.describe()
        except CameraLost as error:
            raise self._lost(error.reason) from error
        if found.service_id != self.origin.service_id:
            raise self._lost("the origin was started anew")
        self.origin = found

    def _adopt(self, document: Mapping[str, Any]) -> None:
        """Take over a newer sequence of the origin."""
        with self._control:
            sequence_id = int(document["sequence_id"])
            if sequence_id <= self._sequence_id:  # an older one, of a notice that was on its way
                return
            sequence = Sequence.from_document(document)
            self._epochs += 1
            self._applied = self._capabilities.describe(sequence, epoch=self._epochs)
            self._sequence_id = sequence_id

    def _lost(self, reason: str) -> CameraLost:
        with self._control:
            self._state = CameraState.DISCONNECTED
            if self._stream is not None:
                self._stream.close()
        return CameraLost(reason)

    # -- frames ---------------------------------------------------------------------------------

    def _noticed(self, notice: transientcam.Notice) -> None:
        """Note what a notice of the stream says; it is acted on between two messages."""
        match notice.kind:
            case "camera-lost":
                self._gone = lost_at_origin(notice.details.get("reason"))
            case "calibration-changed" | "simulation-changed":
                self._outdated = True
            case "reconstruction-changed" if not self.has_images:  # of corrupt ones, it may be
                self._outdated = True
            case "dropped" if notice.details["channel"] == self._counted:
                self.relayed.dropped_frames += int(notice.details["count"])

    @property
    def _counted(self) -> int | None:
        """The channel whose frames are counted: all products of one are dropped together."""
        hello = None if self._stream is None else self._stream.hello
        return None if hello is None else hello.channels[0].channel

    def _receive(self, timeout_s: float) -> RawFrame | None:
        """Return the next frame of the sequence that is set, None if none came in time."""
        stream = self._stream
        assert stream is not None  # noqa: S101 - a connected camera has one
        frame = None
        try:
            with suppress(transientcam.FrameTimeout):
                frame = stream.receive(timeout_s=timeout_s)
        except transientcam.TransientcamError as error:
            self._require_open()
            raise self._lost(str(error)) from error
        if self._gone is not None:
            raise self._lost(self._gone)
        if stream.hello is not None:
            if stream.hello.server.get("service_id") != self.origin.service_id:
                raise self._lost("the origin was started anew")
            self._adopt(stream.sequence)
        if frame is None:
            return None
        self._heard_s = self._clock.now_s()
        parts = self._collector.add(frame)
        return None if parts is None else self._capture(parts)

    def _capture(self, parts: Parts) -> RawFrame | None:
        frame = next(iter(parts.values()))
        meta, applied = frame.meta, self._applied
        replaced = meta["sequence_id"] != self._sequence_id
        if not (replaced or self.has_images or self._calibrated_alike(meta["calibration_id"])):
            return None  # counted as missed with the next one
        missed = 0 if self._last is None else max(0, frame.frame - self._last - 1)
        self._last = frame.frame
        self.relayed.missed_frames += missed
        if replaced:
            return None
        lost = meta["lost_images"] + missed * applied.images
        try:
            capture = capture_of(
                parts,
                applied,
                self._capabilities,
                number=self._added + frame.frame,
                lost_images=lost,
                hops=hops_of(
                    meta,
                    service_id=self.service_id,
                    now_unix_s=self._unix_time_s(),
                    missed_frames=self.relayed.missed_frames,
                ),
            )
        except ProtocolError:
            self._lost("")
            raise
        self._device_time_s = meta["device_time_s"]
        self.counters.frames += 1
        self.counters.images += applied.images
        self.counters.lost += lost
        return capture

    def _calibrated_alike(self, calibration_id: str) -> bool:
        """Return whether moments have the calibration that is known here; another is asked for.

        Those of a former one, which the origin still keeps, do not: their gains and bad pixels are
        not known any more.
        """
        if calibration_id != self._calibration_id and (
            self._outdated or calibration_id != self._former_id
        ):
            self._former_id = calibration_id  # unless it is the new one
            self._refresh()
        return calibration_id == self._calibration_id

    @property
    def _calibration_id(self) -> str:
        """What frames of the origin say that they are calibrated by."""
        calibration = self.origin.calibration
        if calibration is None or calibration.capture.misfit(self._applied, self._capabilities):
            return NOMINAL_ID
        return calibration.gains.id
