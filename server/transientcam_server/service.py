"""The parts of one running service and their life: what a request or a stream finds here."""

import asyncio
import contextlib
import logging
import secrets
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import version
from typing import Any, Final, Protocol

import transientcam_moments as tm
from transientcam import wire
from transientcam_driver import AppliedSequence, Camera, DriverError
from transientcam_server.broadcast import Channel, Hub
from transientcam_server.camera import (
    Acquisition,
    CalibrationStore,
    Calibrator,
    Captured,
    Change,
    Dark,
    Darkness,
    Event,
    Jobs,
    Lease,
    LeaseManager,
    LightGuard,
    LightOffEvent,
    LightRules,
    OriginChanged,
    OriginLease,
    SequenceChanged,
    SharedAcquisition,
    Supervision,
    Timer,
    calibration_of,
    open_chosen,
    sensor_of,
    snapshot_of,
    stated_sensor,
)
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import (
    Frame,
    History,
    Intrinsics,
    OtherPackages,
    Pipeline,
    SettingsVersion,
    Workers,
    calibration_id,
    known_intrinsics,
    require_estimator,
    suited,
)
from transientcam_server.planning import FrontCache, Looks, Planner, PlanningProcess, PlanningQueue
from transientcam_server.recording import (
    Header,
    Library,
    RecordedFramesCache,
    RecordingOptions,
    ReplayCamera,
)
from transientcam_server.relay import RelayCamera
from transientcam_server.settings import ReconstructionSettings, Settings

_log = logging.getLogger("transientcam_server.service")
VERSION: Final = version("transientcam")
_CLOSING_S = 1.0
_WORKERS_END_S = 1.0
_OPEN_S = 5.0
_KEPT_S = 0.1
"""An answer to what switched the light off waits for the disk no longer."""
_NOISE_FRAMES: Final = 16
"""So many frames after another the noise of the images is held against the stated sensor's."""
WORKER_THREADS: Final = "worker"
"""What the names of their threads begin with."""


class Observer(Protocol):
    """Is notified of what happens to frames, on the event loop; must return at once."""

    def happened(self, event: Event) -> None:
        """Take an event of the acquisition."""
        ...

    def superseded(self, meta: Mapping[str, Any]) -> None:
        """Take the metadata of a frame that is the newest no more."""
        ...


class Service:
    """A camera, its acquisition, its pipeline and its clients.

    Attributes
    ----------
    relay, origin_lease
        The camera as that of another service, and the lease there; None of a camera here.
    applied
        The sequence that frames are captured with from now on.
    mjpeg_clients
        How many clients are sent a preview as MJPEG.
    closing
        Set once the service ends: what takes long asks for it.
    simulating
        Held while another simulated scene is prepared.
    taking_in
        Held while a recording that was sent here is read.
    sensor
        As the camera, its origin or the settings state it; None where none does.
    observers
        Notified of every event of the acquisition, and of every frame that was the newest.
    """

    def __init__(self, camera: Camera, settings: Settings) -> None:
        self.camera = camera
        self.relay = camera if isinstance(camera, RelayCamera) else None
        self._service_id = secrets.token_hex(8) if self.relay is None else self.relay.service_id
        self.settings = settings
        self.hub = Hub()
        self.history = History(settings.history)
        self.mjpeg_clients = 0
        self.observers: list[Observer] = []
        self.closing = threading.Event()
        self.simulating = asyncio.Lock()
        self.taking_in = asyncio.Lock()
        self._superseded: list[Frame] = []
        self._successor: tuple[str, Camera] | None = None
        self._changing = asyncio.Lock()
        self._executor = ThreadPoolExecutor(
            settings.workers, WORKER_THREADS, initializer=tm.kernels.use_one_thread
        )
        self.workers = Workers(self._executor, count=settings.workers)
        self.sensor = stated_sensor(camera, settings.sensor)
        sensor = sensor_of(camera, settings.sensor)
        self._noise_checked, self._noise_differs = 0, False
        reconstruction = self._of_origin(
            suited(settings.reconstruction, camera.capabilities.sampling)
        )
        self.planner = Planner(camera.capabilities, sensor, reconstruction)
        self.planning = PlanningQueue(PlanningProcess(settings.limits.plan_s))
        self.other_packages = OtherPackages(settings.limits.estimator_s)
        kept = CalibrationStore(settings.calibrations, given=settings.calibration)
        self.pipeline = Pipeline(
            camera,
            reconstruction,
            self.workers,
            sensor=self.sensor,
            calibration=calibration_of(camera, settings.calibration, kept),
            intrinsics=lambda: self.intrinsics,
            images_known=self.has_images,
        )
        simulated = camera.simulation is not None
        twin = partial(snapshot_of, camera, settings.camera) if simulated else None
        self.looks = Looks(
            self.planner, self.workers, self.planning, twin, calibrated_c=self._calibrated_c
        )
        self.fronts = FrontCache(
            self.planner, self.workers, self.planning, self.looks, simulated=simulated
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._rules = rules = LightRules.of(camera, settings)
        self._light = LightGuard(unserved_s=rules.unserved_s, unused_s=rules.unused_s)
        unit = rules.unit if self.relay is None else f"relay:{self.relay.url}"
        self._darkness = None if unit is None else Darkness(settings.light.directory, unit)
        how: dict[str, Any] = {"report": self._from_acquisition, "light": self._light}
        how |= {"darkness": self._darkness}
        self.origin_lease: OriginLease | None = None
        if self.relay is None:
            watching = Supervision(camera, silence_s=settings.limits.unserved_s)
            self.acquisition = Acquisition(
                camera, delay_s=rules.delay_s, supervision=watching, **how
            )
        else:
            self.acquisition = SharedAcquisition(self.relay, **how)
            self.origin_lease = OriginLease(self.relay, self.acquisition)
        self.hub.obstacle = lambda: self.acquisition.status().obstacle
        self.applied: AppliedSequence = camera.applied
        self.jobs = Jobs(
            report=lambda job: self.hub.notify("job-changed", {"job": job.to_document()})
        )
        self.calibrations = Calibrator(
            camera,
            kept,
            acquisition=self.acquisition,
            pipeline=self.pipeline,
            sensor=sensor,
            jobs=self.jobs,
            history=self.history,
            notify=partial(self.hub.notify, "calibration-changed"),
        )
        self.lease = LeaseManager(
            report=self._lease_changed, call_later=self._call_later, due=self._lease_due
        )
        self.recordings = Library(
            settings.recordings, header=self._recording_header, notify=self._notify_from_thread
        )
        self.recorded_frames = RecordedFramesCache(
            self.recordings, self.pipeline, lens=settings.lens
        )

    def _calibrated_c(self) -> float | None:
        calibration = self.pipeline.calibration
        return None if calibration is None else calibration.gains.temperature_c

    @property
    def identity(self) -> dict[str, Any]:
        """Which service this is, and through which others the frames come."""
        path = (self._service_id,) if self.relay is None else self.relay.path
        return {
            "name": "transientcam",
            "version": VERSION,
            "service_id": self._service_id,
            "path": list(path),
        }

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Capture from entry to exit."""
        self._loop = asyncio.get_running_loop()
        self.other_packages.open()  # before frames, which what is imported would delay
        with contextlib.suppress(Problem):  # a disk that does not answer keeps nobody dark
            await self.recordings.disk.run(self.recordings.open)
        dark = await self._kept_dark()
        if dark is None and self.relay is None and not self._rules.capture_at_start:
            dark = Dark("start")
        if dark is not None:
            _log.warning("%s", dark)
        if (strange := self.intrinsics.off_the_image) is not None:
            _log.warning("lens: %s", strange)
        self._light.turned()
        self._light.used()
        self.acquisition.start(dark=dark)
        turning = asyncio.create_task(
            self._light.keep(used=self._is_used, reads=lambda: self.hub.reads)
        )
        try:
            yield
        finally:
            turning.cancel()
            self.closing.set()
            await self.planning.close()
            self.lease.close()
            self.hub.close()
            self.jobs.cancel_all()
            # not behind frames that are computed: the light goes off now
            await asyncio.to_thread(self.acquisition.stop)
            if self._darkness is not None:
                await asyncio.to_thread(self._darkness.close)
            await self.jobs.close()
            await asyncio.to_thread(self.other_packages.close)
            await asyncio.to_thread(self.recordings.close)
            ended = await self.workers.close(within_s=_WORKERS_END_S)
            if not ended:
                _log.warning("a worker does not end; what it computes is dropped")
            self._executor.shutdown(wait=ended, cancel_futures=True)

    @property
    def successor(self) -> tuple[str, Camera] | None:
        """Name and camera, open, that this process is to serve next; None to go on with this."""
        return self._successor or getattr(self.camera, "found", None)

    async def change_camera(self, spec: str) -> None:
        """Open another camera; once it is open, switch the light of this one off and end with it.

        Raises Problem ``camera-failed`` where it cannot be opened: this one goes on.
        """
        async with self._changing:
            if self.successor is not None:
                raise Problem(kinds.CAMERA_BUSY, "The camera is changed already.")
            try:
                opened = await asyncio.to_thread(open_chosen, spec)
            except DriverError as error:
                detail = f"{spec} cannot be opened, so that nothing was changed: {error}"
                raise Problem(kinds.CAMERA_FAILED, detail, field="camera", value=spec) from error
            try:
                await asyncio.to_thread(self.acquisition.stop)
            finally:  # also where the request is cancelled: this one serves no more
                self._successor = spec, opened

    async def close_streams(self) -> None:
        """Close every stream, and give clients that still read the time to receive the reason."""
        self.closing.set()
        await self.planning.close()
        self.hub.close()
        self.jobs.cancel_all()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_CLOSING_S):
                await self.hub.deserted.wait()

    def channel_table(self, channels: Iterable[Channel]) -> tuple[wire.Channel, ...]:
        """Return what frames of these channels look like with the present sequence."""
        return tuple(each.describe(self.camera.capabilities, self.applied) for each in channels)

    @property
    def has_images(self) -> bool:
        """Whether frames have images, and not their moments alone."""
        return self.relay is None or self.relay.has_images

    @property
    def watched(self) -> bool:
        """Whether frames are sent to a client or recorded."""
        recorded = self.recordings.active_id is not None
        return recorded or bool(self.hub.clients or self.mjpeg_clients)

    async def _kept_dark(self) -> Dark | None:
        """Return why the light was off when the service last ran, None where it was not."""
        if self._darkness is None:
            return None
        try:
            return await asyncio.wait_for(asyncio.to_thread(self._darkness.open), _OPEN_S)
        except TimeoutError:
            return Dark("unreadable", f"the disk did not answer within {_OPEN_S:g} s")

    async def off_kept(self) -> None:
        """Wait a moment until it is kept that the light is off."""
        if self._darkness is not None:
            written = asyncio.wrap_future(self._darkness.written)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_KEPT_S):
                    await asyncio.shield(written)

    @property
    def intrinsics(self) -> Intrinsics:
        """Where the pixels look; another simulated scene may have another lens."""
        camera, simulation = self.camera, self.camera.simulation
        width, height = camera.capabilities.width, camera.capabilities.height
        return known_intrinsics(
            self.settings.lens,
            width=width,
            height=height,
            reported=None if camera.factory is None else camera.factory.lens,
            mounted=None if camera.factory is None else camera.factory.extrinsics,
            scene=None if simulation is None else simulation.lens(width=width, height=height),
            recorded=camera.intrinsics if isinstance(camera, ReplayCamera) else None,
            relayed=None if self.relay is None else self.relay.origin.intrinsics,
        )

    def not_ready(self) -> list[str]:
        """Return why no frames can be had; empty where they can."""
        return self.acquisition.status().obstacles

    def _from_acquisition(self, event: Event) -> None:
        """Carry an event from the acquisition's thread to the loop."""
        assert self._loop is not None  # noqa: S101 - the thread is started after it is set
        # first, so that no frame can be missing from the past of a recording that begins now
        self._loop.call_soon_threadsafe(self._happened, event)
        if isinstance(event, Captured):
            self.recordings.offer(event.raw, event.applied)

    async def record(
        self, options: RecordingOptions, *, history_s: float | None, frame: int | None = None
    ) -> dict[str, Any]:
        """Start a recording, with the frames of the last seconds if wanted, and describe it.

        With ``frame`` it begins with this one of them instead. Raises Problem as `Library.start`;
        ``only-moments`` without images; ``frame-gone`` and ``unknown-frame``.
        """
        self.require_images("Images are recorded")
        past = partial(self.history.newest, history_s or 0.0)
        if frame is not None:
            kept = self.history.frame(frame)
            if kept.recipe.applied != self.camera.applied:
                raise Problem(kinds.FRAME_GONE, f"Frame {frame} is of a sequence that has changed.")
            past = partial(list, [kept])
        elif not history_s:
            return await self.recordings.disk.run(self.recordings.start, options)
        # it waits for its past, also where the client is gone
        return await asyncio.shield(self.workers.start(self._record_past(options, past)))

    async def _record_past(
        self, options: RecordingOptions, frames: Callable[[], list[Frame]]
    ) -> dict[str, Any]:
        starting = replace(options, past=True)
        described = await self.recordings.disk.run(self.recordings.start, starting)
        past = [(each.raw, each.recipe.applied) for each in frames()]
        count = self.recordings.precede(described["id"], past)
        return described | {"history_frames": count}

    def _notify_from_thread(self, kind: str, details: Mapping[str, Any]) -> None:
        assert self._loop is not None  # noqa: S101 - nothing is recorded before it is set
        self._loop.call_soon_threadsafe(self.hub.notify, kind, details)

    def _recording_header(self, recording_id: str, name: str, started_s: float) -> Header:
        """Return what a recording that starts now has to know to be evaluated alone."""
        camera, simulation = self.camera, self.camera.simulation
        applied = camera.applied
        gains = self.pipeline.gains_for(applied)
        return Header(
            recording_id=recording_id,
            name=name,
            started_s=started_s,
            applied=applied,
            capabilities=camera.capabilities,
            camera={
                "spec": self.settings.camera,
                "scene": None if simulation is None else simulation.scene,
                "intrinsics": asdict(self.intrinsics),
                "sensor": None if self.sensor is None else asdict(self.sensor),
            },
            calibration={
                "id": calibration_id(gains),
                "temperature_c": None if gains is None else gains.temperature_c,
            },
            calibration_planes=None if gains is None else gains.planes,
            calibration_bad=None if gains is None else gains.bad,
            calibration_waveform=None if gains is None else gains.waveform,
            reconstruction=self.pipeline.reconstruction.settings.model_dump(),
        )

    def reconstruct_with(self, settings: ReconstructionSettings) -> SettingsVersion:
        """Compute frames from the next one on with other settings.

        Raises Problem ``estimator-misfit`` where the estimator needs other frequencies than there
        are, ``only-moments`` for what is done with images that this service does not have.
        """
        require_estimator(settings, self.applied.sequence, field="estimator")
        possible = self._of_origin(settings)
        if settings.spoilt_images != possible.spoilt_images:
            self.require_images("The repair of corrupt images is set")
        if settings.still_frames != possible.still_frames:
            self.require_images("The noise that still_frames needs is measured")
        return self._reconstruct_with(settings)

    def _reconstruct_with(self, settings: ReconstructionSettings) -> SettingsVersion:
        before = self.pipeline.reconstruction
        now = self.pipeline.reconstruction = before.followed_by(settings)
        if now is not before:
            self.planner.reconstruct_with(settings)
            self.hub.notify("reconstruction-changed", {"reconstruction": now.to_document()})
        return now

    def _of_origin(self, settings: ReconstructionSettings) -> ReconstructionSettings:
        """Return settings with what the origin of moments has done before they come here."""
        if self.relay is None or self.has_images:
            return settings
        update: dict[str, Any] = {"spoilt_images": self.relay.origin.spoilt_images}
        if self.sensor is None:
            update["still_frames"] = 1
        return settings.model_copy(update=update)

    def require_images(self, done: str) -> None:
        """Refuse what needs images, where this service relays moments alone.

        ``done`` says what, for a sentence that goes on with "at the origin".
        Raises Problem ``only-moments``, with the address of the origin.
        """
        if self.relay is not None and not self.has_images:
            url = self.relay.url
            raise Problem(
                kinds.ONLY_MOMENTS,
                f"{done} at the origin, {url}: only moments come from there.",
                origin=url,
            )

    def require_no_recording(self, what: str) -> None:
        """Refuse what has the camera for itself, where a recording runs: ``recording-runs``."""
        running = self.recordings.active_id
        if running is not None:
            detail = f"{what} would end it; stop it first."
            raise Problem(kinds.RECORDING_RUNS, detail, recording=running)

    def _happened(self, event: Event) -> None:
        for observer in self.observers:
            observer.happened(event)
        match event:
            case Captured(raw, applied):
                self._report_superseded()
                frame = self.pipeline.frame(raw, applied)
                self.history.append(frame)
                self.hub.publish(frame)
                self.calibrations.observe(raw.temperature_c, applied)
            case LightOffEvent(dark):
                self.hub.notify("light-off", {"because": dark.cause, "reason": str(dark)})
            case OriginChanged():
                self._adopt_calibration()
                self._reconstruct_with(self._of_origin(self.pipeline.reconstruction.settings))
            case SequenceChanged(applied):
                before, self.applied = self.applied, applied
                self._notify_sequence_changed()
                self._notify_calibration(before)
            case _:
                self.hub.notify(event.notice, asdict(event))

    def _adopt_calibration(self) -> None:
        """Calibrate as the origin does from the next frame on, unless a file was given here."""
        if self.relay is None or self.settings.calibration is not None:
            return
        calibration = self.relay.origin.calibration
        gains = None if calibration is None else calibration.gains
        if calibration_id(gains) != self.calibrations.active_id:
            if calibration is not None:
                # before it is active: a relay of this one asks for what is; a file, but seldom
                self.calibrations.store.keep(calibration.capture)
            self.pipeline.calibration = calibration
            self.hub.notify("calibration-changed", self.calibrations.notice(self.applied))

    def _report_superseded(self) -> None:
        """Report former frames to the observers once nothing of them is being computed."""
        if self.hub.latest is not None:
            self._superseded.append(self.hub.latest)
        computing = [frame for frame in self._superseded if frame.computing]
        for frame in self._superseded:
            if frame not in computing:
                for observer in self.observers:
                    observer.superseded(frame.meta())
                if self.sensor is not None and frame.number >= self._noise_checked + _NOISE_FRAMES:
                    self._noise_checked = frame.number
                    self.workers.start(self._check_noise(frame))
        self._superseded = computing

    async def _check_noise(self, frame: Frame) -> None:
        """Notify clients when the images of a frame are not as noisy as their sensor is stated."""
        ratio, reason = await frame.noise()
        if ratio is not None and self._noise_differs != (reason is not None):
            self._noise_differs = reason is not None
            if reason is not None:
                _log.warning("%s", reason)
            self.hub.notify("noise-differs", {"ratio": ratio, "reason": reason})

    def _is_used(self) -> bool:
        """Return whether somebody needs the capture, other than for single frames."""
        shown = self.hub.subscribers or self.mjpeg_clients or self.recordings.active_id is not None
        controlled = self.lease.current is not None
        return bool(shown) or controlled or any(not job.finished for job in self.jobs.all)

    def _lease_due(self, lease: Lease | None) -> None:
        stops = lease is not None and lease.on_lapse == "stop"
        self._light.lapses_at(lease.expires_s if lease is not None and stops else None)

    def _call_later(self, delay_s: float, callback: Callable[[], None]) -> Timer:
        return asyncio.get_running_loop().call_later(delay_s, callback)

    def _lease_changed(self, change: Change, lease: Lease, former: Lease | None) -> None:
        details = {"change": change, "holder": lease.holder}
        self.hub.notify("lease-changed", details | ({"from": former.holder} if former else {}))
        if change == "lapsed" and lease.on_lapse == "stop":
            stopping = self.acquisition.set_running(False, cause="lapse")
            stopping.add_done_callback(_log_failure)
        if self.origin_lease is not None and change != "granted":
            self.origin_lease.release()  # behind the stop above; a new holder takes it anew

    def _notify_sequence_changed(self) -> None:
        sequence = self.applied.to_document()
        for outbox in self.hub.subscribers:
            channels = [each.to_document() for each in self.channel_table(outbox.channels)]
            notice = wire.Notice("sequence-changed", {"sequence": sequence, "channels": channels})
            outbox.put(notice)

    def _notify_calibration(self, before: AppliedSequence) -> None:
        """Notify clients when frames from now on are calibrated in another way."""
        fitted, fits = (self.pipeline.misfit(each) is None for each in (before, self.applied))
        if fitted != fits:
            notice = self.calibrations.notice(self.applied)
            if not fits:
                _log.warning("%s; using nominal gains", notice["reason"])
            self.hub.notify("calibration-changed", notice)


def _log_failure(stopped: Future[None]) -> None:
    if stopped.exception() is not None:
        # it is unplugged, or its heartbeat ends and it turns its light off by itself
        _log.error("the capture could not be stopped: %s", stopped.exception())
